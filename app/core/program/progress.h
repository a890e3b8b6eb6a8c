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
/** The same, counted in @unit, "words"; NULL: bytes. @total 0: not known. */
void progress_begin_of(const char *what, uint64_t total, const char *unit);
void progress_at(uint64_t done);
/** The line is cleared. 1: there was one. */
int progress_end(void);

/** A line about work that is done, where progress is shown; ns since @start_mono_ns (of
 * CLOCK_MONOTONIC) are put behind it. */
void progress_done(int64_t start_mono_ns, const char *format, ...)
	__attribute__((format(printf, 2, 3)));
#endif
