/* SPDX-License-Identifier: MIT */
#include "sync0/print.h"

#include <inttypes.h>

void print_result(const struct sync0_result *r, FILE *out)
{
	char text[512];

	sync0_result_format(r, text, sizeof(text));
	fprintf(out, "%s\n", text);
}

void print_result_json(const struct sync0_result *r, FILE *out)
{
	fprintf(out,
		"{\"sync0\":\"%s\",\"source\":\"%s\",\"slave\":%u,\"line\":%u,\"verdict\":\"%s\",",
		r->kind == SYNC0_SHOT ? "shot" : "window", sync0_source_to_str(r->source),
		r->slave_pos, r->line + 1u, sync0_verdict_to_str(r->verdict));
	for (unsigned i = 0; i < SYNC0_CHECKS; i++) {
		fprintf(out, "\"%s\":\"%s\",", sync0_check_to_str(i),
			sync0_verdict_to_str(r->check[i]));
	}
	fprintf(out,
		"\"first_cycle\":%" PRIu64 ",\"cycles\":%" PRIu64 ",\"edges\":%" PRIu64
		",\"missing\":%" PRIu64 ",\"extra\":%" PRIu64 ",\"overflow\":%" PRIu64
		",\"step_ns\":%" PRId64 ",\"disturbed\":%s,",
		r->first_cycle, r->cycles, r->edges, r->missing, r->extra, r->overflow, r->step_ns,
		r->is_disturbed ? "true" : "false");
	fprintf(out,
		"\"period_ns\":%.3f,\"period_sd_ns\":%.1f,\"jitter_p99_ns\":%" PRId64
		",\"jitter_max_ns\":%" PRId64 ",\"drift_ppb\":%.1f,\"drift_error_ppb\":%.1f,"
		"\"rate_ppb\":%.1f,\"rate_error_ppb\":%.1f,",
		r->period_ns, r->period_sd_ns, r->jitter_p99_ns, r->jitter_max_ns, r->drift_ppb,
		r->drift_error_ppb, r->rate_ppb, r->rate_error_ppb);
	fprintf(out,
		"\"phase_ns\":%" PRId64 ",\"phase_error_ns\":%" PRId64 ",\"frame_ns\":%" PRId64
		",\"skew_ns\":%" PRId64 ",\"skew_error_ns\":%" PRId64 ",\"dc_diff_ns\":%" PRId64
		",\"has\":%u,\"resolved\":%u}\n",
		r->phase_ns, r->phase_error_ns, r->frame_ns, r->skew_ns, r->skew_error_ns,
		r->dc_diff_ns, r->has, r->is_resolved);
}

void print_event(const struct event *ev, FILE *out)
{
	char text[256];

	event_format(ev, text, sizeof(text));
	fprintf(out, "! %s\n", text);
}

void print_event_json(const struct event *ev, FILE *out)
{
	char text[256];

	/* Its text holds no character that JSON escapes. */
	event_format(ev, text, sizeof(text));
	fprintf(out,
		"{\"event\":\"%s\",\"slave\":%d,\"line\":%u,\"value\":%" PRId64
		",\"arg\":[%d,%d],\"text\":\"%s\"}\n",
		event_name(ev->id), ev->slave_pos == EVENT_NO_SLAVE ? -1 : (int)ev->slave_pos,
		ev->line, ev->value, ev->arg[0], ev->arg[1], text);
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
