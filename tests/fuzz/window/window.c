/* SPDX-License-Identifier: MIT */
/* The query of a request: what was accepted is a window that may be asked for. */
#include <assert.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include "web/window.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
	char query[WINDOW_QUERY_BYTES];
	struct window w;

	if (size >= sizeof(query)) {
		return 0;
	}
	memcpy(query, data, size);
	query[size] = '\0';
	if (window_parse(query, &w) == 0) {
		assert(w.session > 0);
		assert(w.from <= w.to && w.to - w.from < WINDOW_CYCLES);
	}
	return 0;
}
