/* SPDX-License-Identifier: MIT */
/*
 * Whatever comes back from the wire. The first byte chooses who meets it: the cyclic exchange or a
 * service transaction. Then records follow; each is one frame: raw bytes, or the frame sent last,
 * marked by a slave, with some of its bytes changed.
 */
#include <assert.h>
#include <errno.h>
#include <stdlib.h>
#include <string.h>

#include "bus/exchange.h"
#include "link/line.h"
#include "wire/datagram.h"

enum { RAW, CHANGED, RECORD_KINDS, MODES = 2, RUNS = 64, IMAGE_BYTES = 64, OUTPUT_BYTES = 20 };

struct wire {
	const uint8_t *data; /* the input */
	size_t left;
	int64_t now_ns;
	uint8_t sent[LIMIT_FRAME_BYTES];
	size_t sent_len;
};

static uint8_t next_byte(struct wire *w)
{
	if (w->left == 0) {
		return 0;
	}
	w->left--;
	return *w->data++;
}

static int wire_send(void *ctx, const uint8_t *frame, size_t len)
{
	struct wire *w = ctx;

	assert(len <= sizeof(w->sent));
	memcpy(w->sent, frame, len);
	w->sent_len = len;
	return 0;
}

static int raw_frame(struct wire *w, uint8_t *frame, size_t capacity)
{
	size_t len = next_byte(w) | (size_t)(next_byte(w) & 0x07) << 8;

	if (len > capacity) {
		len = capacity;
	}
	if (len > w->left) {
		len = w->left;
	}
	memcpy(frame, w->data, len);
	w->data += len;
	w->left -= len;
	return (int)len;
}

static int changed_frame(struct wire *w, uint8_t *frame)
{
	unsigned changes = next_byte(w) % 8;
	size_t len = w->sent_len;

	memcpy(frame, w->sent, len);
	frame[6] |= 0x02;
	for (unsigned i = 0; i < changes && len > 0; i++) {
		size_t at = (next_byte(w) | (size_t)next_byte(w) << 8) % len;

		frame[at] ^= next_byte(w);
	}
	return (int)len;
}

static int wire_receive(void *ctx, uint8_t *frame, size_t capacity, mono_t deadline, mono_t *ret_at)
{
	struct wire *w = ctx;
	int len = -EAGAIN;

	if (w->left > 0) {
		len = next_byte(w) % RECORD_KINDS == RAW || w->sent_len > capacity
			      ? raw_frame(w, frame, capacity)
			      : changed_frame(w, frame);
	}
	w->now_ns =
		len < 0 ? (deadline.ns > w->now_ns ? deadline.ns : w->now_ns) : w->now_ns + 10000;
	if (ret_at != NULL) {
		ret_at->ns = w->now_ns;
	}
	return len;
}

static mono_t wire_now(void *ctx)
{
	return (mono_t){ ((struct wire *)ctx)->now_ns };
}

static int64_t wire_tai(void *ctx)
{
	return ((struct wire *)ctx)->now_ns;
}

static int wire_sleep(void *ctx, mono_t until)
{
	struct wire *w = ctx;

	w->now_ns = until.ns > w->now_ns ? until.ns : w->now_ns;
	return 0;
}

/* The image is touched only by a good exchange, and its outputs never. */
static void meet_exchange(struct wire *w, struct line *line)
{
	const struct exchange_plan plan = {
		.image_bytes = IMAGE_BYTES,
		.output_bytes = OUTPUT_BYTES,
		.chunk_bytes = { 40, 24 },
		.chunk_count = 2,
		.chunk_wkc = { 3, 1 },
		.chunk_frame = { 0, 1 },
		.wkc_expected = 4,
		.dc_reference = 0x1001,
		.slave_count = 2,
		.monitor = next_byte(w) & 1,
	};
	struct exchange *ex;
	uint8_t image[IMAGE_BYTES] = { 1, 2, 3 };

	if (exchange_create(&plan, line, &ex) < 0) {
		abort();
	}
	for (int i = 0; i < RUNS && w->left > 0; i++) {
		uint8_t before[IMAGE_BYTES];
		struct exchange_result res;

		memcpy(before, image, sizeof(image));
		res = exchange_run(ex, image, (mono_t){ w->now_ns + 400000 });
		if (memcmp(before, image, res.status == EXCHANGE_OK ? OUTPUT_BYTES : IMAGE_BYTES) !=
		    0) {
			abort();
		}
		if (res.status == EXCHANGE_OK && res.wkc != plan.wkc_expected) {
			abort();
		}
		exchange_ride(ex, &(struct exchange_window){
					  .period = { NS_PER_MS },
					  .wire_needed = { w->now_ns + NS_PER_MS },
					  .listen_until = { w->now_ns + 100000 },
				  });
	}
	exchange_destroy(ex);
}

static void meet_transaction(struct wire *w, struct line *line)
{
	static const uint8_t source[6] = { 0x10, 0x10, 0x10, 0x10, 0x10, 0x10 };

	for (int i = 0; i < RUNS && w->left > 0; i++) {
		struct ecat_frame_builder fb;
		uint8_t frame[LIMIT_FRAME_BYTES];
		uint8_t answer[LIMIT_FRAME_BYTES];
		size_t len;
		int r;

		ecat_frame_begin(&fb, frame, source);
		ecat_frame_add(&fb, ECAT_CMD_FPRD, (uint8_t)i, 0x1001, 0x0130, 6);
		ecat_frame_add(&fb, ECAT_CMD_BRD, (uint8_t)i, 0, 0x0000, 2);
		len = ecat_frame_end(&fb);
		r = line_transact(line, frame, len, answer, sizeof(answer), (span_t){ 2000000 });
		if (r >= 0 && ((size_t)r > sizeof(answer) || answer[17] != (uint8_t)i)) {
			abort();
		}
	}
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
	struct wire w = { .data = data, .left = size };
	struct platform platform = {
		.now = wire_now, .tai_ns = wire_tai, .sleep_until = wire_sleep, .ctx = &w
	};
	struct transport transport = { .send = wire_send, .receive = wire_receive, .ctx = &w };
	void (*const meet[MODES])(struct wire *, struct line *) = { meet_exchange,
								    meet_transaction };
	struct line *line;

	if (line_create(platform, transport, &line) < 0) {
		return 0;
	}
	meet[next_byte(&w) % MODES](&w, line);
	line_destroy(line);
	return 0;
}
