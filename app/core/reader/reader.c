/* SPDX-License-Identifier: MIT */
#include "reader/reader.h"

#include <assert.h>
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/ring.h"
#include "base/slave_set.h"

enum { PAYLOAD_BYTES_MAX = sizeof(struct sample_header) + LIMIT_IMAGE_BYTES };

struct reader {
	char *path;
	struct ring_reader *ring; /* NULL: none open */
	struct channel_table *table;
	int is_done;  /* the open ring is not read any more: wait for another one */
	int has_news; /* samples were read since it was empty last: its producer lives */
	int starts_at_newest;
	int error;             /* as reader_error() has it */
	char version_text[96]; /* reader_problem() of -EPROTONOSUPPORT */
	struct sample_header header;
	uint8_t *payload;    /* the sample read last, as it was in the ring */
	uint32_t head_bytes; /* of it: where its image begins */
};

int reader_create(const char *path, enum reader_start start, struct reader **ret_reader)
{
	struct reader *r = calloc(1, sizeof(*r));

	if (r == NULL) {
		return -ENOMEM;
	}
	r->path = strdup(path);
	r->payload = calloc(1, PAYLOAD_BYTES_MAX);
	r->starts_at_newest = start == READER_AT_NEWEST;
	if (r->path == NULL || r->payload == NULL) {
		reader_destroy(r);
		return -ENOMEM;
	}
	*ret_reader = r;
	return 0;
}

void reader_destroy(struct reader *r)
{
	if (r == NULL) {
		return;
	}
	ring_reader_destroy(r->ring);
	channel_table_destroy(r->table);
	free(r->payload);
	free(r->path);
	free(r);
}

static int make_table(const struct ring_reader *ring, struct channel_table **ret)
{
	size_t bytes;
	const void *meta = ring_meta(ring, &bytes);
	int r;

	if (strcmp(ring_kind(ring), "sample") != 0) {
		return -EPROTO;
	}
	r = channel_table_create(meta, bytes, ret);
	if (r == 0 && ring_payload_bytes(ring) < sample_head_bytes((*ret)->meta.slave_count) +
							 (*ret)->meta.image_bytes) {
		channel_table_destroy(*ret);
		r = -EPROTO;
	}
	return r;
}

/* The meta area begins with its version; a ring of another RING_VERSION has none that is known. */
static void note_version(struct reader *r)
{
	size_t bytes = 0;
	const void *meta = r->ring == NULL ? NULL : ring_meta(r->ring, &bytes);
	uint32_t version;

	if (bytes < sizeof(version)) {
		snprintf(r->version_text, sizeof(r->version_text),
			 "ring of another version: restart ecdaqd of the same release");
		return;
	}
	memcpy(&version, meta, sizeof(version));
	snprintf(r->version_text, sizeof(r->version_text),
		 "ring version %u, this program reads version %u: restart ecdaqd of the same "
		 "release",
		 version, SAMPLE_VERSION);
}

static enum reader_result refuse(struct reader *r)
{
	if (r->error == -EPROTONOSUPPORT) {
		note_version(r);
	}
	ring_reader_destroy(r->ring);
	r->ring = NULL;
	return READER_WAITING;
}

static enum reader_result begin(struct reader *r)
{
	struct channel_table *table = NULL;

	ring_reader_destroy(r->ring);
	r->ring = NULL;
	r->is_done = 0;
	r->has_news = 0;
	r->error = ring_reader_open(r->path, &r->ring);
	if (r->error < 0) {
		return refuse(r);
	}
	r->error = make_table(r->ring, &table);
	if (r->error < 0) {
		return refuse(r);
	}
	channel_table_destroy(r->table);
	r->table = table;
	r->head_bytes = sample_head_bytes(table->meta.slave_count);
	if (!r->starts_at_newest) {
		ring_seek(r->ring, ring_oldest(r->ring));
	}
	r->starts_at_newest = 0;
	return READER_BEGUN;
}

static enum reader_result end(struct reader *r, int error)
{
	r->is_done = 1;
	r->error = error;
	return READER_ENDED;
}

/* The words that are not in the ring are of slaves that are not on the bus. */
static void take_header(struct reader *r)
{
	r->header.slaves_bad = slave_set_empty();
	memcpy(&r->header, r->payload, r->head_bytes);
}

enum reader_result reader_next(struct reader *r, uint64_t *ret_lost)
{
	if (r->ring == NULL || (r->is_done && ring_is_replaced(r->ring))) {
		return begin(r);
	}
	if (r->is_done) {
		return READER_WAITING;
	}
	for (int is_last = 0;; is_last = 1) {
		switch (ring_read(r->ring, r->payload, PAYLOAD_BYTES_MAX, ret_lost)) {
		case RING_OK:
			take_header(r);
			r->has_news = 1;
			return READER_SAMPLE;
		case RING_LOST:
			r->has_news = 1;
			return READER_LOST;
		case RING_CLOSED:
			return end(r, 0);
		case RING_DAMAGED:
			return end(r, -EIO);
		case RING_EMPTY:
			break;
		}
		if (is_last) {
			return end(r, -EPIPE);
		}
		if (r->has_news || (!ring_is_replaced(r->ring) && !ring_is_orphaned(r->ring))) {
			r->has_news = 0;
			return READER_EMPTY;
		}
		/* Once more: what was pushed before the producer went is read. */
	}
}

int reader_error(const struct reader *r)
{
	return r->error;
}

const char *reader_problem(const struct reader *r)
{
	return r->error == -EPROTONOSUPPORT ? r->version_text : reader_error_to_str(r->error);
}

const char *reader_error_to_str(int error)
{
	return error == -EPROTO  ? "not a sample ring, or damaged"
	       : error == -E2BIG ? "more slaves, channels or process data than this program reads"
	       : error == -EIO   ? "truncated or overwritten while it was read"
	       : error == -EPIPE ? "its ecdaqd ended without closing it"
				 : strerror(-error);
}

const struct channel_table *reader_table(const struct reader *r)
{
	return r->table;
}

const struct sample_header *reader_header(const struct reader *r)
{
	return &r->header;
}

const uint8_t *reader_image(const struct reader *r)
{
	return r->payload + r->head_bytes;
}

int reader_read_newest(struct reader *r)
{
	if (r->ring == NULL ||
	    ring_peek_newest(r->ring, r->payload, PAYLOAD_BYTES_MAX) != RING_OK) {
		return 0;
	}
	take_header(r);
	return 1;
}

uint64_t reader_cursor(const struct reader *r)
{
	return r->ring == NULL ? 0 : ring_cursor(r->ring);
}

uint64_t reader_oldest(struct reader *r)
{
	return r->ring == NULL ? 0 : ring_oldest(r->ring);
}

uint64_t reader_newest(struct reader *r)
{
	return r->ring == NULL ? 0 : ring_newest(r->ring);
}

void reader_seek(struct reader *r, uint64_t sequence)
{
	if (r->ring != NULL) {
		ring_seek(r->ring, sequence);
		r->is_done = 0;
	}
}

void reader_skip_session(struct reader *r)
{
	r->is_done = 1;
}

int reader_is_orphaned(struct reader *r)
{
	return r->ring != NULL && ring_is_orphaned(r->ring);
}
