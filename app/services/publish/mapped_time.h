/* SPDX-License-Identifier: MIT */
/* Each sample's time as UTC, and news of the map that says so (base/timemap.h). Context: any. */
#ifndef PUBLISH_MAPPED_TIME_H
#define PUBLISH_MAPPED_TIME_H

#include "base/sample.h"
#include "base/timemap.h"

struct mapped_time;

/** For the session that @meta describes (kept by the caller). NULL with errno. */
struct mapped_time *mapped_time_create(const struct sample_meta *meta);
void mapped_time_destroy(struct mapped_time *mt);

/**
 * Take the next sample's pair of clocks; UTC of the sample in @ret_utc_ns, Unix ns. Before the
 * first frame came back, the wake has to do. 0, or -ENOMEM.
 */
int mapped_time_feed(struct mapped_time *mt, const struct sample_header *h, int64_t *ret_utc_ns);

int64_t mapped_time_of_tai(const struct mapped_time *mt, int64_t tai_ns);
void mapped_time_note_tai_offset(struct mapped_time *mt, int32_t tai_offset_s);

/** 1 and the map in @ret if there is one and it is worth telling: a second has passed, or a step.
 */
int mapped_time_news(struct mapped_time *mt, struct timemap_state *ret);

/** "tai"; "utc": the kernel's TAI offset is unset; "unset": the wall clock itself was never set. */
const char *mapped_time_quality(const struct timemap_state *state);
/** The same for people, one line. */
const char *mapped_time_explain(const struct timemap_state *state);

#endif
