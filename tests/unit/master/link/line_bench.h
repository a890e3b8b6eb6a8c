/* SPDX-License-Identifier: MIT */
/* A line on the fake wire, and a cycle that lets service frames ride. */
#ifndef TESTS_UNIT_LINK_LINE_BENCH_H
#define TESTS_UNIT_LINK_LINE_BENCH_H

#include "harness/test.h"
#include "link/line.h"
#include "unit/master/link/fake_wire.h"
#include "wire/esc_reg.h"

static inline size_t make_frame(uint8_t *frame, enum ecat_cmd cmd, uint8_t idx, uint16_t adp,
				uint16_t ado)
{
	static const uint8_t source[6] = { 0x10, 0x10, 0x10, 0x10, 0x10, 0x10 };
	struct ecat_frame_builder fb;

	ecat_frame_begin(&fb, frame, source);
	ecat_frame_add(&fb, cmd, idx, adp, ado, 2);
	return ecat_frame_end(&fb);
}

static inline struct line *line_on(struct fake_wire *wire)
{
	struct line *line = NULL;

	CHECK_EQ(line_create(fake_platform(wire), fake_transport(wire), &line), 0);
	return line;
}

/* Ask slave 0x1001 for its AL status, index 7, with 2 ms for the answer. */
static inline int ask_status(struct line *line, uint8_t answer[LIMIT_FRAME_BYTES])
{
	uint8_t frame[LIMIT_FRAME_BYTES];
	size_t len = make_frame(frame, ECAT_CMD_FPRD, 7, 0x1001, ESC_REG_AL_STATUS);

	return line_transact(line, frame, len, answer, LIMIT_FRAME_BYTES, (span_t){ 2000000 });
}

static const span_t ROOM = { 500000 };

struct ride {
	struct fake_wire *wire;
	struct line *line;
	unsigned cycles;
	unsigned taken;
	unsigned deaf; /* cycles that leave the answer on the wire */
	span_t room;   /* for service frames in each cycle */
};

static inline void one_cycle(void *ctx, mono_t until)
{
	struct ride *ride = ctx;
	uint8_t frame[LIMIT_FRAME_BYTES];
	const struct transport *tp = line_transport(ride->line);
	const uint8_t *out;
	size_t len;
	int r;

	ride->cycles++;
	line_ride_advance(ride->line, (span_t){ NS_PER_MS });
	ride->wire->now_ns += 1000000;
	if (ride->wire->now_ns > until.ns) {
		ride->wire->now_ns = until.ns;
	}
	out = line_ride_take(ride->line, ride->room, &len);
	if (out != NULL) {
		ride->taken++;
		tp->send(tp->ctx, out, len);
	}
	if (ride->deaf > 0) {
		ride->deaf--;
		return;
	}
	r = tp->receive(tp->ctx, frame, sizeof(frame), (mono_t){ ride->wire->now_ns + 100000 },
			NULL);
	if (r > 0) {
		line_ride_answer(ride->line, frame, (size_t)r);
	}
}

/* Service frames of @data_bytes, told apart by their station address. */
static inline size_t make_service_frame(uint8_t *frame, uint8_t idx, uint16_t station,
					uint16_t data_bytes)
{
	static const uint8_t source[6] = { 0x10, 0x10, 0x10, 0x10, 0x10, 0x10 };
	struct ecat_frame_builder fb;

	ecat_frame_begin(&fb, frame, source);
	ecat_frame_add(&fb, ECAT_CMD_FPRD, idx, station, 0x1000, data_bytes);
	return ecat_frame_end(&fb);
}

static inline int submit(struct line *line, enum line_slot slot, uint16_t station,
			 uint16_t data_bytes)
{
	uint8_t frame[LIMIT_FRAME_BYTES];
	size_t len = make_service_frame(frame, 0xc5, station, data_bytes);

	return line_submit(line, slot, frame, len);
}

/* The station address that the answer in @slot carries, or collect's error. */
static inline int collect(struct line *line, enum line_slot slot)
{
	uint8_t answer[LIMIT_FRAME_BYTES];
	int r = line_collect(line, slot, answer, sizeof(answer));

	if (r < 0) {
		return r;
	}
	CHECK_EQ(answer[17], 0xc5);
	return get_le16(answer + 18);
}

static inline void begin_ride(struct ride *ride, struct fake_wire *wire)
{
	*ride = (struct ride){ .wire = wire, .line = line_on(wire), .room = ROOM };
	line_ride_begin(ride->line, (struct line_waiter){ one_cycle, ride });
}

static const mono_t FOREVER = { INT64_MAX };

#endif
