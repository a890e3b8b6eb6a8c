/* SPDX-License-Identifier: MIT */
#include "program/progress.h"

#include <inttypes.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "base/clock.h"
#include "base/host_clock.h"

/* The first picture comes after, and others every... */
#define FIRST_NS (NS_PER_S / 2)
#define PERIOD_NS (NS_PER_S / 5)
#define MIB (1024.0 * 1024.0)

static int is_always;
static struct {
	char what[64];
	char unit[16]; /* "": bytes */
	uint64_t total;
	int64_t start_ns;
	int64_t shown_ns; /* 0: not yet */
} work;

void progress_always(void)
{
	is_always = 1;
}

int progress_is_on(void)
{
	return is_always || isatty(STDERR_FILENO);
}

void progress_begin_of(const char *what, uint64_t total, const char *unit)
{
	const char *name = strrchr(what, '/');

	/* The folder is known, and the line must fit. */
	snprintf(work.what, sizeof(work.what), "%.32s", name == NULL ? what : name + 1);
	snprintf(work.unit, sizeof(work.unit), "%s", unit == NULL ? "" : unit);
	work.total = total;
	work.start_ns = host_clock_ns(CLOCK_MONOTONIC);
	work.shown_ns = 0;
}

void progress_begin(const char *what, uint64_t total_bytes)
{
	/* Of an empty file all is done. */
	progress_begin_of(what, total_bytes == 0 ? 1 : total_bytes, NULL);
}

/* "3.1 MiB", "12 KiB" below a tenth of that, "812 words". */
static void put_amount(double amount)
{
	if (work.unit[0] != '\0') {
		fprintf(stderr, "%.0f %s", amount, work.unit);
	} else if (amount < MIB / 10 && !is_always) {
		fprintf(stderr, "%.1f KiB", amount / 1024);
	} else {
		fprintf(stderr, "%.1f MiB", amount / MIB);
	}
}

static void show(uint64_t done, int64_t passed_ns)
{
	int is_terminal = isatty(STDERR_FILENO);
	double passed_s = (double)passed_ns / 1e9;
	double share = work.total == 0 ? 0 : (double)done / (double)work.total;
	double left_s = share > 0 ? passed_s * (1 / share - 1) : 0;

	fprintf(stderr, "%s%s: ", is_terminal ? "\r" : "", work.what);
	if (work.total != 0) {
		fprintf(stderr, "%3d %%  ", (int)(100 * share));
	} else {
		put_amount((double)done);
		fputs("  ", stderr);
	}
	put_amount((double)done / passed_s);
	fputs("/s", stderr);
	if (work.total != 0) {
		fprintf(stderr, "  %d:%02d left", (int)left_s / 60, (int)left_s % 60);
	}
	fputs(is_terminal ? "\033[K" : "\n", stderr);
	fflush(stderr);
}

void progress_at(uint64_t done)
{
	int64_t now_ns = host_clock_ns(CLOCK_MONOTONIC);

	done = work.total != 0 && done > work.total ? work.total : done;
	if (!progress_is_on() || now_ns - work.start_ns < (is_always ? 1 : FIRST_NS) ||
	    (work.shown_ns != 0 && now_ns - work.shown_ns < PERIOD_NS)) {
		return;
	}
	work.shown_ns = now_ns;
	show(done, now_ns - work.start_ns);
}

int progress_end(void)
{
	int was_shown = work.shown_ns != 0;

	if (was_shown && isatty(STDERR_FILENO)) {
		fputs("\r\033[K", stderr);
		fflush(stderr);
	}
	work.shown_ns = 0;
	return was_shown;
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
	fprintf(stderr, ", %.1f s\n",
		(double)(host_clock_ns(CLOCK_MONOTONIC) - start_mono_ns) / 1e9);
}
