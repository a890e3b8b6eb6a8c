/* SPDX-License-Identifier: MIT */
#include "base/bytes.h"
#include "capture.h"
#include "harness/pcapng.h"
#include "harness/test.h"
#include "wire/datagram.h"
#include "wire/esc_reg.h"

enum { OPEN_MAX = 64 };

static int is_answer(const uint8_t *frame)
{
	return (frame[6] & 2) != 0;
}

static void first_datagram(const uint8_t *frame, size_t len, struct ecat_datagram *ret)
{
	static uint8_t copy[ECAT_FRAME_MAX_BYTES];
	size_t pos = 0;

	memcpy(copy, frame, len);
	CHECK_EQ(ecat_frame_next(copy, len, &pos, ret), 1);
}

/* The oldest request without answer that @answer fits. */
static struct capture_pair *find_request(struct capture_pairs *pairs, const uint8_t *answer,
					 size_t len)
{
	size_t oldest = pairs->count > OPEN_MAX ? pairs->count - OPEN_MAX : 0;
	struct ecat_datagram wanted;

	first_datagram(answer, len, &wanted);
	for (size_t i = oldest; i < pairs->count; i++) {
		struct capture_pair *p = &pairs->at[i];
		struct ecat_datagram dg;

		first_datagram(p->request, p->len, &dg);
		if (p->answer == NULL && dg.cmd == wanted.cmd && dg.idx == wanted.idx &&
		    dg.data_len == wanted.data_len) {
			return p;
		}
	}
	return NULL;
}

struct capture_pairs capture_pair_up(const struct bytes *capture)
{
	struct capture_pairs pairs = { .at = calloc(capture->len / 60 + 1, sizeof(*pairs.at)) };
	struct pcapng_packet p;
	struct pcapng file;
	int64_t first_ns = INT64_MIN;

	CHECK(pairs.at != NULL);
	CHECK_EQ(pcapng_open(&file, capture->at, capture->len), 0);
	while (pcapng_next(&file, &p) == 1) {
		struct capture_pair *request;

		if (p.len > ECAT_FRAME_MAX_BYTES || !ecat_frame_is_valid(p.bytes, p.len)) {
			continue;
		}
		first_ns = first_ns == INT64_MIN ? p.t_ns : first_ns;
		if (!is_answer(p.bytes)) {
			pairs.at[pairs.count++] = (struct capture_pair){ .t_ns = p.t_ns - first_ns,
									 .request = p.bytes,
									 .len = p.len };
			continue;
		}
		request = find_request(&pairs, p.bytes, p.len);
		if (request != NULL) {
			request->answer = p.bytes;
			request->answer_len = p.len;
		}
	}
	return pairs;
}

/* The first latch after which the slave's times were read. */
struct latch {
	uint16_t station;
	int64_t t_ns;
	int is_latched;
	int is_read;
	uint64_t value;
};

static void look(struct latch *l, const struct ecat_datagram *dg, int64_t t_ns)
{
	int is_write =
		dg->cmd == ECAT_CMD_BWR || (dg->cmd == ECAT_CMD_FPWR && dg->adp == l->station);
	int is_read = dg->cmd == ECAT_CMD_FPRD && dg->adp == l->station && get_le16(dg->wkc) == 1;

	if (is_write && dg->ado == ESC_REG_DC_RECEIVE_TIME_PORT && !l->is_read) {
		l->t_ns = t_ns;
		l->is_latched = 1;
	}
	if (!is_read || !l->is_latched) {
		return;
	}
	if (dg->ado == ESC_REG_DC_RECEIVE_TIME_PORT && !l->is_read) {
		l->value = get_le32(dg->data);
		l->is_read = 1;
	}
	if (dg->ado == ESC_REG_DC_RECEIVE_TIME_PU && dg->data_len == 8) {
		l->value = get_le64(dg->data);
		l->is_read = 1;
	}
}

uint64_t capture_learn_clock(const struct capture_pairs *pairs, uint16_t station, int64_t start_ns)
{
	struct latch l = { .station = station };

	for (size_t i = 0; i < pairs->count; i++) {
		const struct capture_pair *p = &pairs->at[i];
		uint8_t frame[ECAT_FRAME_MAX_BYTES];
		struct ecat_datagram dg;
		size_t pos = 0;

		if (p->answer == NULL) {
			continue;
		}
		memcpy(frame, p->answer, p->answer_len);
		while (ecat_frame_next(frame, p->answer_len, &pos, &dg) == 1) {
			look(&l, &dg, p->t_ns);
		}
	}
	return l.is_read ? l.value - (uint64_t)(start_ns + l.t_ns) : 0;
}
