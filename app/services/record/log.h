/* SPDX-License-Identifier: MIT */
/*
 * What people do with recordings: `ecdaq log list|info|check|recover|export`. Context: blocking.
 */
#ifndef RECORD_LOG_H
#define RECORD_LOG_H

#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

/* Exit codes; part of the interface. */
enum log_exit {
	LOG_OK = 0,
	LOG_FAILED = 1, /* what was asked for could not be done; check: gaps or damage were found */
	LOG_USAGE = 2,  /* the command line */
};

enum log_format { LOG_TEXT, LOG_JSON };

/** `ecdaq log ...`: @argv[0] is "log". Output goes to stdout, failures as one line each to stderr.
 */
int log_main(int argc, char **argv);

/* The same as calls; failures are one line "ecdaq: log: what: why" to @err. */

/** A table of the recordings in @dir: start, duration, cycles, size, state. */
int log_list(const char *dir, enum log_format format, FILE *out, FILE *err);
/** Topics with their fields and counts, metadata, attachments of one file. */
int log_info(const char *path, enum log_format format, FILE *out, FILE *err);
/**
 * Read all of the files (or of the directories) at @paths: CRC of every chunk, and cycle numbers
 * without a gap inside of files and from one to the next. LOG_OK: clean.
 */
int log_check(const char *const *paths, size_t count, enum log_format format, FILE *out, FILE *err);
/** Mend @path in place, or copy what is whole to @output where that is not NULL. */
int log_recover(const char *path, const char *output, enum log_format format, FILE *out, FILE *err);

struct log_export_options {
	const char *const *paths;
	size_t path_count;
	const char *channels; /* names, separated by commas; NULL: all */
	uint64_t from;        /* cycles, both included */
	uint64_t to;
	int is_raw;             /* values as on the wire; else physical */
	enum log_format format; /* CSV, or a JSON object a line */
};

/** The samples of @options->paths as a table, a row a cycle. */
int log_export(const struct log_export_options *options, FILE *out, FILE *err);

#endif
