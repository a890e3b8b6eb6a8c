/* SPDX-License-Identifier: MIT */
/*
 * Publishes the samples of one session of the master on ecdaq/sample and ecdaq/block. Context: the
 * publisher's thread.
 */
#ifndef PUBLISH_SAMPLE_WRITER_H
#define PUBLISH_SAMPLE_WRITER_H

#include "config/config.h"
#include "publish/topics.h"
#include "reader/reader.h"
#include "reader/utc.h"

struct sample_writer;

enum sample_writer_result { SAMPLE_WRITER_MORE, SAMPLE_WRITER_EMPTY, SAMPLE_WRITER_ENDED };

struct sample_counts {
	uint64_t published; /* cycles */
	uint64_t missed;    /* cycles overwritten in the ring before they were read */
	uint64_t failed;    /* messages that DDS rejected */
};

/** The session that @reader has begun. The caller keeps all of them. 0, or -ENOMEM. */
int sample_writer_create(struct reader *reader, const struct config *cfg,
			 const struct topics *topics, struct sample_counts *counts,
			 struct sample_writer **ret_samples);
/** Publishes unfinished blocks first. */
void sample_writer_destroy(struct sample_writer *samples);

/** Publish at most @most cycles. */
enum sample_writer_result sample_writer_step(struct sample_writer *samples, unsigned most);

const struct channel_table *sample_writer_table(const struct sample_writer *samples);
/** The cycle published last; 0: none. */
uint64_t sample_writer_cycle(const struct sample_writer *samples);
int64_t sample_writer_utc_of_tai(const struct sample_writer *samples, int64_t tai_ns);
void sample_writer_note_tai_offset(struct sample_writer *samples, int32_t tai_offset_s);
/** The map to UTC, when it has changed enough to be published. */
enum utc_change sample_writer_utc_changed(struct sample_writer *samples, struct timemap_state *ret);

#endif
