/* SPDX-License-Identifier: MIT */
/* The query of `GET /window.mcap`: which cycles of which session. Context: any. */
#ifndef WEB_WINDOW_H
#define WEB_WINDOW_H

#include <stdint.h>

enum {
	WINDOW_CYCLES = 1 << 22, /* an hour at 1 kHz, and more */
	WINDOW_QUERY_BYTES = 96, /* of the longest one, and its end */
};

struct window {
	uint64_t session;
	uint64_t from; /* cycles, both included */
	uint64_t to;
};

/** From "session=N&from=N&to=N", in any order, each once and nothing else. 0; -EINVAL: it is not
 * like that, or its end is before its start; -ERANGE: more than WINDOW_CYCLES. */
int window_parse(const char *query, struct window *ret);

#endif
