/* SPDX-License-Identifier: MIT */
/*
 * Follows the sample ring and the event ring of the master, session after session, and records
 * them. Where it stands is known by cycle number: killed and started again, it goes on behind the
 * last cycle on disk. Context of all functions: blocking, one thread.
 */
#ifndef RECORD_RECORDER_H
#define RECORD_RECORDER_H

#include <stddef.h>
#include <stdint.h>

#include "base/platform.h"
#include "base/status.h"
#include "config/config.h"

struct recorder;
struct record_seam;

struct recorder_options {
	const char *ring_path;
	const char *events_path;
	const char *status_path; /* "": none */
	const char *sync0_path;  /* results of ecdaq-sync0; "" or NULL: none */
	const char *sync0_events_path;
	const char *dir; /* of the recordings */
	int64_t pid;     /* for the status page */
	int64_t chunk_period_ns;
	int64_t sync_period_ns;
	int64_t rotate_period_ns; /* 0: never */
	uint64_t rotate_bytes;    /* 0: never */
	uint64_t budget_bytes;    /* 0: none, and nothing is deleted */
	uint64_t reserve_bytes;   /* 0: none */
	enum config_when_full when_full;
	const char *marks_dir; /* of ecdaq-uplink; NULL or "": there is none */
	enum config_keep keep_until_uploaded;
	enum config_record_values values;
	int zstd_level; /* 0: no compression */
	const char *config_path;
	const char *config_text;
	struct platform platform;       /* its monotonic clock */
	const struct record_seam *seam; /* NULL: none */
	/** One line for a person (log). */
	void (*report)(void *ctx, const char *line);
	void *report_ctx;
};

/**
 * Lock the directory and recover what is unfinished. 0, or -errno with one line in @error: -EBUSY
 * another recorder works there. @opt is copied, its strings are not. Free with recorder_destroy().
 */
int recorder_create(const struct recorder_options *opt, struct recorder **ret_recorder, char *error,
		    size_t error_bytes);
/** Does not finish anything: what was written stays as .part. NULL is fine. */
void recorder_destroy(struct recorder *rec);

enum recorder_result {
	RECORDER_IDLE,  /* nothing to do for a few ms */
	RECORDER_BUSY,  /* there is more to read: call again at once */
	RECORDER_ENDED, /* a session has ended and its file is finished; said once */
};

/** Do what there is to do, without waiting. */
enum recorder_result recorder_step(struct recorder *rec);

/** Why no session can be recorded though there is a ring, or the ring may not be read: a negative
 * errno that waiting does not change; 0: none. */
int recorder_ring_error(const struct recorder *rec);

/** Record what is in the ring now, and finish the file. 0, or -errno: not all is recorded. */
int recorder_finish(struct recorder *rec);

/** The figures, as in the status page. */
const struct record_status *recorder_status(const struct recorder *rec);

#endif
