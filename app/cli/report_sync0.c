/* SPDX-License-Identifier: MIT */
/* What `ecdaq status` says of ecdaq-sync0: nothing where there is none. */
#include <inttypes.h>

#include "base/sync0.h"
#include "cli/report.h"
#include "cli/sync0_source.h"

#define GET(field) atomic_load_explicit(&(field), memory_order_relaxed)

static uint32_t worst(const struct sync0_status *page)
{
	uint32_t v = SYNC0_NONE;

	for (uint32_t i = 0; i < sync0_source_lines(page); i++) {
		const struct sync0_line_status *ls = &page->line[i];
		uint32_t own = GET(ls->is_lost) ? SYNC0_FAIL : GET(ls->verdict);

		v = own > v ? own : v;
	}
	return v;
}

void report_sync0_line(const struct report *report, FILE *out)
{
	const struct sync0_status *page = report->sync0;
	uint64_t missing = 0;

	if (page == NULL) {
		return;
	}
	for (uint32_t i = 0; i < sync0_source_lines(page); i++) {
		missing += GET(page->line[i].missing);
	}
	fprintf(out,
		"sync0      %s%s: %s   %u lines: %s   %" PRIu64 " windows   %" PRIu64
		" pulses missing   %" PRIu64 " alarms\n",
		sync0_source_to_str(page->source), report->is_sync0_running ? "" : " (gone)",
		sync0_state_to_str(GET(page->state)), sync0_source_lines(page),
		sync0_verdict_to_str(worst(page)), GET(page->windows), missing, GET(page->alarms));
}

void report_sync0_json(const struct report *report, struct json *js)
{
	const struct sync0_status *page = report->sync0;

	if (page == NULL) {
		json_null(js, "sync0");
		return;
	}
	json_object_begin(js, "sync0");
	json_truth(js, "running", report->is_sync0_running);
	json_text(js, "source", sync0_source_to_str(page->source));
	json_text(js, "state", sync0_state_to_str(GET(page->state)));
	json_text(js, "verdict", sync0_verdict_to_str(worst(page)));
	json_u64(js, "lines", sync0_source_lines(page));
	json_u64(js, "windows", GET(page->windows));
	json_u64(js, "alarms", GET(page->alarms));
	json_object_end(js);
}
