/* SPDX-License-Identifier: MIT */
/*
 * A master and a recorder on the bench: rings and recordings in a directory of their own, time that
 * stands still until it is moved, files whose calls can be made to fail.
 */
#ifndef TESTS_UNIT_RECORD_BENCH_H
#define TESTS_UNIT_RECORD_BENCH_H

#include "base/ring.h"
#include "base/sample.h"
#include "record/record_file.h"
#include "record/recorder.h"
#include "record/track.h"

enum { BENCH_PATH_BYTES = 128, BENCH_IMAGE_BYTES = 4, BENCH_LOST = 8 };

/* Bytes of a file that only the page cache has. */
struct bench_lost {
	int fd;
	unsigned file;
	uint64_t from;
	uint64_t to;
	uint8_t head[16]; /* of them: other bytes there were written later */
};

struct bench {
	char root[BENCH_PATH_BYTES];
	char ring_path[BENCH_PATH_BYTES + 16];
	char events_path[BENCH_PATH_BYTES + 16];
	char status_path[BENCH_PATH_BYTES + 16];
	char dir[BENCH_PATH_BYTES + 16];
	struct ring *ring;
	struct ring *events;
	uint64_t session;
	int64_t now_ns;
	int64_t tai_step_ns;   /* the host's clock was set by this much */
	int64_t newest_tai_ns; /* of the newest sample */
	int has_even_times;    /* bench_read() CHECKs that log times go on evenly over all files */
	struct recorder_options options;
	struct recorder *recorder;
	struct record_seam seam;
	struct mcap_io io;   /* the real one, of the newest file */
	unsigned calls;      /* to files, all together */
	unsigned fail_call;  /* from this one on calls fail; 0: none */
	unsigned fail_count; /* so many */
	int error;
	uint64_t bytes_free; /* as the file system is to say */
	uint64_t disk_bytes; /* not 0: free is what all files in the directory leave of this */
	uint64_t most_bytes; /* that they had, whenever the recorder looked */
	/* As Linux does it: what a failed sync had is clean in the page cache, and not on the disk.
	 */
	struct bench_lost lost[BENCH_LOST];
	unsigned lost_count;
	unsigned file;         /* number of the newest file */
	int file_fd;           /* the same, once more */
	uint64_t synced_bytes; /* of it */
	char said[4096];       /* by the recorder, a line each */
};

/** Rings of session @session with @slots slots, and options to record them. Start from a zeroed
 * struct. */
void bench_init(struct bench *b, uint64_t session, uint64_t slots);
void bench_done(struct bench *b);
/** Another run of the master: new rings. The old are closed first where @is_closed. */
void bench_restart_master(struct bench *b, uint64_t session, int is_closed);

/** Push the samples of @count cycles from @first on. */
void bench_push(struct bench *b, uint64_t first, uint64_t count);
void bench_push_event(struct bench *b, uint64_t number);

/** Start the recorder; its result. */
int bench_start(struct bench *b);
/** As SIGKILL does: nothing is finished. */
void bench_kill(struct bench *b);
/** Step until nothing is left to do; returns 1 if a session ended. */
int bench_run(struct bench *b);
/** Move time on by @ns and run, in steps of at most 50 ms. */
void bench_wait(struct bench *b, int64_t ns);
/** Stop in order. */
int bench_stop(struct bench *b);

/** Bytes of all recordings in @dir. */
uint64_t bench_used(const char *dir);

/** All recordings together, as after the next mount: cycles in order over all files (CHECKed to be
 * readable). */
struct track bench_read(struct bench *b, unsigned *ret_finished, unsigned *ret_parts);

#endif
