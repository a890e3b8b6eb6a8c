/* SPDX-License-Identifier: MIT */
/*
 * The UTC of samples and events of one session. Feed every sample, in order; base/timemap.h makes
 * the map. Without distributed clocks, cycle number times period stands in for the DC time.
 * Context: any but the cycle.
 */
#ifndef READER_UTC_H
#define READER_UTC_H

#include "base/platform.h"
#include "base/sample.h"
#include "base/timemap.h"

struct utc;

enum utc_change {
	UTC_UNCHANGED,
	UTC_UPDATED, /* a second has passed since the last report, or this is the first one */
	UTC_STEPPED, /* the host's clock was set: UTC jumped */
};

/** For the session described by @meta (copied). NULL with errno. Free with utc_destroy(). */
struct utc *utc_create(const struct sample_meta *meta);
void utc_destroy(struct utc *utc);

/**
 * Take the next sample; its UTC in @ret_utc_ns, Unix ns. Before the first frame came back it is
 * taken from the host's clock at the wake. 0, or -ENOMEM (ret untouched).
 */
int utc_feed(struct utc *utc, const struct sample_header *header, int64_t *ret_utc_ns);

/** Whether the map has changed enough to be reported since the last call that returned it. */
enum utc_change utc_changed(struct utc *utc, struct timemap_state *ret_state);

/** CLOCK_TAI to UTC, Unix ns: for events and results. */
int64_t utc_of_tai(const struct utc *utc, int64_t tai_ns);
/** The kernel's TAI offset now (adjtimex). Call it about once a second. */
void utc_note_tai_offset(struct utc *utc, int32_t tai_offset_s);

/** What the kernel states of the host's clock now, its TAI offset too. Instead of the former. */
void utc_note_clock(struct utc *utc, const struct clock_quality *quality);

/** "tai"; "utc": the kernel's TAI offset is not set; "unset": the wall clock was never set. */
const char *utc_quality(const struct timemap_state *state);
/** The same for people, one line. */
const char *utc_explain(const struct timemap_state *state);

#endif
