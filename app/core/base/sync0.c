/* SPDX-License-Identifier: MIT */
#include "sync0.h"

#include <inttypes.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>

static const char *pick(const char *const *names, size_t count, uint32_t n)
{
	return n < count ? names[n] : "unknown";
}

#define PICK(names, n) pick(names, sizeof(names) / sizeof((names)[0]), n)

const char *sync0_source_to_str(uint32_t source)
{
	static const char *const names[] = {
		[SYNC0_GPIO] = "gpio",
		[SYNC0_SIMULATED] = "simulated edges",
		[SYNC0_RECORDED] = "recorded edges",
	};

	return PICK(names, source);
}

const char *sync0_verdict_to_str(uint32_t verdict)
{
	static const char *const names[] = {
		[SYNC0_NONE] = "-",    [SYNC0_OK] = "OK",     [SYNC0_UNRESOLVED] = "UNRESOLVED",
		[SYNC0_WARN] = "WARN", [SYNC0_FAIL] = "FAIL",
	};

	return PICK(names, verdict);
}

const char *sync0_check_to_str(uint32_t check)
{
	static const char *const names[] = {
		[SYNC0_CHECK_COUNT] = "count",   [SYNC0_CHECK_PERIOD] = "period",
		[SYNC0_CHECK_JITTER] = "jitter", [SYNC0_CHECK_PHASE] = "phase",
		[SYNC0_CHECK_SKEW] = "skew",
	};

	return PICK(names, check);
}

const char *sync0_state_to_str(uint32_t state)
{
	static const char *const names[] = {
		[SYNC0_WAITING] = "waiting for ecdaqd",
		[SYNC0_NO_LINE] = "no line",
		[SYNC0_NO_DC] = "no distributed clocks",
		[SYNC0_LEARNING] = "first window not full yet",
		[SYNC0_RUNNING] = "running",
		[SYNC0_ENDED] = "ended",
	};

	return PICK(names, state);
}

/* Append to a text, never beyond its end. */
struct text {
	char *buf;
	size_t room;
	size_t len;
};

__attribute__((format(printf, 2, 3))) static void append(struct text *t, const char *format, ...)
{
	va_list args;
	int n;

	va_start(args, format);
	n = vsnprintf(t->len < t->room ? t->buf + t->len : NULL,
		      t->len < t->room ? t->room - t->len : 0, format, args);
	va_end(args);
	t->len += n > 0 ? (size_t)n : 0;
}

static long long larger(int64_t ns, int64_t error_ns)
{
	return llabs(ns) > error_ns ? llabs(ns) : (long long)error_ns;
}

static void append_shot(struct text *t, const struct sync0_result *r)
{
	append(t, ": shot for DC time %" PRId64, r->shot_dc_ns);
	if (!r->has_come) {
		append(t, " did not come");
	} else if (r->is_resolved & SYNC0_HAS_PHASE) {
		append(t, " came %+" PRId64 " ns, +-%" PRId64, r->shot_late_ns, r->phase_error_ns);
	} else {
		append(t, " came; distance below %lld ns (unresolved)",
		       larger(r->shot_late_ns, r->phase_error_ns));
	}
}

static void append_counts(struct text *t, const struct sync0_result *r)
{
	append(t, ": cycles %" PRIu64 " to %" PRIu64 ": %" PRIu64 " edges", r->first_cycle,
	       r->first_cycle + r->cycles - 1, r->edges);
	if (r->missing > 0) {
		append(t, ", %" PRIu64 " MISSING from cycle %" PRIu64 " on", r->missing,
		       r->first_missing);
	}
	if (r->extra > 0) {
		append(t, ", %" PRIu64 " extra", r->extra);
	}
	if (r->overflow > 0) {
		append(t, ", %" PRIu64 " dropped by a full queue", r->overflow);
	}
	if (r->step_ns != 0) {
		append(t, ", %s step of %" PRId64 " ns", r->is_disturbed ? "clock" : "phase",
		       r->step_ns);
	}
}

/* Below the noise, all that is known is a bound. */
static void append_figure(struct text *t, const char *name, int64_t ns, int64_t error_ns,
			  int is_resolved)
{
	if (is_resolved) {
		append(t, ", %s %+" PRId64 " ns +-%" PRId64, name, ns, error_ns);
	} else {
		append(t, ", %s < %lld ns (unresolved)", name, larger(ns, error_ns));
	}
}

int sync0_result_format(const struct sync0_result *r, char *buf, size_t buf_len)
{
	struct text t = { .buf = buf, .room = buf_len };

	append(&t, "slave %u: %s", r->slave_pos, sync0_verdict_to_str(r->verdict));
	if (r->kind == SYNC0_SHOT) {
		append_shot(&t, r);
		return (int)t.len;
	}
	append_counts(&t, r);
	if (r->has & SYNC0_HAS_PERIOD) {
		append(&t, ", period %.1f ns", r->period_ns);
		append(&t,
		       r->is_resolved & SYNC0_HAS_JITTER
			       ? ", jitter p99 %" PRId64 " ns max %" PRId64
			       : ", jitter p99 < %" PRId64 " ns max < %" PRId64 " (unresolved)",
		       r->jitter_p99_ns, r->jitter_max_ns);
	}
	if (r->has & SYNC0_HAS_DRIFT) {
		append(&t, ", drift %+.0f ppb +-%.0f", r->drift_ppb, r->drift_error_ppb);
	}
	if (r->has & SYNC0_HAS_RATE) {
		append(&t, ", rate %+.0f ppb +-%.0f", r->rate_ppb, r->rate_error_ppb);
	}
	if (r->has & SYNC0_HAS_PHASE) {
		append_figure(&t, "phase", r->phase_ns, r->phase_error_ns,
			      (r->is_resolved & SYNC0_HAS_PHASE) != 0);
		append(&t, ", frame %" PRId64 " ns behind", r->frame_ns);
	}
	if (r->has & SYNC0_HAS_SKEW) {
		append_figure(&t, "skew", r->skew_ns, r->skew_error_ns,
			      (r->is_resolved & SYNC0_HAS_SKEW) != 0);
	}
	if (r->dc_diff_ns >= 0) {
		append(&t, ", 0x092C <= %" PRId64 " ns", r->dc_diff_ns);
	}
	return (int)t.len;
}

int sync0_beyond_format(const struct sync0_status *page, char *buf, size_t buf_len)
{
	uint32_t count = atomic_load_explicit(&page->beyond_count, memory_order_relaxed);
	char more[32] = "";

	if (count == 0) {
		buf[0] = '\0';
		return 0;
	}
	if (count > 1) {
		snprintf(more, sizeof(more), " and %" PRIu32 " more", count - 1);
	}
	return snprintf(buf, buf_len, "not checked: slave %" PRIu32 " (%.31s)%s: only %d lines",
			atomic_load_explicit(&page->beyond_pos, memory_order_relaxed),
			page->beyond_slave, more, LIMIT_SYNC0_LINES);
}
