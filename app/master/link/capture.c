/* SPDX-License-Identifier: MIT */
#include "link/capture.h"

#include <errno.h>
#include <stdatomic.h>
#include <stdlib.h>

#include "base/frame_record.h"
#include "base/ring.h"

struct capture {
	struct platform platform;
	struct transport inner;    /* [service] while nobody uses the transport */
	struct ring *_Atomic ring; /* [service] sets, [owner of the transport] writes to it */
};

int capture_create(struct platform platform, struct capture **ret_capture)
{
	struct capture *capture = calloc(1, sizeof(*capture));

	if (capture == NULL) {
		return -ENOMEM;
	}
	capture->platform = platform;
	*ret_capture = capture;
	return 0;
}

void capture_destroy(struct capture *capture)
{
	free(capture);
}

void capture_set_ring(struct capture *capture, struct ring *ring)
{
	atomic_store_explicit(&capture->ring, ring, memory_order_release);
}

/* Context: owner of the transport. */
static void record(struct ring *ring, mono_t at, enum frame_direction direction, int error,
		   const uint8_t *frame, size_t frame_len)
{
	const struct frame_record head = {
		.mono_ns = at.ns,
		.error = error,
		.frame_bytes =
			(uint16_t)(frame_len < LIMIT_FRAME_BYTES ? frame_len : LIMIT_FRAME_BYTES),
		.direction = (uint8_t)direction,
	};

	ring_push(ring, &head, sizeof(head), frame, head.frame_bytes);
}

static int send_and_record(void *ctx, const uint8_t *frame, size_t frame_len)
{
	struct capture *capture = ctx;
	struct ring *ring = atomic_load_explicit(&capture->ring, memory_order_acquire);
	mono_t at = { 0 };
	int r;

	if (ring == NULL) {
		return capture->inner.send(capture->inner.ctx, frame, frame_len);
	}
	at = capture->platform.now(capture->platform.ctx);
	r = capture->inner.send(capture->inner.ctx, frame, frame_len);
	record(ring, at, FRAME_OUT, r < 0 ? r : 0, frame, frame_len);
	return r;
}

static int receive_and_record(void *ctx, uint8_t *frame, size_t capacity, mono_t deadline,
			      mono_t *ret_at)
{
	struct capture *capture = ctx;
	mono_t at = { 0 };
	int len = capture->inner.receive(capture->inner.ctx, frame, capacity, deadline, &at);
	struct ring *ring = atomic_load_explicit(&capture->ring, memory_order_acquire);

	if (len >= 0 && ret_at != NULL) {
		*ret_at = at;
	}
	if (len >= 0 && ring != NULL) {
		record(ring, at, FRAME_IN, 0, frame, (size_t)len);
	}
	return len;
}

static int is_up(void *ctx)
{
	struct capture *capture = ctx;

	return capture->inner.is_up(capture->inner.ctx);
}

static void destroy(void *ctx)
{
	struct capture *capture = ctx;

	if (capture->inner.destroy != NULL) {
		capture->inner.destroy(capture->inner.ctx);
	}
	capture->inner = (struct transport){ .send = NULL };
}

struct transport capture_wrap(struct capture *capture, struct transport inner)
{
	capture->inner = inner;
	return (struct transport){
		.send = send_and_record,
		.receive = receive_and_record,
		.is_up = inner.is_up != NULL ? is_up : NULL,
		.destroy = destroy,
		.ctx = capture,
	};
}
