/* SPDX-License-Identifier: MIT */
/* Bytes as a request of a Foxglove client, and as one of our page. Whatever they are: no crash, and
 * what is taken from them is within its bounds. */
#include <stdint.h>
#include <stdlib.h>

#include "web/foxglove.h"
#include "web/page.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
	static struct foxglove_request request;
	static struct page_request page;
	int r = foxglove_parse((const char *)data, size, &request);

	if (r > 0 || (r == 0 && request.count > FOXGLOVE_ITEMS)) {
		abort();
	}
	r = page_parse((const char *)data, size, &page);
	if (r > 0 || (r == 0 && page.op == PAGE_DRAW && page.draw.count > HISTORY_CHANNELS)) {
		abort();
	}
	return 0;
}
