/* SPDX-License-Identifier: MIT */
#include "sync0/calibrate_live.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "base/clock.h"
#include "base/host_clock.h"
#include "sync0/calibration.h"
#include "sync0/gpio_lines.h"
#include "sync0/print.h"

enum { EDGES = 10000, WAIT_MS = 100, WHY_BYTES = 512 };

/* Silence for so long, with too few edges, ends it. */
#define SILENCE_NS (5 * NS_PER_S)

struct listening {
	struct gpio_lines *lines;
	int64_t *at_ns[2];
	size_t count[2];
	char reason[256]; /* why a line cannot be opened */
};

static void on_line(void *ctx, size_t line, const char *why)
{
	struct listening *ls = ctx;

	if (why != NULL && line < 2 && ls->reason[0] == '\0') {
		snprintf(ls->reason, sizeof(ls->reason), "line '%.90s' of slave %u: %.120s",
			 gpio_lines_text(ls->lines, line), gpio_lines_item(ls->lines, line), why);
	}
}

static void take_edge(void *ctx, const struct edge *edge)
{
	struct listening *ls = ctx;

	if (edge->line < 2 && ls->count[edge->line] < EDGES) {
		ls->at_ns[edge->line][ls->count[edge->line]++] = edge->mono_ns;
	}
}

static void collect(struct listening *ls, const volatile sig_atomic_t *has_stopped)
{
	int64_t heard_ns = host_clock_ns(CLOCK_MONOTONIC);

	while (!*has_stopped && (ls->count[0] < EDGES || ls->count[1] < EDGES) &&
	       host_clock_ns(CLOCK_MONOTONIC) - heard_ns < SILENCE_NS) {
		size_t before = ls->count[0] + ls->count[1];

		gpio_lines_wait(ls->lines, WAIT_MS);
		gpio_lines_read(ls->lines, take_edge, on_line, ls);
		if (ls->count[0] + ls->count[1] > before) {
			heard_ns = host_clock_ns(CLOCK_MONOTONIC);
		}
	}
}

static int compute(struct listening *ls, const struct config *cfg, FILE *out, char *why)
{
	struct calibration c;
	int r = calibration_compute(ls->at_ns[0], ls->count[0], ls->at_ns[1], ls->count[1], &c,
				    why);

	if (r < 0) {
		return r;
	}
	snprintf(c.first, sizeof(c.first), "%.95s", gpio_lines_text(ls->lines, 0));
	snprintf(c.second, sizeof(c.second), "%.95s", gpio_lines_text(ls->lines, 1));
	print_calibration(&c, out);
	r = calibration_save(cfg->sync0_calibration, &c, ls->reason);
	if (r < 0) {
		snprintf(why, WHY_BYTES, "%.200s: %.200s", cfg->sync0_calibration, ls->reason);
	}
	return r;
}

static int listen_to(struct listening *ls, const struct config *cfg,
		     const volatile sig_atomic_t *has_stopped, FILE *out, char *why)
{
	if (gpio_lines_count(ls->lines) < 2) {
		snprintf(why, WHY_BYTES,
			 "calibration requires the same signal on two lines: set "
			 "slaves[].sync0_line of two slaves");
		return -EINVAL;
	}
	gpio_lines_open(ls->lines, on_line, ls);
	if (!gpio_lines_is_open(ls->lines, 0) || !gpio_lines_is_open(ls->lines, 1)) {
		snprintf(why, WHY_BYTES, "%s", ls->reason);
		return gpio_lines_error(ls->lines, gpio_lines_is_open(ls->lines, 0) ? 1 : 0);
	}
	collect(ls, has_stopped);
	if (*has_stopped) {
		snprintf(why, WHY_BYTES, "stopped after %zu and %zu of %d edges: nothing is stored",
			 ls->count[0], ls->count[1], EDGES);
		return -EINTR;
	}
	return compute(ls, cfg, out, why);
}

int calibrate_live(const struct config *cfg, const char *dev_dir,
		   const volatile sig_atomic_t *has_stopped, FILE *out, char *why)
{
	struct listening ls = { .lines = gpio_lines_create(cfg, dev_dir) };
	int r;

	ls.at_ns[0] = calloc(EDGES, sizeof(int64_t));
	ls.at_ns[1] = calloc(EDGES, sizeof(int64_t));
	if (ls.lines == NULL) {
		snprintf(why, WHY_BYTES, "no slave has a line: set slaves[].sync0_line");
		r = -ENOENT;
	} else if (ls.at_ns[0] == NULL || ls.at_ns[1] == NULL) {
		snprintf(why, WHY_BYTES, "%s", strerror(ENOMEM));
		r = -ENOMEM;
	} else {
		r = listen_to(&ls, cfg, has_stopped, out, why);
	}
	free(ls.at_ns[0]);
	free(ls.at_ns[1]);
	gpio_lines_destroy(ls.lines);
	return r;
}
