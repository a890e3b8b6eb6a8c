/* SPDX-License-Identifier: MIT */
#include "record/sync0_feed.h"

#include <stdlib.h>
#include <string.h>

#include "base/ring.h"

struct sync0_feed {
	const char *path;
	struct ring_reader *ring; /* NULL: none open */
};

struct sync0_feed *sync0_feed_create(const char *path)
{
	struct sync0_feed *f = calloc(1, sizeof(*f));

	if (f != NULL) {
		f->path = path;
	}
	return f;
}

void sync0_feed_destroy(struct sync0_feed *f)
{
	if (f != NULL) {
		ring_reader_destroy(f->ring);
		free(f);
	}
}

void sync0_feed_open(struct sync0_feed *f, const struct event_mark *mark)
{
	if (f->path[0] == '\0') {
		return;
	}
	if (f->ring != NULL) {
		if (!ring_is_replaced(f->ring) || ring_cursor(f->ring) < ring_newest(f->ring)) {
			return;
		}
		ring_reader_destroy(f->ring);
		f->ring = NULL;
	}
	if (ring_reader_open(f->path, &f->ring) < 0) {
		f->ring = NULL;
		return;
	}
	if (strcmp(ring_kind(f->ring), "sync0") != 0 ||
	    ring_payload_bytes(f->ring) != sizeof(struct sync0_result)) {
		ring_reader_destroy(f->ring);
		f->ring = NULL;
		return;
	}
	sync0_feed_seek(f, mark);
}

void sync0_feed_seek(struct sync0_feed *f, const struct event_mark *mark)
{
	struct sync0_result before;
	uint64_t lost;

	if (f->ring == NULL) {
		return;
	}
	if (mark->next > 0 && mark->next <= ring_newest(f->ring)) {
		ring_seek(f->ring, mark->next - 1);
		if (ring_read(f->ring, &before, &lost) == RING_OK &&
		    before.mono_ns == mark->mono_ns) {
			return;
		}
	}
	ring_seek(f->ring, ring_oldest(f->ring));
}

int sync0_feed_read(struct sync0_feed *f, struct sync0_result *ret, uint64_t *ret_sequence)
{
	enum ring_result got = RING_EMPTY;
	uint64_t lost;

	if (f->ring == NULL) {
		return 0;
	}
	do {
		got = ring_read(f->ring, ret, &lost);
	} while (got == RING_LOST);
	*ret_sequence = ring_cursor(f->ring) - 1;
	return got == RING_OK;
}

void sync0_feed_unread(struct sync0_feed *f)
{
	if (f->ring != NULL && ring_cursor(f->ring) > 0) {
		ring_seek(f->ring, ring_cursor(f->ring) - 1);
	}
}
