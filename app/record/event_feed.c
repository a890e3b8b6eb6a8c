/* SPDX-License-Identifier: MIT */
#include "record/event_feed.h"

#include <stdlib.h>
#include <string.h>

#include "base/ring.h"

struct event_feed {
	const char *path;
	struct ring_reader *ring; /* NULL: none open */
};

struct event_feed *event_feed_create(const char *path)
{
	struct event_feed *f = calloc(1, sizeof(*f));

	if (f != NULL) {
		f->path = path;
	}
	return f;
}

void event_feed_destroy(struct event_feed *f)
{
	if (f == NULL) {
		return;
	}
	ring_reader_destroy(f->ring);
	free(f);
}

void event_feed_open(struct event_feed *f, const struct event_mark *mark)
{
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
	if (strcmp(ring_kind(f->ring), "event") != 0 ||
	    ring_payload_bytes(f->ring) != sizeof(struct event)) {
		ring_reader_destroy(f->ring);
		f->ring = NULL;
		return;
	}
	event_feed_seek(f, mark);
}

/* The event before the mark tells whether this is the ring that the mark was made in. */
void event_feed_seek(struct event_feed *f, const struct event_mark *mark)
{
	struct event before;
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

int event_feed_read(struct event_feed *f, struct event *ret_event, uint64_t *ret_sequence,
		    uint64_t *ret_lost)
{
	*ret_lost = 0;
	if (f->ring == NULL) {
		return 0;
	}
	for (;;) {
		uint64_t lost = 0;

		switch (ring_read(f->ring, ret_event, &lost)) {
		case RING_OK:
			*ret_sequence = ring_cursor(f->ring) - 1;
			return 1;
		case RING_LOST:
			*ret_lost += lost;
			break;
		case RING_EMPTY:
		case RING_CLOSED:
			return 0;
		}
	}
}

void event_feed_unread(struct event_feed *f)
{
	if (f->ring != NULL && ring_cursor(f->ring) > 0) {
		ring_seek(f->ring, ring_cursor(f->ring) - 1);
	}
}
