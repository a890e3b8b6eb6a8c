/* SPDX-License-Identifier: MIT */
/*
 * Recordings, read from where the stream ends: what the ring no longer has. Files are read in the
 * order in which they were recorded, the one being recorded up to its newest whole chunk. A file
 * that cannot be read is left out; the gap is found by whoever counts cycles. Context: blocking.
 */
#ifndef STREAM_HISTORY_H
#define STREAM_HISTORY_H

#include <stddef.h>
#include <stdint.h>

#include "stream/topics.h"

struct history;

enum history_result {
	HISTORY_BEGUN,   /* another file, or the first: history_topics() */
	HISTORY_MESSAGE, /* history_item(): of a slave */
	HISTORY_EVENT,   /* history_item(): its lane is not set */
	HISTORY_END,
};

struct history_item {
	size_t lane; /* index in history_topics() */
	uint64_t cycle;
	const uint8_t *data; /* CDR; valid until the next history_next() */
	size_t len;
	uint64_t time_ns;
};

/** The recordings in @dir (kept) from the file that has @cycle of @session on. 0, -ENOMEM; -errno
 * of the folder. Free with history_destroy(). */
int history_create(const char *dir, uint64_t session, uint64_t cycle, struct history **ret_history);
void history_destroy(struct history *h);

enum history_result history_next(struct history *h);
const struct topics *history_topics(const struct history *h);
const struct history_item *history_item(const struct history *h);

#endif
