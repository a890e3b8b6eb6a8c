/* SPDX-License-Identifier: MIT */
#include "program/progress.h"

#include <inttypes.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "base/clock.h"

/* The first picture comes after, and others every... */
#define FIRST_NS (NS_PER_S / 2)
#define PERIOD_NS (NS_PER_S / 5)
#define MIB (1024.0 * 1024.0)

static int is_always;
static struct {
	char what[64];
	uint64_t total;
	int64_t start_ns;
	int64_t shown_ns; /* 0: not yet */
} work;

int64_t progress_now_ns(void)
{
	struct timespec ts;

	clock_gettime(CLOCK_MONOTONIC, &ts);
	return (int64_t)ts.tv_sec * NS_PER_S + ts.tv_nsec;
}

void progress_always(void)
{
	is_always = 1;
}

int progress_is_on(void)
{
	return is_always || isatty(STDERR_FILENO);
}

void progress_begin(const char *what, uint64_t total_bytes)
{
	const char *name = strrchr(what, '/');

	/* The folder is known, and the line must fit. */
	snprintf(work.what, sizeof(work.what), "%.32s", name == NULL ? what : name + 1);
	work.total = total_bytes;
	work.start_ns = progress_now_ns();
	work.shown_ns = 0;
}

static void show(uint64_t bytes, int64_t passed_ns)
{
	double share = work.total == 0 ? 1 : (double)bytes / (double)work.total;
	double left_s = bytes == 0 ? 0 : (double)passed_ns / 1e9 * (1 / share - 1);
	int is_terminal = isatty(STDERR_FILENO);

	fprintf(stderr, "%s%s: %3d %%  %.1f MiB/s  %d:%02d left%s", is_terminal ? "\r" : "",
		work.what, (int)(100 * share), (double)bytes / MIB / ((double)passed_ns / 1e9),
		(int)left_s / 60, (int)left_s % 60, is_terminal ? "\033[K" : "\n");
	fflush(stderr);
}

void progress_at(uint64_t bytes)
{
	int64_t now_ns = progress_now_ns();

	bytes = bytes > work.total ? work.total : bytes;
	if (!progress_is_on() || now_ns - work.start_ns < (is_always ? 1 : FIRST_NS) ||
	    (work.shown_ns != 0 && now_ns - work.shown_ns < PERIOD_NS)) {
		return;
	}
	work.shown_ns = now_ns;
	show(bytes, now_ns - work.start_ns);
}

void progress_end(void)
{
	if (work.shown_ns != 0 && isatty(STDERR_FILENO)) {
		fputs("\r\033[K", stderr);
		fflush(stderr);
	}
	work.shown_ns = 0;
}

void progress_done(int64_t start_mono_ns, const char *format, ...)
{
	va_list args;

	if (!progress_is_on()) {
		return;
	}
	va_start(args, format);
	vfprintf(stderr, format, args);
	va_end(args);
	fprintf(stderr, ", %.1f s\n", (double)(progress_now_ns() - start_mono_ns) / 1e9);
}
