/* SPDX-License-Identifier: MIT */
/*
 * How far long work is: per cent, rate and time left on standard error, if that is a terminal or
 * with progress_always(). Nothing of work that takes less than half a second, unless it was
 * requested. One work at a time. Context: main thread, blocking.
 */
#ifndef PROGRAM_PROGRESS_H
#define PROGRAM_PROGRESS_H

#include <stdint.h>

/** --progress: also where standard error is no terminal, a line at a time. */
void progress_always(void);
/** Is it shown? */
int progress_is_on(void);

/** @what (copied) has @total_bytes. */
void progress_begin(const char *what, uint64_t total_bytes);
void progress_at(uint64_t bytes);
/** The line is cleared. */
void progress_end(void);

/** A line about work that is done, where progress is shown; ns since @start_mono_ns are put behind
 * it. */
void progress_done(int64_t start_mono_ns, const char *format, ...)
	__attribute__((format(printf, 2, 3)));
/** CLOCK_MONOTONIC. */
int64_t progress_now_ns(void);

#endif
