/* SPDX-License-Identifier: MIT */
/*
 * The protocol of our own page (subprotocol ecdaq.page.v1; doc/reference/web.md): requests of the
 * page, which are foreign input, and the texts for it. Context: blocking.
 */
#ifndef WEB_PAGE_H
#define WEB_PAGE_H

#include <stddef.h>
#include <stdint.h>

#include "base/status.h"
#include "reader/table.h"
#include "web/event_log.h"
#include "web/history.h"

enum { PAGE_REQUEST_BYTES = 4096 };

enum page_op { PAGE_VALUES, PAGE_DRAW, PAGE_RECORDINGS, PAGE_BUS, PAGE_FOLDS };

struct page_request {
	enum page_op op;
	int is_on; /* from now on, PAGE_VALUES: values of all channels, PAGE_RECORDINGS: the list,
		    * PAGE_BUS: the tree, PAGE_FOLDS: the events in lines */
	int has_slave; /* PAGE_BUS: and all of this slave */
	uint32_t slave;
	uint32_t id; /* PAGE_DRAW: comes back with the picture */
	struct history_request draw;
	enum event_severity severity; /* with a trigger TRIGGER_EVENT: of this one and worse */
};

/** 0; -EBADMSG: not JSON or not of the protocol. @ret is undefined on failure. */
int page_parse(const char *text, size_t len, struct page_request *ret);

/** To a request with a trigger TRIGGER_EVENT, the cycles of the events in @log, kept in @cycle. */
void page_add_events(struct page_request *request, const struct event_log *log,
		     uint64_t cycle[EVENT_LOG_EVENTS]);

/* What page_state() is made from. */
struct page_status {
	const struct status_page *page;
	int page_error; /* 0, or why @page could not be read */
	int is_alive;   /* ecdaqd is */
	const struct record_status *record;
	int record_error;
	int is_recorder_alive;
};

/* Texts; free() them. NULL without memory. */
/** Slaves and channels of the session; @table NULL: there is none yet. A sample is in a recording
 * after @recorded_ms. */
char *page_table(const struct channel_table *table, int64_t recorded_ms);
char *page_state(const struct page_status *status);
/** A value for each channel; NaN: not good. */
char *page_values(const double *value, uint32_t count, uint64_t cycle);
/** The events from number @first on that are kept; @utc_minus_tai_ns is added to their time. */
char *page_events(const struct event_log *log, uint64_t first, int64_t utc_minus_tai_ns);
/** Why there is no picture for request @id: @error of history_draw(). */
char *page_no_picture(uint32_t id, int error);

/**
 * The picture as bytes: the length of a JSON text (4 bytes, little-endian), that text, filled up
 * with spaces to a multiple of 4, then for each channel min and max of each column as float32, then
 * a byte of marks for each column. Returns the number of bytes; 0: more than @buf_len.
 */
size_t page_picture(const struct history_request *request, const struct history_picture *picture,
		    uint32_t id, uint8_t *buf, size_t buf_len);

#endif
