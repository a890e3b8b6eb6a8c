/* SPDX-License-Identifier: MIT */
/*
 * What a picture shows of samples that are not in the ring any more: `ecdaq-log envelope` reads
 * them from the recordings, one picture at a time, in a process of its own at low priority. What is
 * in a recording cannot stop the server, and nobody waits for it but the page that asked. Context:
 * one thread; nothing blocks.
 */
#ifndef WEB_PAST_H
#define WEB_PAST_H

#include <stdint.h>

#include "reader/table.h"
#include "web/history.h"

struct past;

/** Of the recordings in @dir (copied). 0, -ENOMEM. Free with past_destroy(). */
int past_create(const char *dir, struct past **ret_past);
void past_destroy(struct past *p);

/** The end for a request for the newest samples: pictures of more cycles than @ring_cycles end with
 * a whole column, so that the next one is the same but for its last columns. */
uint64_t past_end(const struct history_request *req, uint64_t newest, uint64_t ring_cycles);

/**
 * Complete @picture, which history_draw() made of @req and which begins before @oldest, the oldest
 * cycle of the ring. 0: it is complete, or the recordings have nothing for it; -EAGAIN: it was kept
 * for @owner, who asks again later; -EBUSY: that of another owner is being completed,
 * or was until now.
 */
int past_complete(struct past *p, const void *owner, const struct history_request *req,
		  const struct channel_table *table, uint64_t oldest,
		  const struct history_picture *picture);
/** After 0: the complete picture. */
const struct history_picture *past_picture(const struct past *p);
/** 1 while a picture of @owner is being completed: past_complete() needs no new picture. */
int past_is_for(const struct past *p, const void *owner);
/** @owner does not need it any more. */
void past_stop(struct past *p, const void *owner);

#endif
