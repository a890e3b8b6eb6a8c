/* SPDX-License-Identifier: MIT */
/* The events that are kept as ecdaq events shows them: what repeats in one line. Context: blocking.
 */
#ifndef WEB_FOLDS_H
#define WEB_FOLDS_H

#include <stdint.h>

#include "base/status.h"
#include "web/event_log.h"

/**
 * A text with a line for each event, or for those that repeat; free() it. NULL without memory.
 * @page: for the names of slaves; NULL: none. @utc_minus_tai_ns is added to their time.
 */
char *folds_text(const struct event_log *log, const struct status_page *page,
		 int64_t utc_minus_tai_ns);

#endif
