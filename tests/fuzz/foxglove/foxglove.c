/* SPDX-License-Identifier: MIT */
/* Bytes as a request of a Foxglove client, and as one of our page. Whatever they are: no crash, and
 * what is taken from them is within its bounds. */
#include <stdint.h>
#include <stdlib.h>

#include "web/foxglove.h"
#include "web/page.h"
#include "web/parameters.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

/* Of a machine on which no ecdaqd runs. */
static struct source *make_source(void)
{
	static struct config cfg;
	struct outbox *box;
	struct source *source;

	config_defaults(&cfg);
	if (outbox_create((size_t)8 * SOURCE_LARGEST_BYTES, SOURCE_LARGEST_BYTES, &box) < 0 ||
	    source_create(&cfg, box, &source) < 0) {
		abort();
	}
	return source;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
	static struct source *source;
	static struct foxglove_request request;
	static struct page_request page;
	int r = foxglove_parse((const char *)data, size, &request);

	if (r > 0 || (r == 0 && request.count > FOXGLOVE_ITEMS)) {
		abort();
	}
	if (r == 0 && request.op == FOXGLOVE_GET_PARAMETERS) {
		char *answer = NULL;

		source = source != NULL ? source : make_source();
		r = parameters_answer((const char *)data, size, source, &answer);
		if ((r == 0) != (answer != NULL)) {
			abort();
		}
		free(answer);
	}
	r = page_parse((const char *)data, size, &page);
	if (r > 0 || (r == 0 && page.op == PAGE_DRAW && page.draw.count > HISTORY_CHANNELS)) {
		abort();
	}
	return 0;
}
