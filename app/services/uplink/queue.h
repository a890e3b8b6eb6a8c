/* SPDX-License-Identifier: MIT */
/* The finished recordings of a folder, and which of them are uploaded. Context: blocking. */
#ifndef UPLINK_QUEUE_H
#define UPLINK_QUEUE_H

#include <stddef.h>
#include <stdint.h>

#include "record/store.h"

struct queue_item {
	struct store_entry entry;
	int is_uploaded;
	int is_reported;       /* its own problem was */
	int64_t not_before_ns; /* CLOCK_MONOTONIC of the next attempt */
};

struct queue {
	struct queue_item *item; /* in the order of their sequence */
	size_t count;
};

/**
 * Look again. @lost (with @ctx) is called for each recording that went before it was uploaded. 0;
 * -errno of the folder, or -ENOMEM: the queue is as before.
 */
int queue_update(struct queue *q, const char *record_dir, const char *marks_dir,
		 void (*lost)(void *ctx, const struct queue_item *item), void *ctx);
void queue_done(struct queue *q);

/** The oldest that is to be uploaded at @now_ns; NULL: none. */
struct queue_item *queue_next(struct queue *q, int64_t now_ns);
/** NULL: not there. */
struct queue_item *queue_find(struct queue *q, const char *name);

/** A recording that has marks in @marks_dir and is not in the queue to @ret_name. 1; 0: none. */
int queue_find_leftover(struct queue *q, const char *marks_dir, char ret_name[STORE_NAME_BYTES]);

#endif
