/* SPDX-License-Identifier: MIT */
#include "record/feed.h"

#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include "base/event.h"
#include "base/ring.h"
#include "base/sync0.h"

/* What a ring of each kind calls itself and holds. */
static const struct {
	const char *name;
	size_t bytes;
	size_t mono_at; /* where a record has its time */
} kinds[] = {
	[FEED_EVENTS] = { "event", sizeof(struct event), offsetof(struct event, mono_ns) },
	[FEED_SYNC0] = { "sync0", sizeof(struct sync0_result),
			 offsetof(struct sync0_result, mono_ns) },
};

struct feed {
	enum feed_kind kind;
	const char *path;         /* NULL: none */
	struct ring_reader *ring; /* NULL: none open */
};

struct feed *feed_create(enum feed_kind kind, const char *path)
{
	struct feed *f = calloc(1, sizeof(*f));

	if (f != NULL) {
		f->kind = kind;
		f->path = path;
	}
	return f;
}

void feed_destroy(struct feed *f)
{
	if (f == NULL) {
		return;
	}
	ring_reader_destroy(f->ring);
	free(f);
}

void feed_open(struct feed *f, const struct feed_mark *mark)
{
	if (f->path == NULL) {
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
	if (strcmp(ring_kind(f->ring), kinds[f->kind].name) != 0 ||
	    ring_payload_bytes(f->ring) != kinds[f->kind].bytes) {
		ring_reader_destroy(f->ring);
		f->ring = NULL;
		return;
	}
	feed_seek(f, mark);
}

/* The record before the mark tells whether this is the ring that the mark was made in. */
void feed_seek(struct feed *f, const struct feed_mark *mark)
{
	union {
		struct event event;
		struct sync0_result sync0;
	} before;
	int64_t mono_ns;
	uint64_t lost;

	if (f->ring == NULL) {
		return;
	}
	if (mark->next > 0 && mark->next <= ring_newest(f->ring)) {
		ring_seek(f->ring, mark->next - 1);
		if (ring_read(f->ring, &before, sizeof(before), &lost) == RING_OK) {
			memcpy(&mono_ns, (const char *)&before + kinds[f->kind].mono_at,
			       sizeof(mono_ns));
			if (mono_ns == mark->mono_ns) {
				return;
			}
		}
	}
	ring_seek(f->ring, ring_oldest(f->ring));
}

int feed_read(struct feed *f, void *ret_record, uint64_t *ret_sequence, uint64_t *ret_lost)
{
	*ret_lost = 0;
	if (f->ring == NULL) {
		return 0;
	}
	for (;;) {
		uint64_t lost = 0;

		switch (ring_read(f->ring, ret_record, kinds[f->kind].bytes, &lost)) {
		case RING_OK:
			*ret_sequence = ring_cursor(f->ring) - 1;
			return 1;
		case RING_LOST:
			*ret_lost += lost;
			break;
		case RING_EMPTY:
		case RING_CLOSED:
		case RING_DAMAGED:
			return 0;
		}
	}
}

void feed_unread(struct feed *f)
{
	if (f->ring != NULL && ring_cursor(f->ring) > 0) {
		ring_seek(f->ring, ring_cursor(f->ring) - 1);
	}
}
