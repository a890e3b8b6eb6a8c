/* SPDX-License-Identifier: MIT */
/*
 * One recording being written: DIR/NAME.part, with the topics of a layout, until it is finished and
 * renamed to DIR/NAME.mcap. Context: blocking.
 */
#ifndef RECORD_RECORD_FILE_H
#define RECORD_RECORD_FILE_H

#include <stddef.h>
#include <stdint.h>

#include "base/sample.h"
#include "base/timemap.h"
#include "record/layout.h"
#include "record/mcap.h"
#include "record/messages.h"
#include "record/record_spec.h"
#include "record/store.h"

struct record_file;

/** Make the file with all that goes before the first sample. 0 or -errno: then nothing is left
 * behind. */
int record_file_create(const struct record_file_spec *spec, struct record_file **ret_file);
/** Close without finishing: what was written stays as .part. NULL is fine. */
void record_file_destroy(struct record_file *f);

/**
 * Add the messages of one sample, all in one chunk. 0; or -errno of closing the chunk before it:
 * the sample is not in the file then.
 */
int record_file_sample(struct record_file *f, const struct sample_header *header,
		       const uint8_t *image, uint64_t utc_ns);
/** The same for an event and the time map. */
int record_file_event(struct record_file *f, const struct messages_event *ev);
int record_file_sync0(struct record_file *f, const struct sync0_result *result, int64_t utc_ns);
int record_file_timemap(struct record_file *f, const struct timemap_state *state, uint64_t utc_ns);

/** Write the open chunk. 0 or -errno: it stays open, try again. */
int record_file_close_chunk(struct record_file *f);
/** Cut to the first @bytes, after which only record_file_destroy() is left. 0 or -errno. */
int record_file_cut(struct record_file *f, uint64_t bytes);
/** Make durable what is written. */
int record_file_sync(struct record_file *f);

/** Note the end, write the summary, sync. 0 or -errno: the file is as before, try again. */
int record_file_finish(struct record_file *f, const struct record_file_end *end);
/** After record_file_finish(): rename .part to .mcap, durable. 0 or -errno. */
int record_file_publish(struct record_file *f);

const char *record_file_path(const struct record_file *f);
uint64_t record_file_bytes(const struct record_file *f);
/** What it will have when finished now, about. */
uint64_t record_file_final_bytes(const struct record_file *f);
/** 1: it cannot take more, finish it. */
int record_file_is_full(const struct record_file *f);
/** Samples behind the last closed chunk. */
uint64_t record_file_open_cycles(const struct record_file *f);

#endif
