/* SPDX-License-Identifier: MIT */
#include "sync0/print.h"

#include <inttypes.h>

#include "program/json.h"

void print_result(const struct sync0_result *r, FILE *out)
{
	char text[512];

	sync0_result_format(r, text, sizeof(text));
	fprintf(out, "%s\n", text);
}

void print_result_json(const struct sync0_result *r, FILE *out)
{
	struct json js;

	json_init(&js, out);
	json_object_begin(&js, NULL);
	json_text(&js, "sync0", r->kind == SYNC0_SHOT ? "shot" : "window");
	json_text(&js, "source", sync0_source_to_str(r->source));
	json_u64(&js, "slave", r->slave_pos);
	json_u64(&js, "line", r->line + 1u);
	json_text(&js, "verdict", sync0_verdict_to_str(r->verdict));
	for (unsigned i = 0; i < SYNC0_CHECKS; i++) {
		json_text(&js, sync0_check_to_str(i), sync0_verdict_to_str(r->check[i]));
	}
	json_u64(&js, "first_cycle", r->first_cycle);
	json_u64(&js, "cycles", r->cycles);
	json_u64(&js, "edges", r->edges);
	json_u64(&js, "missing", r->missing);
	json_u64(&js, "extra", r->extra);
	json_u64(&js, "overflow", r->overflow);
	json_i64(&js, "step_ns", r->step_ns);
	json_truth(&js, "disturbed", r->is_disturbed);
	json_fixed(&js, "period_ns", r->period_ns, 3);
	json_fixed(&js, "period_sd_ns", r->period_sd_ns, 1);
	json_i64(&js, "jitter_p99_ns", r->jitter_p99_ns);
	json_i64(&js, "jitter_max_ns", r->jitter_max_ns);
	json_fixed(&js, "drift_ppb", r->drift_ppb, 1);
	json_fixed(&js, "drift_error_ppb", r->drift_error_ppb, 1);
	json_fixed(&js, "rate_ppb", r->rate_ppb, 1);
	json_fixed(&js, "rate_error_ppb", r->rate_error_ppb, 1);
	json_i64(&js, "phase_ns", r->phase_ns);
	json_i64(&js, "phase_error_ns", r->phase_error_ns);
	json_i64(&js, "frame_ns", r->frame_ns);
	json_i64(&js, "skew_ns", r->skew_ns);
	json_i64(&js, "skew_error_ns", r->skew_error_ns);
	json_i64(&js, "dc_diff_ns", r->dc_diff_ns);
	json_u64(&js, "has", r->has);
	json_u64(&js, "resolved", r->is_resolved);
	json_object_end(&js);
	json_end_line(&js);
}

void print_line(const struct edge_item *item, FILE *out)
{
	fprintf(out, "slave %u (%s): SYNC0 cycle %" PRId64 " ns, shift %" PRId64 " ns\n",
		item->line.slave_pos, item->name, item->line.cycle_ns, item->line.shift_ns);
}

void print_line_json(const struct edge_item *item, FILE *out)
{
	struct json js;

	json_init(&js, out);
	json_object_begin(&js, NULL);
	json_text(&js, "sync0", "line");
	json_u64(&js, "slave", item->line.slave_pos);
	json_text(&js, "name", item->name);
	json_i64(&js, "cycle_ns", item->line.cycle_ns);
	json_i64(&js, "shift_ns", item->line.shift_ns);
	json_object_end(&js);
	json_end_line(&js);
}

void print_event(const struct event *ev, FILE *out)
{
	char text[256];

	event_format(ev, text, sizeof(text));
	fprintf(out, "! %s\n", text);
}

void print_event_json(const struct event *ev, FILE *out)
{
	struct json js;
	char text[256];

	event_format(ev, text, sizeof(text));
	json_init(&js, out);
	json_object_begin(&js, NULL);
	json_text(&js, "event", event_name(ev->id));
	json_i64(&js, "slave", ev->slave_pos == EVENT_NO_SLAVE ? -1 : (int)ev->slave_pos);
	json_u64(&js, "line", ev->line);
	json_i64(&js, "value", ev->value);
	json_array_begin(&js, "arg");
	json_i64(&js, NULL, ev->arg[0]);
	json_i64(&js, NULL, ev->arg[1]);
	json_array_end(&js);
	json_text(&js, "text", text);
	json_object_end(&js);
	json_end_line(&js);
}

void print_calibration(const struct calibration *c, FILE *out)
{
	fprintf(out,
		"%" PRIu64 " pulses on both lines, period %.1f ns\n"
		"noise of one line: sd %" PRId64 " ns, p99 %" PRId64 " ns, max %" PRId64 " ns\n"
		"second line behind the first: %" PRId64 " ns, +-%" PRId64 " ns\n",
		c->pairs, c->period_ns, c->noise.sd_ns, c->noise.p99_ns, c->noise.max_ns,
		c->noise.bias_ns, c->noise.bias_error_ns);
}
