/* SPDX-License-Identifier: MIT */
/*
 * A wire for unit tests: virtual time, a queue of frames on their way back, and a list of what was
 * sent. The test's answer function plays the slaves; without it a frame comes back marked, its
 * WKCs 1.
 */
#ifndef TESTS_UNIT_LINK_FAKE_WIRE_H
#define TESTS_UNIT_LINK_FAKE_WIRE_H

#include <errno.h>
#include <stdint.h>
#include <string.h>

#include "base/bytes.h"
#include "base/limits.h"
#include "base/platform.h"
#include "wire/datagram.h"

enum { FAKE_QUEUE = 32, FAKE_TRAVEL_NS = 20000 };

struct fake_frame {
	int64_t at_ns;
	size_t len;
	uint8_t bytes[LIMIT_FRAME_BYTES];
};

struct fake_wire {
	int64_t now_ns;
	int64_t travel_ns;
	unsigned sent;
	int drop; /* so many of the next frames are lost */
	int send_error;
	int64_t flood_ns; /* > 0: a frame of somebody else comes every so often, without end */
	unsigned flooded;
	unsigned slept;
	struct fake_frame last_sent;
	struct fake_frame queue[FAKE_QUEUE];
	unsigned queued;
	/* Changes @frame as the slaves would. */
	void (*answer)(struct fake_wire *wire, uint8_t *frame, size_t len);
	void *user;
};

static inline void fake_set_wkc(uint8_t *frame, size_t len, unsigned number, uint16_t wkc)
{
	struct ecat_datagram dg;
	size_t pos = 0;

	for (unsigned i = 0; ecat_frame_next(frame, len, &pos, &dg) == 1; i++) {
		if (i == number) {
			put_le16(dg.wkc, wkc);
		}
	}
}

static inline void fake_pass_slave(uint8_t *frame, size_t len)
{
	struct ecat_datagram dg;
	size_t pos = 0;

	frame[6] |= 0x02;
	while (ecat_frame_next(frame, len, &pos, &dg) == 1) {
		put_le16(dg.wkc, 1);
	}
}

static inline void fake_queue(struct fake_wire *wire, const uint8_t *frame, size_t len,
			      int64_t at_ns)
{
	struct fake_frame *ff = &wire->queue[wire->queued];

	if (wire->queued < FAKE_QUEUE) {
		wire->queued++;
		ff->at_ns = at_ns;
		ff->len = len;
		memcpy(ff->bytes, frame, len);
	}
}

static inline int fake_send(void *ctx, const uint8_t *frame, size_t len)
{
	struct fake_wire *wire = ctx;
	uint8_t back[LIMIT_FRAME_BYTES];

	wire->sent++;
	if (wire->send_error < 0) {
		return wire->send_error;
	}
	wire->last_sent.len = len;
	memcpy(wire->last_sent.bytes, frame, len);
	if (wire->drop > 0) {
		wire->drop--;
		return 0;
	}
	memcpy(back, frame, len);
	if (wire->answer != NULL) {
		wire->answer(wire, back, len);
	} else {
		fake_pass_slave(back, len);
	}
	fake_queue(wire, back, len, wire->now_ns + wire->travel_ns);
	return 0;
}

/* A flood that is faster than its reader: one more waits whenever it looks, deadline or not. */
static inline int fake_flood(struct fake_wire *wire, uint8_t *frame, mono_t *ret_at)
{
	static const uint8_t source[6] = { 0x02, 0x02, 0x02, 0x02, 0x02, 0x02 };
	struct ecat_frame_builder fb;

	wire->now_ns += wire->flood_ns;
	wire->flooded++;
	if (ret_at != NULL) {
		ret_at->ns = wire->now_ns;
	}
	ecat_frame_begin(&fb, frame, source);
	ecat_frame_add(&fb, ECAT_CMD_BRD, 0xee, 0, 0x0500, 2);
	return (int)ecat_frame_end(&fb);
}

static inline int fake_receive(void *ctx, uint8_t *frame, size_t capacity, mono_t deadline,
			       mono_t *ret_at)
{
	struct fake_wire *wire = ctx;
	struct fake_frame *ff = &wire->queue[0];
	int len;

	if (wire->flood_ns > 0 && (wire->queued == 0 || ff->at_ns > wire->now_ns)) {
		return fake_flood(wire, frame, ret_at);
	}
	if (wire->queued == 0 || (ff->at_ns > deadline.ns && ff->at_ns > wire->now_ns)) {
		wire->now_ns = deadline.ns > wire->now_ns ? deadline.ns : wire->now_ns;
		return -EAGAIN;
	}
	wire->now_ns = ff->at_ns > wire->now_ns ? ff->at_ns : wire->now_ns;
	len = (int)(ff->len < capacity ? ff->len : capacity);
	memcpy(frame, ff->bytes, (size_t)len);
	if (ret_at != NULL) {
		ret_at->ns = wire->now_ns;
	}
	wire->queued--;
	memmove(wire->queue, wire->queue + 1, wire->queued * sizeof(wire->queue[0]));
	return len;
}

static inline mono_t fake_now(void *ctx)
{
	return (mono_t){ ((struct fake_wire *)ctx)->now_ns };
}

static inline int64_t fake_tai(void *ctx)
{
	return ((struct fake_wire *)ctx)->now_ns + DC_EPOCH_UNIX_S * NS_PER_S;
}

static inline int fake_sleep(void *ctx, mono_t until)
{
	struct fake_wire *wire = ctx;

	wire->slept++;
	wire->now_ns = until.ns > wire->now_ns ? until.ns : wire->now_ns;
	return 0;
}

static inline struct platform fake_platform(struct fake_wire *wire)
{
	return (struct platform){
		.now = fake_now, .tai_ns = fake_tai, .sleep_until = fake_sleep, .ctx = wire
	};
}

static inline struct transport fake_transport(struct fake_wire *wire)
{
	wire->travel_ns = FAKE_TRAVEL_NS;
	return (struct transport){ .send = fake_send, .receive = fake_receive, .ctx = wire };
}

#endif
