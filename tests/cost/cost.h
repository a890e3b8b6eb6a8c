/* SPDX-License-Identifier: MIT */
/*
 * What a piece of work costs in instructions, counted by callgrind:
 *
 *   valgrind --tool=callgrind --toggle-collect=cost_counted PROGRAM ARGUMENTS
 *
 * Only what runs inside cost_counted() is collected; counting.py subtracts what runs inside
 * cost_aside().
 */
#ifndef TESTS_COST_COST_H
#define TESTS_COST_COST_H

/** Call @work, counted. */
void cost_counted(void (*work)(void *ctx), void *ctx);
/** Call @work, not counted, from within what is. */
void cost_aside(void (*work)(void *ctx), void *ctx);

/** Processor time of this thread inside cost_counted() and outside cost_aside(), in ns: with many
 * cycles, without callgrind. */
long long cost_cpu_ns(void);

/** The argument @text as a number of 1 to @most; ends the program if it is none. */
unsigned cost_number(const char *text, unsigned most);

#endif
