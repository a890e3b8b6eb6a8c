/* SPDX-License-Identifier: MIT */
/*
 * The way of one recording into the store: read, its key, sent, checked, its manifest, marked. Each
 * step may fail and is done again; what is done is found by the mark and by the store. Context:
 * blocking.
 */
#ifndef UPLINK_JOB_H
#define UPLINK_JOB_H

#include "config/config.h"
#include "record/store.h"
#include "uplink/bucket.h"

struct job;

/* What the steps share. */
struct job_context {
	const struct config *cfg;
	const char *appliance;
	struct bucket *bucket;
	void (*report)(const char *line);
	/* So many bytes of the recording are in the store. */
	void (*progress)(void *ctx, uint64_t bytes);
	void *ctx;
};

enum job_result {
	JOB_DONE,   /* uploaded, and marked */
	JOB_FAILED, /* the store or the way to it: try again, with a line in the problem */
	JOB_BAD,    /* the recording cannot be read, or a mark not written: a line; others can */
	JOB_GONE,   /* the recording was deleted meanwhile; what the store had of it is not kept */
	JOB_STOPPED,
};

/** Of the recording of @entry; @context is kept. NULL: out of memory. Free with job_destroy(). */
struct job *job_create(const struct job_context *context, const struct store_entry *entry);
void job_destroy(struct job *j);
const char *job_name(const struct job *j);

enum job_result job_run(struct job *j, char problem[BUCKET_PROBLEM_BYTES]);

/** Undo the mark of a recording that is no longer there: what the store has of an unfinished upload
 * is given up first. As job_run(): JOB_DONE, JOB_FAILED, JOB_BAD, JOB_STOPPED. */
enum job_result job_give_up(const struct job_context *context, const char *name,
			    char problem[BUCKET_PROBLEM_BYTES]);

#endif
