/* SPDX-License-Identifier: MIT */
/*
 * A sample ring whose file somebody else writes while it is read. The input is a list of steps on a
 * ring that is right at first: 'w' place (3 bytes) count data: overwrite; 't' length (3 bytes):
 * truncate or extend; 'r' count: read samples; 's' place (2 bytes): seek; 'n': read the newest;
 * 'o': close the reader and open the ring again.
 */
#include <assert.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/ring.h"
#include "image/image.h"
#include "reader/reader.h"
#include "reader/utc.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

enum { SLAVES = 2, CHANNELS = 2, IMAGE_BYTES = 8, SLOTS = 16, PUSHED = 20, STEPS = 64 };

static char path[64];

struct input {
	const uint8_t *data;
	size_t left;
};

static uint32_t take(struct input *in, unsigned bytes)
{
	uint32_t n = 0;

	for (; bytes > 0 && in->left > 0; bytes--, in->left--) {
		n = n << 8 | *in->data++;
	}
	return n;
}

static void make_ring(void)
{
	struct {
		struct sample_meta head;
		struct slave_info slave[SLAVES];
		struct channel channel[CHANNELS];
	} meta = {
		.head = { .version = SAMPLE_VERSION,
			  .slave_count = SLAVES,
			  .channel_count = CHANNELS,
			  .image_bytes = IMAGE_BYTES,
			  .period_ns = 1000000 },
		.slave = { { .name = "a" }, { .name = "b", .slave_pos = 1 } },
		.channel = { { .name = "a.adc", .type = CHANNEL_UINT, .bit_len = 16, .scale = 1 },
			     { .name = "b.adc",
			       .slave_pos = 1,
			       .type = CHANNEL_INT,
			       .bit_len = 40,
			       .bit_offset = 19,
			       .scale = 1 } },
	};
	const struct ring_spec spec = { .path = path,
					.kind = "sample",
					.payload_bytes = sample_head_bytes(SLAVES) + IMAGE_BYTES,
					.slot_count = SLOTS,
					.meta = &meta,
					.meta_bytes = sizeof(meta),
					.file_mode = 0600 };
	struct ring *ring;

	assert(ring_create(&spec, &ring) == 0);
	for (uint64_t i = 0; i < PUSHED; i++) {
		struct sample_header h = { .cycle = i, .dc_time_ns = (int64_t)i * 1000000 + 1 };

		ring_push(ring, &h, sample_head_bytes(SLAVES), "12345678", IMAGE_BYTES);
	}
	ring_destroy(ring);
}

/* What every reader does with a sample. */
static void use(struct reader *reader, struct utc *utc)
{
	const struct channel_table *t = reader_table(reader);
	int64_t utc_ns;

	assert(t->meta.slave_count <= LIMIT_SLAVES && t->meta.channel_count <= LIMIT_CHANNELS);
	for (uint32_t i = 0; i < t->meta.channel_count; i++) {
		assert(strlen(t->channels[i].name) < sizeof(t->channels[i].name));
		image_get_physical(reader_image(reader), &t->channels[i]);
		sample_is_good(reader_header(reader), t->channels[i].slave_pos);
	}
	for (uint32_t i = 0; i < t->meta.slave_count; i++) {
		assert(strlen(t->slaves[i].device) < sizeof(t->slaves[i].device));
	}
	if (utc != NULL) {
		utc_feed(utc, reader_header(reader), &utc_ns);
	}
}

static void read_some(struct reader *reader, struct utc **utc, unsigned count)
{
	for (unsigned i = 0; i < count; i++) {
		uint64_t lost;
		enum reader_result result = reader_next(reader, &lost);

		if (result == READER_BEGUN) {
			utc_destroy(*utc);
			*utc = utc_create(&reader_table(reader)->meta);
		} else if (result == READER_SAMPLE) {
			use(reader, *utc);
		} else if (result != READER_LOST) {
			return;
		}
	}
}

static void overwrite(struct input *in)
{
	uint32_t place = take(in, 3);
	size_t count = take(in, 1);
	int fd = open(path, O_WRONLY | O_CLOEXEC);

	count = count < in->left ? count : in->left;
	assert(fd >= 0);
	assert(pwrite(fd, in->data, count, place % (1 << 15)) >= 0);
	close(fd);
	in->data += count;
	in->left -= count;
}

static void step(struct input *in, struct reader **reader, struct utc **utc)
{
	switch (take(in, 1)) {
	case 'w':
		overwrite(in);
		break;
	case 't':
		assert(truncate(path, take(in, 3) % (1 << 15)) == 0);
		break;
	case 'r':
		read_some(*reader, utc, take(in, 1));
		break;
	case 's':
		reader_seek(*reader, take(in, 2));
		break;
	case 'n':
		if (reader_table(*reader) != NULL && reader_read_newest(*reader)) {
			use(*reader, *utc);
		}
		break;
	default:
		reader_destroy(*reader);
		assert(reader_create(path, READER_AT_OLDEST, reader) == 0);
		break;
	}
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
	struct input in = { data, size };
	struct reader *reader;
	struct utc *utc = NULL;

	snprintf(path, sizeof(path), "/dev/shm/ecdaq-fuzz-ring-%d", (int)getpid());
	make_ring();
	assert(reader_create(path, READER_AT_OLDEST, &reader) == 0);
	for (int i = 0; i < STEPS && in.left > 0; i++) {
		step(&in, &reader, &utc);
	}
	read_some(reader, &utc, 255);
	utc_destroy(utc);
	reader_destroy(reader);
	unlink(path);
	return 0;
}
