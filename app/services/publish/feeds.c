/* SPDX-License-Identifier: MIT */
#include "publish/feeds.h"

#include <stdint.h>
#include <stdio.h>

#include "base/event.h"
#include "base/sync0.h"
#include "ecdaq.h"
#include "publish/sample_writer.h"

enum { RECORDS_PER_STEP = 64, TEXT_BYTES = 256, NAME_BYTES = 64 };

static int64_t utc_of(const struct sample_writer *samples, int64_t tai_ns)
{
	return samples == NULL ? tai_ns : sample_writer_utc_of_tai(samples, tai_ns);
}

static void put_event(const struct topics *topics, const struct sample_writer *samples,
		      const struct event *ev)
{
	char text[TEXT_BYTES];
	char name[NAME_BYTES];
	char severity[16];
	ecdaq_EventV1 m = {
		.session = samples == NULL ? 0 : sample_writer_table(samples)->meta.session,
		.cycle = ev->cycle,
		.utc_ns = utc_of(samples, ev->tai_ns),
		.name = name,
		.severity = severity,
		.slave = ev->slave_pos == EVENT_NO_SLAVE ? -1 : ev->slave_pos,
		.value = ev->value,
		.arg0 = ev->arg[0],
		.arg1 = ev->arg[1],
		.text = text,
	};

	event_format(ev, text, sizeof(text));
	snprintf(name, sizeof(name), "%s", event_name(ev->id));
	snprintf(severity, sizeof(severity), "%s", event_severity_to_str(event_severity(ev->id)));
	(void)topics_write(topics->event, &m, m.utc_ns);
}

static void put_result(const struct topics *topics, const struct sample_writer *samples,
		       const struct sync0_result *r)
{
	char source[NAME_BYTES];
	char verdict[NAME_BYTES];
	ecdaq_Sync0V1 m = {
		.slave = r->slave_pos,
		.line = r->line,
		.session = r->session,
		.utc_ns = utc_of(samples, r->tai_ns),
		.source = source,
		.verdict = verdict,
		.first_cycle = r->first_cycle,
		.cycles = r->cycles,
		.edges = r->edges,
		.missing = r->missing,
		.extra = r->extra,
		.overflow = r->overflow,
		.first_missing = r->first_missing,
		.step_ns = r->step_ns,
		.period_ns = r->period_ns,
		.period_sd_ns = r->period_sd_ns,
		.jitter_p99_ns = r->jitter_p99_ns,
		.jitter_max_ns = r->jitter_max_ns,
		.drift_ppb = r->drift_ppb,
		.drift_error_ppb = r->drift_error_ppb,
		.rate_ppb = r->rate_ppb,
		.rate_error_ppb = r->rate_error_ppb,
		.phase_ns = r->phase_ns,
		.phase_error_ns = r->phase_error_ns,
		.frame_ns = r->frame_ns,
		.skew_ns = r->skew_ns,
		.skew_error_ns = r->skew_error_ns,
		.dc_diff_ns = r->dc_diff_ns,
		.shot_dc_ns = r->shot_dc_ns,
		.shot_late_ns = r->shot_late_ns,
		.has = r->has,
		.resolved = r->is_resolved,
	};

	snprintf(source, sizeof(source), "%s", sync0_source_to_str(r->source));
	snprintf(verdict, sizeof(verdict), "%s", sync0_verdict_to_str(r->verdict));
	(void)topics_write(topics->sync0, &m, m.utc_ns);
}

void feeds_put_events(struct feed *feed, const struct topics *topics,
		      const struct sample_writer *samples)
{
	struct event ev;
	uint64_t lost = 0;

	for (unsigned n = 0; n < RECORDS_PER_STEP && feed_read(feed, &ev, sizeof(ev), NULL, &lost);
	     n++) {
		put_event(topics, samples, &ev);
	}
}

void feeds_put_sync0(struct feed *feed, const struct topics *topics,
		     const struct sample_writer *samples)
{
	struct sync0_result result;
	uint64_t lost = 0;

	for (unsigned n = 0;
	     n < RECORDS_PER_STEP && feed_read(feed, &result, sizeof(result), NULL, &lost); n++) {
		put_result(topics, samples, &result);
	}
}
