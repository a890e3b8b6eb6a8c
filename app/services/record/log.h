/* SPDX-License-Identifier: MIT */
/*
 * What people do with recordings: `ecdaq log list|info|check|recover|export|cut|envelope|ros2pkg`.
 * Context: blocking.
 */
#ifndef RECORD_LOG_H
#define RECORD_LOG_H

#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include "program/exit_code.h"

enum log_format { LOG_TEXT, LOG_JSON };

/* Each returns an exit code; an error is one line "ecdaq: log: what: why" to @err. */

/** The command line of `ecdaq log`: ecdaq-log, run by ecdaq. Output goes to stdout, errors to
 * stderr. */
int log_main(int argc, char **argv);

/** A table of the recordings in @dir: start, duration, cycles, size, state. */
int log_list(const char *dir, enum log_format format, FILE *out, FILE *err);
/** Topics with their fields and counts, metadata, attachments of one file. */
int log_info(const char *path, enum log_format format, FILE *out, FILE *err);
/**
 * Read all of the files (or of the directories) at @paths: all CRCs, schemas and channels in head,
 * chunks and summary against each other, and cycle numbers without a gap inside of files and from
 * one to the next. EXIT_CODE_OK: clean.
 */
int log_check(const char *const *paths, size_t count, enum log_format format, FILE *out, FILE *err);
/** Repair @path in place, or copy its undamaged part to @output if that is not NULL. */
int log_recover(const char *path, const char *output, enum log_format format, FILE *out, FILE *err);

/** A ROS 2 package with the message types of the files at @paths as the new folder @dir. */
int log_ros2pkg(const char *const *paths, size_t count, const char *dir, FILE *out, FILE *err);

struct log_export_options {
	const char *const *paths;
	size_t path_count;
	const char *output;   /* name of the file that is written; NULL: none */
	const char *channels; /* names, separated by commas; NULL: all */
	uint64_t from;        /* cycles, both included */
	uint64_t to;
	int is_raw;             /* values as on the wire; else physical */
	enum log_format format; /* CSV, or a JSON object a line */
};

struct log_envelope_options {
	const char *dir;
	const char *channels; /* as above */
	uint64_t session;     /* 0: the newest one */
	uint64_t from;        /* cycles, both included */
	uint64_t to;          /* UINT64_MAX: what there is */
	uint64_t rows;        /* 1 to LOG_ENVELOPE_ROWS */
	enum log_format format;
};

struct log_cut_options {
	const char *dir;
	const char *output; /* NULL: standard output, which may be a pipe */
	uint64_t session;   /* 0: the newest one */
	uint64_t from;      /* cycles, both included */
	uint64_t to;
};

enum {
	LOG_ENVELOPE_ROWS = 65536,
	LOG_ENVELOPE_CELLS = 1 << 23, /* rows times channels */
};
#define LOG_ENVELOPE_CYCLES (UINT64_C(1) << 48) /* so many times so many rows are a number */

/** A table with so many rows for the samples of a session: least, greatest, mean and RMS value of
 * each channel in each. Rows of a second or more are made of whole seconds, which were counted when
 * they were recorded (record/envelope.h). */
int log_envelope(const struct log_envelope_options *options, FILE *out, FILE *err);

/** The cycles from one to another of a session as a recording of its own, with their events; a file
 * that is there already is not written to. */
int log_cut(const struct log_cut_options *options, FILE *err);

/** The samples of @options->paths as a table, a row a cycle. */
int log_export(const struct log_export_options *options, FILE *out, FILE *err);

#endif
