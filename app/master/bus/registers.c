/* SPDX-License-Identifier: MIT */
#include "bus/registers.h"

#include <errno.h>
#include <string.h>

#include "base/bytes.h"
#include "bus/exchange_frame.h"

enum { LOOK_TRIES = 2, ACCESSES_PER_FRAME = 128 };

static const uint8_t source[6] = { 0x10, 0x10, 0x10, 0x10, 0x10, 0x10 };

static int is_reading(enum ecat_cmd cmd)
{
	return cmd != ECAT_CMD_APWR && cmd != ECAT_CMD_FPWR && cmd != ECAT_CMD_BWR &&
	       cmd != ECAT_CMD_LWR && cmd != ECAT_CMD_NOP;
}

/* Sent as zeros: it carries nothing to a slave, and a broadcast is ORed into what is sent. */
static int is_only_reading(enum ecat_cmd cmd)
{
	return cmd == ECAT_CMD_APRD || cmd == ECAT_CMD_FPRD || cmd == ECAT_CMD_BRD ||
	       cmd == ECAT_CMD_LRD;
}

/* One slave answers to an address; what several OR together is no data. */
static int is_single(enum ecat_cmd cmd)
{
	return cmd == ECAT_CMD_APRD || cmd == ECAT_CMD_FPRD;
}

/* As many of @access as fit into one frame. Returns how many. */
static size_t pack(struct ecat_frame_builder *fb, uint8_t *buf, size_t limit,
		   const struct access *access, size_t count, uint8_t idx)
{
	size_t n;

	ecat_frame_begin(fb, buf, source);
	for (n = 0; n < count && n < ACCESSES_PER_FRAME; n++) {
		const struct access *ac = &access[n];
		uint8_t *data;

		if (n > 0 && fb->len + EXCHANGE_OVERHEAD + ac->len > limit) {
			break;
		}
		data = ecat_frame_add(fb, ac->cmd, idx, ac->adp, ac->reg, ac->len);

		if (data == NULL) {
			break;
		}
		if (ac->data != NULL && !is_only_reading(ac->cmd)) {
			memcpy(data, ac->data, ac->len);
		}
	}
	return n;
}

static void unpack(uint8_t *frame, size_t len, struct access *access, size_t count)
{
	struct ecat_datagram dg;
	size_t pos = 0;

	for (size_t n = 0; n < count && ecat_frame_next(frame, len, &pos, &dg) == 1; n++) {
		access[n].wkc = get_le16(dg.wkc);
		if (access[n].wkc > 0 && (access[n].wkc == 1 || !is_single(access[n].cmd)) &&
		    access[n].data != NULL && is_reading(access[n].cmd)) {
			memcpy(access[n].data, dg.data, access[n].len);
		}
	}
}

int registers_run(struct bus *bus, struct access *access, size_t count)
{
	uint8_t frame[LIMIT_FRAME_BYTES];
	uint8_t answer[LIMIT_FRAME_BYTES];
	unsigned tries = bus->is_looking ? LOOK_TRIES : LINE_TRIES;

	while (count > 0) {
		struct ecat_frame_builder fb;
		size_t packed = 0;
		int r = -EMSGSIZE;

		for (unsigned i = 0; i < tries && r < 0 && r != -ECANCELED; i++) {
			if (line_pause(bus->line, i) < 0) {
				return -ECANCELED;
			}
			packed = pack(&fb, frame, line_frame_limit(bus->line), access, count,
				      bus->sequence++);
			if (packed == 0) {
				return -EMSGSIZE;
			}
			r = line_transact(bus->line, frame, ecat_frame_end(&fb), answer,
					  sizeof(answer), line_timeout(bus->line, i));
		}
		if (r < 0) {
			return r;
		}
		unpack(answer, (size_t)r, access, packed);
		access += packed;
		count -= packed;
	}
	return 0;
}

static int run_one(struct bus *bus, struct access *access)
{
	int r = registers_run(bus, access, 1);

	if (r < 0) {
		return -EIO;
	}
	if (access->wkc > 1) {
		return -EBADMSG;
	}
	return access->wkc == 1 ? 0 : -ENXIO;
}

int register_read(struct bus *bus, size_t pos, uint16_t reg, void *ret_data, uint16_t len)
{
	return run_one(bus, &(struct access){ .cmd = ECAT_CMD_FPRD,
					      .adp = bus->slave[pos].info.station_addr,
					      .reg = reg,
					      .len = len,
					      .data = ret_data });
}

int register_write(struct bus *bus, size_t pos, uint16_t reg, const void *data, uint16_t len)
{
	uint8_t copy[64];

	if (len > sizeof(copy)) {
		return -EMSGSIZE;
	}
	memcpy(copy, data, len);
	return run_one(bus, &(struct access){ .cmd = ECAT_CMD_FPWR,
					      .adp = bus->slave[pos].info.station_addr,
					      .reg = reg,
					      .len = len,
					      .data = copy });
}

int register_broadcast(struct bus *bus, uint16_t reg, const void *data, uint16_t len)
{
	uint8_t copy[64];
	struct access access = { .cmd = ECAT_CMD_BWR, .reg = reg, .len = len, .data = copy };

	if (len > sizeof(copy)) {
		return -EMSGSIZE;
	}
	memcpy(copy, data, len);
	return registers_run(bus, &access, 1) < 0 ? -EIO : access.wkc;
}
