/* SPDX-License-Identifier: MIT */
#include "capture_transport.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "harness/pcapng.h"

struct capture {
	struct platform platform;
	struct transport inner;
	char *path;
	size_t used;
	size_t limit;
	uint8_t bytes[];
};

static void note(struct capture *cap, const uint8_t *frame, size_t frame_len)
{
	size_t need = pcapng_packet_bytes(frame_len);

	if (need <= cap->limit - cap->used) {
		cap->used += pcapng_write_packet(cap->bytes + cap->used,
						 cap->platform.tai_ns(cap->platform.ctx), frame,
						 frame_len);
	} else {
		cap->limit = cap->used; /* a hole would be worse than an end */
	}
}

static int capture_send(void *ctx, const uint8_t *frame, size_t frame_len)
{
	struct capture *cap = ctx;

	note(cap, frame, frame_len);
	return cap->inner.send(cap->inner.ctx, frame, frame_len);
}

static int capture_receive(void *ctx, uint8_t *frame, size_t capacity, mono_t deadline,
			   mono_t *ret_at)
{
	struct capture *cap = ctx;
	int r = cap->inner.receive(cap->inner.ctx, frame, capacity, deadline, ret_at);

	if (r > 0) {
		note(cap, frame, (size_t)r);
	}
	return r;
}

static int capture_is_up(void *ctx)
{
	const struct capture *cap = ctx;

	return cap->inner.is_up != NULL ? cap->inner.is_up(cap->inner.ctx) : 1;
}

/* destroy() returns nothing: a file that cannot be written is removed. */
static void write_out(const struct capture *cap)
{
	FILE *file = fopen(cap->path, "wb");

	if (file == NULL) {
		return;
	}
	if (fwrite(cap->bytes, 1, cap->used, file) != cap->used) {
		remove(cap->path);
	}
	fclose(file);
}

static void capture_destroy(void *ctx)
{
	struct capture *cap = ctx;

	write_out(cap);
	if (cap->inner.destroy != NULL) {
		cap->inner.destroy(cap->inner.ctx);
	}
	free(cap->path);
	free(cap);
}

int capture_create(const char *path, size_t limit_bytes, struct platform platform,
		   struct transport inner, struct transport *ret_transport)
{
	struct capture *cap;

	if (limit_bytes < PCAPNG_HEAD_BYTES) {
		return -EINVAL;
	}
	cap = calloc(1, sizeof(*cap) + limit_bytes);
	if (cap == NULL) {
		return -ENOMEM;
	}
	cap->path = strdup(path);
	if (cap->path == NULL) {
		free(cap);
		return -ENOMEM;
	}
	cap->platform = platform;
	cap->inner = inner;
	cap->limit = limit_bytes;
	cap->used = pcapng_write_head(cap->bytes);
	*ret_transport = (struct transport){
		.send = capture_send,
		.receive = capture_receive,
		.is_up = capture_is_up,
		.destroy = capture_destroy,
		.ctx = cap,
	};
	return 0;
}
