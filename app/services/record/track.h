/* SPDX-License-Identifier: MIT */
/*
 * Summary of a recording, made while it is read: its session, its cycles and the gaps between
 * them, its events. A visitor for mcap_scan_create(), or fed item by item. Context: any.
 */
#ifndef RECORD_TRACK_H
#define RECORD_TRACK_H

#include <stdint.h>

#include "record/mcap_recover.h"
#include "record/store.h"

struct track {
	/* From the metadata "ecdaq.session" at the start of each file: what was recorded before it.
	 */
	struct store_state before;
	int has_session;
	uint64_t event_next;   /* the event to record next, from metadata and messages */
	int64_t event_mono_ns; /* of the event before that */
	/* From the messages of "/ecdaq/cycle". */
	int cycle_channel; /* -1: none yet */
	int event_channel;
	uint64_t cycles;
	uint64_t first_cycle;
	uint64_t last_cycle;
	uint64_t start_ns; /* log time of the first and of the last cycle */
	uint64_t end_ns;
	uint64_t gaps;
	uint64_t missing;
	uint64_t backward; /* times the cycle number did not go up */
	uint64_t events;
	/** Called for each gap, if not NULL: @count cycles from @first on are not there (0: number
	 * went back). */
	void (*gap)(void *ctx, uint64_t first, uint64_t count);
	void *ctx;
};

void track_init(struct track *t);
void track_item(struct track *t, const struct mcap_item *item);
/** The same as a visitor's function; @track is a struct track. */
void track_visit(void *track, const struct mcap_item *item);

/** Where to resume after the (one) recording that was read, and what was recorded of its session so
 * far. */
struct store_state track_state(const struct track *t);

#endif
