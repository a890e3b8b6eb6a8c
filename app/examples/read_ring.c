/* SPDX-License-Identifier: MIT */
/*
 * A program of your own that reads every sample: read_ring RING CHANNEL... prints cycle number, DC
 * time and the channels' values: what the ring still holds (64 s by default), then what comes,
 * until the ring is closed. Build it against the installed library:
 *
 *	cc read_ring.c -o read_ring $(pkg-config --cflags --libs ecdaq)
 *
 * It only reads: nothing it does, a crash included, disturbs the cycle.
 */
#include <errno.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "base/ring.h"
#include "base/sample.h"
#include "image/image.h"

static void print_sample(const void *payload, const struct channel *const *wanted, int count)
{
	struct sample_header header;
	const uint8_t *image = (const uint8_t *)payload + sizeof(header);

	memcpy(&header, payload, sizeof(header));
	printf("%" PRIu64 " %" PRId64, header.cycle, header.dc_time_ns);
	for (int i = 0; i < count; i++) {
		printf(" %.9g", image_get_physical(image, wanted[i]));
	}
	/* A stale or bad sample is there, too, and says so. */
	printf("%s\n", header.flags == 0 && header.slaves_bad == 0 ? "" : " bad");
}

static int read_until_closed(struct ring_reader *reader, const struct channel *const *wanted,
			     int count)
{
	const struct timespec pause = { .tv_nsec = 10000000 };
	void *payload = malloc(ring_payload_bytes(reader));

	if (payload == NULL) {
		return -ENOMEM;
	}
	for (;;) {
		uint64_t lost = 0;

		switch (ring_read(reader, payload, ring_payload_bytes(reader), &lost)) {
		case RING_OK:
			print_sample(payload, wanted, count);
			break;
		case RING_LOST:
			fprintf(stderr, "too slow: %" PRIu64 " samples missed\n", lost);
			break;
		case RING_EMPTY:
			if (ring_is_orphaned(reader)) {
				free(payload);
				return -EPIPE;
			}
			nanosleep(&pause, NULL);
			break;
		case RING_DAMAGED:
			free(payload);
			return -EIO;
		case RING_CLOSED:
			free(payload);
			return 0;
		}
	}
}

/* The ring describes itself: the channel table stands in its meta area. */
static int find_channels(const struct ring_reader *reader, char *const *names, int count,
			 const struct channel **ret_wanted)
{
	size_t meta_bytes;
	const struct sample_meta *meta = ring_meta(reader, &meta_bytes);
	const struct channel *channels;

	if (meta_bytes < sizeof(*meta) || meta->version != SAMPLE_VERSION) {
		fprintf(stderr, "read_ring: not a sample ring of version %u\n", SAMPLE_VERSION);
		return -EPROTO;
	}
	channels = sample_meta_channels(meta);
	for (int i = 0; i < count; i++) {
		int index = image_channel_find(channels, meta->channel_count, names[i]);

		if (index < 0 || !image_channel_fits(&channels[index], meta->image_bytes)) {
			fprintf(stderr, "read_ring: %s: no such channel\n", names[i]);
			return -ENOENT;
		}
		ret_wanted[i] = &channels[index];
	}
	return 0;
}

int main(int argc, char **argv)
{
	const struct channel *wanted[64];
	struct ring_reader *reader;
	int r;

	if (argc < 2 || argc - 2 > 64) {
		fprintf(stderr, "usage: read_ring RING [CHANNEL...] (64 at most)\n");
		return 2;
	}
	r = ring_reader_open(argv[1], &reader);
	if (r < 0) {
		fprintf(stderr, "read_ring: %s: %s\n", argv[1], strerror(-r));
		return 1;
	}
	ring_seek(reader, ring_oldest(reader));
	r = find_channels(reader, argv + 2, argc - 2, wanted);
	if (r == 0) {
		r = read_until_closed(reader, wanted, argc - 2);
	}
	ring_reader_destroy(reader);
	return r == 0 ? 0 : 1;
}
