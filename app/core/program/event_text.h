/* SPDX-License-Identifier: MIT */
/* Events as people read them: with names and reasons, and what repeats in one line. Context: any.
 */
#ifndef PROGRAM_EVENT_TEXT_H
#define PROGRAM_EVENT_TEXT_H

#include <stddef.h>
#include <stdint.h>

#include "base/event.h"
#include "base/status.h"

enum { EVENT_TEXT_BYTES = 512 };

/**
 * event_format() with the slave's name behind its position, and the words of an AL status code
 * behind it. @page: of the slaves; NULL: no names.
 */
void event_text(const struct event *ev, const struct status_page *page, char buf[EVENT_TEXT_BYTES]);

/* Events of the kinds that repeat (lost frames and the like), of up to 10 s. */
struct event_fold {
	struct event first;
	struct event last;
	uint64_t total; /* 0: empty */
	uint64_t count[EVENT_COUNT];
	int64_t cycles_skipped; /* by overruns */
	int are_of_one_slave;
};

/** 1: @ev was added to @fold. 0: it repeats nothing, or comes too late: @fold is complete. */
int event_fold_add(struct event_fold *fold, const struct event *ev);
/** Is @ev of a kind that is folded? */
int event_fold_is_for(const struct event *ev);
/** Is it so old at CLOCK_MONOTONIC @mono_ns that no event can be added? */
int event_fold_is_over(const struct event_fold *fold, int64_t mono_ns);
/** "38 frames lost, 41 late in 9.8 s, cycle 1017 to 10803"; of a single event its own text. */
void event_fold_text(const struct event_fold *fold, const struct status_page *page,
		     char buf[EVENT_TEXT_BYTES]);
/** How many kinds of events it has; the @n-th, from 0, in the order of the text. */
size_t event_fold_kinds(const struct event_fold *fold);
enum event_id event_fold_kind(const struct event_fold *fold, size_t n);
/** The worst of its events. */
enum event_severity event_fold_severity(const struct event_fold *fold);

#endif
