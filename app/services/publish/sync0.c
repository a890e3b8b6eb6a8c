/* SPDX-License-Identifier: MIT */
#include "publish/sync0.h"

#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include "base/sync0.h"
#include "ecdaq.h"
#include "publish/samples.h"

enum { RESULTS_A_STEP = 64, TEXT_BYTES = 32 };

static void put(const struct topics *topics, const struct samples *samples,
		const struct sync0_result *r)
{
	char source[TEXT_BYTES];
	char verdict[TEXT_BYTES];
	ecdaq_Sync0V1 m = {
		.slave = r->slave_pos,
		.line = r->line,
		.session = r->session,
		.utc_ns = samples == NULL ? r->tai_ns : samples_utc_of_tai(samples, r->tai_ns),
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

void sync0_step(struct feed *feed, const struct topics *topics, const struct samples *samples)
{
	struct sync0_result result;
	uint64_t lost = 0;

	for (unsigned n = 0;
	     n < RESULTS_A_STEP && feed_read(feed, &result, sizeof(result), NULL, &lost); n++) {
		if (topics->sync0 > 0) {
			put(topics, samples, &result);
		}
	}
}
