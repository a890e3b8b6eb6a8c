/* SPDX-License-Identifier: MIT */
#include "cost/cost.h"

#include <stdio.h>
#include <stdlib.h>
#include <time.h>

/* Written behind a call, so that the compiler neither makes a jump of it, which callgrind would not
 * see return, nor one function of two. */
static volatile int counted;
static volatile int aside;
static long long cpu_ns;

/* A system call: callgrind counts some dozen instructions. */
static long long thread_cpu_ns(void)
{
	struct timespec now;

	clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
	return now.tv_sec * 1000000000LL + now.tv_nsec;
}

void cost_counted(void (*work)(void *ctx), void *ctx)
{
	cpu_ns -= thread_cpu_ns();
	work(ctx);
	counted = 1;
	cpu_ns += thread_cpu_ns();
}

void cost_aside(void (*work)(void *ctx), void *ctx)
{
	cpu_ns += thread_cpu_ns();
	work(ctx);
	aside = 1;
	cpu_ns -= thread_cpu_ns();
}

long long cost_cpu_ns(void)
{
	return cpu_ns;
}

unsigned cost_number(const char *text, unsigned most)
{
	char *end;
	unsigned long number = strtoul(text, &end, 10);

	if (end == text || *end != '\0' || number < 1 || number > most) {
		fprintf(stderr, "%s: not a number from 1 to %u\n", text, most);
		exit(2);
	}
	return (unsigned)number;
}
