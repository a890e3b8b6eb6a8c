/* SPDX-License-Identifier: MIT */
#include "web/event_log.h"

#include <errno.h>
#include <stdlib.h>

#include "reader/feed.h"

struct event_log {
	struct feed *feed;
	uint64_t count;
	struct event event[EVENT_LOG_EVENTS];
};

int event_log_create(const char *path, struct event_log **ret_log)
{
	struct event_log *log = calloc(1, sizeof(*log));

	if (log == NULL) {
		return -ENOMEM;
	}
	log->feed = feed_create(FEED_EVENTS, path, FEED_AT_OLDEST);
	if (log->feed == NULL) {
		free(log);
		return -ENOMEM;
	}
	*ret_log = log;
	return 0;
}

void event_log_destroy(struct event_log *log)
{
	if (log != NULL) {
		feed_destroy(log->feed);
		free(log);
	}
}

void event_log_poll(struct event_log *log)
{
	struct event event;
	uint64_t lost = 0;

	(void)feed_open(log->feed, NULL);
	for (int n = 0;
	     n < EVENT_LOG_EVENTS && feed_read(log->feed, &event, sizeof(event), NULL, &lost);
	     n++) {
		log->event[log->count++ % EVENT_LOG_EVENTS] = event;
	}
}

uint64_t event_log_count(const struct event_log *log)
{
	return log->count;
}

const struct event *event_log_at(const struct event_log *log, uint64_t number)
{
	return number < log->count && log->count - number <= EVENT_LOG_EVENTS
		       ? &log->event[number % EVENT_LOG_EVENTS]
		       : NULL;
}

uint32_t event_log_cycles(const struct event_log *log, enum event_severity severity,
			  uint64_t ret[EVENT_LOG_EVENTS])
{
	uint64_t kept = log->count < EVENT_LOG_EVENTS ? log->count : EVENT_LOG_EVENTS;
	uint32_t count = 0;

	for (uint64_t n = log->count - kept; n < log->count; n++) {
		const struct event *ev = &log->event[n % EVENT_LOG_EVENTS];

		count = ev->id == EVENT_STARTED ? 0 : count; /* cycles of the session before */
		/* Reported late, an event may be of a cycle before the one before. */
		if (event_severity(ev->id) >= severity &&
		    (count == 0 || ev->cycle > ret[count - 1])) {
			ret[count++] = ev->cycle;
		}
	}
	return count;
}
