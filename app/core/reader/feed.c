/* SPDX-License-Identifier: MIT */
#include "reader/feed.h"

#include <assert.h>
#include <errno.h>
#include <stdlib.h>
#include <string.h>

#include "base/frame_record.h"
#include "base/ring.h"

/* Of a writer that overruns the reader each time, some records are read on the next call. */
enum { READ_TRIES = 4 };

/* What a ring of each kind calls itself and holds. */
static const struct {
	const char *name;
	size_t bytes;
	size_t mono_at; /* where a record has its time */
} kinds[] = {
	[FEED_EVENTS] = { "event", sizeof(struct event), offsetof(struct event, mono_ns) },
	[FEED_SYNC0] = { "sync0", sizeof(struct sync0_result),
			 offsetof(struct sync0_result, mono_ns) },
	[FEED_FRAMES] = { FRAME_RING_KIND, FRAME_SLOT_BYTES,
			  offsetof(struct frame_record, mono_ns) },
};

struct feed {
	enum feed_kind kind;
	char *path;               /* NULL: none */
	struct ring_reader *ring; /* NULL: none open */
	int is_closed;
	int is_damaged;
	int starts_at_newest;
};

struct feed *feed_create(enum feed_kind kind, const char *path, enum feed_start start)
{
	struct feed *f = calloc(1, sizeof(*f));

	if (f == NULL) {
		return NULL;
	}
	f->kind = kind;
	f->starts_at_newest = start == FEED_AT_NEWEST;
	f->path = path == NULL ? NULL : strdup(path);
	if (path != NULL && f->path == NULL) {
		free(f);
		return NULL;
	}
	return f;
}

void feed_destroy(struct feed *f)
{
	if (f == NULL) {
		return;
	}
	ring_reader_destroy(f->ring);
	free(f->path);
	free(f);
}

static int open_ring(struct feed *f)
{
	int r = ring_reader_open(f->path, &f->ring);

	if (r < 0) {
		return r;
	}
	if (strcmp(ring_kind(f->ring), kinds[f->kind].name) != 0 ||
	    ring_payload_bytes(f->ring) != kinds[f->kind].bytes) {
		ring_reader_destroy(f->ring);
		f->ring = NULL;
		return -EPROTO;
	}
	f->is_closed = 0;
	f->is_damaged = 0;
	return 0;
}

int feed_open(struct feed *f, const struct feed_mark *mark)
{
	int r;

	if (f->path == NULL) {
		return -ENOENT;
	}
	if (f->ring != NULL) {
		if (!ring_is_replaced(f->ring) ||
		    (!f->is_damaged && ring_cursor(f->ring) < ring_newest(f->ring))) {
			return f->is_damaged ? -EIO : 0;
		}
		ring_reader_destroy(f->ring);
		f->ring = NULL;
	}
	r = open_ring(f);
	if (r < 0) {
		return r;
	}
	if (mark != NULL) {
		feed_seek(f, mark);
	} else if (!f->starts_at_newest) {
		feed_seek_back(f, 0);
	}
	f->starts_at_newest = 0;
	return 0;
}

/* The record before the mark shows whether this is the ring that the mark was made in. */
void feed_seek(struct feed *f, const struct feed_mark *mark)
{
	union {
		struct event event;
		struct sync0_result sync0;
		uint8_t frame[FRAME_SLOT_BYTES];
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
	feed_seek_back(f, 0);
}

void feed_seek_back(struct feed *f, uint64_t count)
{
	if (f->ring != NULL) {
		uint64_t newest = ring_newest(f->ring);
		uint64_t oldest = ring_oldest(f->ring);

		ring_seek(f->ring, count > 0 && newest - oldest > count ? newest - count : oldest);
	}
}

int feed_read(struct feed *f, void *ret_record, size_t bytes, uint64_t *ret_sequence,
	      uint64_t *ret_lost)
{
	assert(bytes == kinds[f->kind].bytes);
	for (int tries = 0; f->ring != NULL && tries < READ_TRIES; tries++) {
		uint64_t lost = 0;

		switch (ring_read(f->ring, ret_record, bytes, &lost)) {
		case RING_OK:
			if (ret_sequence != NULL) {
				*ret_sequence = ring_cursor(f->ring) - 1;
			}
			return 1;
		case RING_LOST:
			*ret_lost += lost;
			break;
		case RING_DAMAGED:
			f->is_damaged = 1;
			return 0;
		case RING_CLOSED:
			f->is_closed = 1;
			return 0;
		case RING_EMPTY:
			return 0;
		}
	}
	return 0;
}

void feed_unread(struct feed *f)
{
	if (f->ring != NULL && ring_cursor(f->ring) > 0) {
		ring_seek(f->ring, ring_cursor(f->ring) - 1);
	}
}

int feed_is_over(struct feed *f)
{
	return f->ring == NULL || f->is_closed || f->is_damaged || ring_is_orphaned(f->ring);
}
