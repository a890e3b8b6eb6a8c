/* SPDX-License-Identifier: MIT */
#include "capture.h"

#include <errno.h>
#include <sys/stat.h>

#include "base/bytes.h"
#include "harness/pcapng.h"
#include "harness/test.h"
#include "wire/datagram.h"
#include "wire/esc_reg.h"
#include "wire/sii.h"

enum { EEPROM_BYTES = 2048, PATH_BYTES = 1024 };

static const char *data_folder(void)
{
	const char *folder = getenv("ECDAQ_DATA");

	if (folder == NULL || folder[0] == '\0') {
		folder = getenv("ECDAQ_SHARED_DATA");
	}
	return folder == NULL || folder[0] == '\0' ? REPLAY_DEFAULT_DATA : folder;
}

const char *capture_folder(const char *name)
{
	static char path[PATH_BYTES];

	snprintf(path, sizeof(path), "%s/%s", data_folder(), name);
	return path;
}

struct bytes capture_load(const char *name)
{
	struct bytes b = { .at = NULL };
	char path[PATH_BYTES];
	struct stat st;
	FILE *file;

	if (stat(data_folder(), &st) < 0) {
		SKIP("no captures of real slaves here (ECDAQ_DATA)");
	}
	snprintf(path, sizeof(path), "%s/%s", data_folder(), name);
	file = fopen(path, "rb");
	if (file == NULL) {
		test_fail(__FILE__, __LINE__, "%s: %s", path, strerror(errno));
	}
	CHECK_EQ(fseek(file, 0, SEEK_END), 0);
	b.len = (size_t)ftell(file);
	rewind(file);
	b.at = malloc(b.len + 1);
	CHECK(b.at != NULL);
	CHECK_EQ(fread(b.at, 1, b.len, file), b.len);
	fclose(file);
	return b;
}

void capture_free(struct bytes *b)
{
	free(b->at);
	b->at = NULL;
}

/* Calls @each for every datagram of every frame that came back from the slaves. */
static void each_answer(const struct bytes *capture,
			void (*each)(void *ctx, const struct ecat_datagram *dg), void *ctx)
{
	struct pcapng_packet p;
	struct pcapng file;

	CHECK_EQ(pcapng_open(&file, capture->at, capture->len), 0);
	while (pcapng_next(&file, &p) == 1) {
		uint8_t frame[ECAT_FRAME_MAX_BYTES];
		struct ecat_datagram dg;
		size_t pos = 0;

		if (p.len > sizeof(frame) || !ecat_frame_is_valid(p.bytes, p.len) ||
		    !(p.bytes[6] & 2)) {
			continue;
		}
		memcpy(frame, p.bytes, p.len);
		while (ecat_frame_next(frame, p.len, &pos, &dg) == 1) {
			each(ctx, &dg);
		}
	}
}

/* What the answers of one slave have told so far. */
struct learning {
	struct bytes image;
	uint32_t word; /* last one asked for */
	uint16_t station;
	uint16_t position; /* as it comes back, counted up */
	uint16_t slaves;
};

static void learn(void *ctx, const struct ecat_datagram *dg)
{
	struct learning *l = ctx;
	int is_ours = dg->adp == l->station;

	if (get_le16(dg->wkc) == 0) {
		return;
	}
	if (is_ours && dg->cmd == ECAT_CMD_FPWR && dg->ado == ESC_REG_EEPROM_CONTROL &&
	    dg->data_len >= 6) {
		l->word = get_le32(dg->data + 2);
	} else if (is_ours && dg->cmd == ECAT_CMD_FPRD && dg->ado == ESC_REG_EEPROM_DATA &&
		   ((size_t)l->word + 4) * 2 <= l->image.len) {
		memcpy(l->image.at + (size_t)l->word * 2, dg->data, dg->data_len);
	} else if (dg->cmd == ECAT_CMD_APRD && dg->ado == ESC_REG_PDI_CONTROL &&
		   dg->adp == (uint16_t)(l->slaves - l->position)) {
		memcpy(l->image.at, dg->data, 2);
	}
}

static void count_slaves(void *ctx, const struct ecat_datagram *dg)
{
	uint16_t *slaves = ctx;

	if (dg->cmd == ECAT_CMD_BRD && dg->adp > *slaves) {
		*slaves = dg->adp;
	}
}

struct bytes capture_learn_sii(const struct bytes *capture, uint16_t station, uint16_t position)
{
	struct learning l = { .image = { .at = calloc(1, EEPROM_BYTES), .len = EEPROM_BYTES },
			      .station = station,
			      .position = position };

	CHECK(l.image.at != NULL);
	each_answer(capture, count_slaves, &l.slaves);
	each_answer(capture, learn, &l);
	l.image.at[14] = sii_checksum(l.image.at);
	return l.image;
}
