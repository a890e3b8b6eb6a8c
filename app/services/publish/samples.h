/* SPDX-License-Identifier: MIT */
/*
 * The samples of one session of the master, from its ring to ecdaq/sample and ecdaq/block. Context:
 * the publisher's thread.
 */
#ifndef PUBLISH_SAMPLES_H
#define PUBLISH_SAMPLES_H

#include "config/config.h"
#include "publish/topics.h"
#include "reader/reader.h"
#include "reader/utc.h"

struct samples;

enum samples_result { SAMPLES_MORE, SAMPLES_EMPTY, SAMPLES_ENDED };

struct samples_counts {
	uint64_t published; /* cycles */
	uint64_t missed;    /* had left the ring */
	uint64_t failed;    /* messages that DDS did not take */
};

/** The session that @reader has begun. The caller keeps all of them. 0, or -ENOMEM. */
int samples_create(struct reader *reader, const struct config *cfg, const struct topics *topics,
		   struct samples_counts *counts, struct samples **ret_samples);
/** What is in unfinished blocks is published first. */
void samples_destroy(struct samples *samples);

/** Publish @most cycles at most. */
enum samples_result samples_step(struct samples *samples, unsigned most);

const struct channel_table *samples_table(const struct samples *samples);
/** The newest cycle published; 0: none yet. */
uint64_t samples_cycle(const struct samples *samples);
int64_t samples_utc_of_tai(const struct samples *samples, int64_t tai_ns);
void samples_note_tai_offset(struct samples *samples, int32_t tai_offset_s);
/** The map to UTC, when it has changed enough to be published. */
enum utc_change samples_utc_changed(struct samples *samples, struct timemap_state *ret);

#endif
