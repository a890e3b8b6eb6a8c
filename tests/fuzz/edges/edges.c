/* SPDX-License-Identifier: MIT */
/* The input is an edge file: its lines go through the parser and, as --replay does it, the check.
 */
#include <assert.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "base/sync0.h"
#include "sync0/checker.h"
#include "sync0/edge_file.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

enum { LINES = 4, TEXT_BYTES = 256, INPUT_LINES = 400 };

static void on_result(void *ctx, const struct sync0_result *r)
{
	char text[512];

	(void)ctx;
	assert(r->line < LINES && r->edges <= r->cycles);
	assert(r->edges + r->missing <= r->cycles);
	sync0_result_format(r, text, sizeof(text));
}

static void on_event(void *ctx, const struct event *ev)
{
	char text[256];

	(void)ctx;
	event_format(ev, text, sizeof(text));
}

static void feed(struct checker *ck, struct edge_item *item)
{
	if (item->kind == EDGE_ITEM_CYCLE) {
		checker_cycle(ck, &item->cycle);
	} else if (item->kind == EDGE_ITEM_SHOT) {
		checker_shot(ck, item->shot.slave_pos % LINES, item->shot.at_dc_ns,
			     item->shot.due_dc_ns);
	} else if (item->kind == EDGE_ITEM_EDGE) {
		item->edge.line %= LINES;
		checker_edge(ck, &item->edge);
		checker_advance(ck, item->edge.mono_ns);
	}
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
	const struct checker_spec spec = {
		.period_ns = 1000000,
		.window_ns = 32000000,
		.lost_ns = 10000000,
		.grid = size > 0 && data[0] == 'c' ? CHECKER_GRID_MASTER : CHECKER_GRID_EDGES,
		.line_count = LINES,
		.line = { [3] = { .slave_pos = 3, .mode = CHECKER_ONESHOT } },
		.limits = { .drift_ppb = 1e5, .rate_ppb = 1e4, .phase_ns = 1000, .skew_ns = 100 },
		.result = on_result,
		.event = on_event,
	};
	struct checker *ck;
	size_t at = 0;

	if (checker_create(&spec, &ck) < 0) {
		return 0;
	}
	for (int n = 0; n < INPUT_LINES && at < size; n++) {
		const uint8_t *end = memchr(data + at, '\n', size - at);
		size_t len = end == NULL ? size - at : (size_t)(end - data) - at;
		char line[TEXT_BYTES] = "";
		struct edge_item item;

		memcpy(line, data + at, len < sizeof(line) - 1 ? len : sizeof(line) - 1);
		if (edge_line_parse(line, &item) == 0) {
			feed(ck, &item);
		}
		at += len + 1;
	}
	checker_finish(ck);
	checker_destroy(ck);
	return 0;
}
