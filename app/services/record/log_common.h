/* SPDX-License-Identifier: MIT */
/* Shared by the verbs of `ecdaq log`. */
#ifndef RECORD_LOG_COMMON_H
#define RECORD_LOG_COMMON_H

#include <stdint.h>
#include <stdio.h>

#include "record/file_io.h"
#include "record/mcap_recover.h"
#include "record/track.h"

/** "ecdaq: log: what: why" to @err. Returns EXIT_CODE_FAILED. */
int log_fail(FILE *err, const char *what, const char *why);
/** The same for a negative errno @error of reading a recording. */
int log_fail_errno(FILE *err, const char *what, int error);

/* An open recording. */
struct log_file {
	int fd;
	struct mcap_source source;
	struct file_watch watch; /* with log_file_watch() */
};

/** 0 or -errno. @file stays where it is until log_file_close(). */
int log_file_open(const char *path, struct log_file *file);
void log_file_close(struct log_file *file);
/** Show how far the reading of @file is (program/progress.h) until it is closed. */
void log_file_watch(struct log_file *file, const char *path);

/** "X.part" to "X.mcap", in place. 1, or 0 if @path is not a .part. */
int log_part_to_final(char *path);
/** 1 if @path is a .part and a recorder is at work in its directory. */
int log_is_recording(const char *path);

/** Unix ns as "2026-01-02T03:04:05.006Z". */
enum { LOG_TIME_BYTES = 40 };
void log_format_time(uint64_t utc_ns, char buf[LOG_TIME_BYTES]);

/** EXIT_CODE_OK, or EXIT_CODE_FAILED if writing to @out failed. */
int log_finish_output(FILE *out, FILE *err);

const char *log_ending_to_str(enum mcap_ending ending);

#endif
