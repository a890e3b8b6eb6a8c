/* SPDX-License-Identifier: MIT */
/* An exchange on a scripted wire, with slaves that answer as scripted. */
#ifndef TESTS_UNIT_BUS_EXCHANGE_BENCH_H
#define TESTS_UNIT_BUS_EXCHANGE_BENCH_H

#include "bus/exchange.h"
#include "bus/exchange_list.h"
#include "harness/test.h"
#include "unit/master/link/fake_wire.h"
#include "wire/al.h"

enum { DC_REF = 0x1001, DEADLINE_NS = 400000, PERIOD_NS = 1000000 };

struct bench {
	struct fake_wire wire;
	struct line *line;
	struct exchange *ex;
	uint8_t image[LIMIT_IMAGE_BYTES];
	int64_t dc_offset_ns;
	uint16_t lrw_wkc;
	uint16_t dc_wkc;
	uint8_t input; /* what the slaves write to every input byte */
	uint32_t output_bytes;
};

/* Datagrams by command; inputs get bench->input, FRMW the time of the wire plus an offset. */
static inline void play_slaves(struct fake_wire *wire, uint8_t *frame, size_t len)
{
	struct bench *b = wire->user;
	struct ecat_datagram dg;
	size_t pos = 0;

	frame[6] |= 0x02;
	while (ecat_frame_next(frame, len, &pos, &dg) == 1) {
		if (dg.cmd == ECAT_CMD_LRW) {
			uint32_t from = ecat_logical_address(&dg) & 0xffff;

			for (uint32_t i = 0; i < dg.data_len; i++) {
				if (from + i >= b->output_bytes) {
					dg.data[i] = b->input;
				} else {
					dg.data[i] ^= 0xff; /* must not come back into the image */
				}
			}
			put_le16(dg.wkc, b->lrw_wkc);
		} else if (dg.cmd == ECAT_CMD_FRMW || dg.cmd == ECAT_CMD_FPRD) {
			uint16_t wkc = dg.cmd == ECAT_CMD_FPRD && b->dc_wkc > 1 ? 1 : b->dc_wkc;

			if (wkc > 0) {
				put_le64(dg.data, (uint64_t)(wire->now_ns + b->dc_offset_ns));
			}
			put_le16(dg.wkc, wkc);
		} else if (dg.cmd == ECAT_CMD_BRD) {
			put_le16(dg.data, dg.ado == 0x0130 ? AL_OP : 253);
			dg.data[3] |= dg.ado == 0x092c ? 0x80 : 0;
			put_le16(frame + (dg.data - frame) - 8, 2);
			put_le16(dg.wkc, 2);
		}
	}
}

static inline struct exchange_plan small_plan(void)
{
	return (struct exchange_plan){
		.image_bytes = 28,
		.output_bytes = 12,
		.chunk_bytes = { 28 },
		.chunk_count = 1,
		.chunk_wkc = { 3 },
		.wkc_expected = 3,
		.dc_reference = DC_REF,
		.slave_count = 1,
	};
}

static inline struct bench *bench_create(const struct exchange_plan *plan)
{
	struct bench *b = calloc(1, sizeof(*b));

	b->wire.answer = play_slaves;
	b->wire.user = b;
	b->lrw_wkc = 3;
	b->dc_wkc = 1;
	b->input = 0x5a;
	b->dc_offset_ns = INT64_C(800000000000000000);
	b->output_bytes = plan->output_bytes;
	CHECK_EQ(line_create(fake_platform(&b->wire), fake_transport(&b->wire), &b->line), 0);
	CHECK_EQ(exchange_create(plan, b->line, &b->ex), 0);
	return b;
}

static inline void bench_destroy(struct bench *b)
{
	exchange_destroy(b->ex);
	line_destroy(b->line);
	free(b);
}

static inline struct exchange_result run(struct bench *b)
{
	b->wire.now_ns = (b->wire.now_ns / PERIOD_NS + 1) * PERIOD_NS;
	return exchange_run(b->ex, b->image, (mono_t){ b->wire.now_ns + DEADLINE_NS });
}

#endif
