/* SPDX-License-Identifier: MIT */
/* The newest events of ecdaqd, for pages that are opened later. Context: one thread. */
#ifndef WEB_EVENT_LOG_H
#define WEB_EVENT_LOG_H

#include <stdint.h>

#include "base/event.h"

enum { EVENT_LOG_EVENTS = 500 };

struct event_log;

/** Of the event ring at @path. 0, -ENOMEM. Free with event_log_destroy(). */
int event_log_create(const char *path, struct event_log **ret_log);
void event_log_destroy(struct event_log *log);

/** Read what is new. */
void event_log_poll(struct event_log *log);

/** Number of events so far, of which the last EVENT_LOG_EVENTS are kept. */
uint64_t event_log_count(const struct event_log *log);
/** The event with this number, from 0; NULL: it is not kept. */
const struct event *event_log_at(const struct event_log *log, uint64_t number);
/**
 * Put the cycles of the events of this severity and worse in @ret, ascending, as far as they are of
 * the session that began last. Returns how many.
 */
uint32_t event_log_cycles(const struct event_log *log, enum event_severity severity,
			  uint64_t ret[EVENT_LOG_EVENTS]);

#endif
