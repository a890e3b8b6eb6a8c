/* SPDX-License-Identifier: MIT */
/*
 * One run of the master: its samples from the ring into the sink, by cycle number, each mapped to
 * UTC. Gaps are found, counted and told here. Context: blocking.
 */
#ifndef RECORD_SAMPLE_FEED_H
#define RECORD_SAMPLE_FEED_H

#include "base/event.h"
#include "base/platform.h"
#include "base/sync0.h"
#include "reader/reader.h"
#include "record/sink.h"

struct sample_feed;

/**
 * Read the session that @reader has begun: behind the last recorded cycle if the sink knows this
 * session, else from the oldest sample. The caller keeps both. 0, or -ENOMEM. Free with
 * sample_feed_destroy().
 */
int sample_feed_create(struct reader *reader, struct sink *sink, enum config_record_values values,
		       struct sample_feed **ret_session);
void sample_feed_destroy(struct sample_feed *s);
uint64_t sample_feed_number(const struct sample_feed *s);
/** Slots that had left the ring before this session could be read for the first time. */
uint64_t sample_feed_missed_start(const struct sample_feed *s);

enum sample_feed_result {
	SAMPLE_FEED_MORE,  /* @most samples were read, there may be more */
	SAMPLE_FEED_EMPTY, /* all were read */
	SAMPLE_FEED_ENDED, /* all were read, and none will follow: reader_error() */
	SAMPLE_FEED_STUCK, /* the sink does not take any: come back when it is ready */
};

/** Read up to @most slots. */
enum sample_feed_result sample_feed_read(struct sample_feed *s, unsigned most);

/** Read again from where the sink says: what it had is partly lost. */
void sample_feed_rewind(struct sample_feed *s);

/** 1 if the samples read so far are older than @ev. */
int sample_feed_is_behind(const struct sample_feed *s, const struct event *ev);
/** Give an event of the master to the sink, with text and time. 0 or -errno. */
int sample_feed_event(struct sample_feed *s, const struct event *ev, uint64_t sequence);

/** A result of ecdaq-sync0, the same. */
int sample_feed_sync0(struct sample_feed *s, const struct sync0_result *result, uint64_t sequence);

/** What the kernel states of the host's clock. */
void sample_feed_note_clock(struct sample_feed *s, const struct clock_quality *quality);

#endif
