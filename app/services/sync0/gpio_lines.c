/* SPDX-License-Identifier: MIT */
#include "sync0/gpio_lines.h"

#include <errno.h>
#include <poll.h>
#include <stdlib.h>
#include <string.h>

#include "base/limits.h"
#include "sync0/gpio.h"

enum { EDGES = 256 };

struct one_line {
	struct gpio *gpio; /* NULL: not open */
	uint16_t item;     /* of slaves[] */
	const char *text;
	int error;
	char reason[GPIO_WHY_BYTES];
};

struct gpio_lines {
	const struct config *cfg;
	const char *dev_dir;
	struct one_line line[LIMIT_SYNC0_LINES];
	size_t count;
};

struct gpio_lines *gpio_lines_create(const struct config *cfg, const char *dev_dir)
{
	struct gpio_lines *l = calloc(1, sizeof(*l));

	if (l == NULL) {
		return NULL;
	}
	l->cfg = cfg;
	l->dev_dir = dev_dir;
	for (size_t i = 0; i < cfg->slave_count; i++) {
		if (cfg->slave[i].sync0_line[0] != '\0' && l->count < LIMIT_SYNC0_LINES) {
			l->line[l->count++] = (struct one_line){ .item = (uint16_t)i,
								 .text = cfg->slave[i].sync0_line };
		}
	}
	if (l->count == 0) {
		free(l);
		errno = ENOENT;
		return NULL;
	}
	return l;
}

void gpio_lines_destroy(struct gpio_lines *l)
{
	if (l == NULL) {
		return;
	}
	for (size_t i = 0; i < l->count; i++) {
		gpio_close(l->line[i].gpio);
	}
	free(l);
}

size_t gpio_lines_count(const struct gpio_lines *l)
{
	return l->count;
}

uint16_t gpio_lines_item(const struct gpio_lines *l, size_t line)
{
	return l->line[line].item;
}

const char *gpio_lines_text(const struct gpio_lines *l, size_t line)
{
	return l->line[line].text;
}

int gpio_lines_is_open(const struct gpio_lines *l, size_t line)
{
	return l->line[line].gpio != NULL;
}

int gpio_lines_error(const struct gpio_lines *l, size_t line)
{
	return l->line[line].error;
}

int gpio_lines_is_hte(const struct gpio_lines *l, size_t line)
{
	return l->line[line].gpio != NULL && gpio_is_hte(l->line[line].gpio);
}

/* The same reason is reported once. */
static void report_once(struct gpio_lines *l, size_t number, const char *why,
			gpio_lines_report report, void *ctx)
{
	struct one_line *ol = &l->line[number];

	if (strcmp(ol->reason, why) != 0) {
		memcpy(ol->reason, why, strlen(why) + 1);
		report(ctx, number, why);
	}
}

size_t gpio_lines_open(struct gpio_lines *l, gpio_lines_report report, void *ctx)
{
	size_t open = 0;

	for (size_t i = 0; i < l->count; i++) {
		struct one_line *ol = &l->line[i];
		const struct gpio_spec spec = {
			.line = ol->text,
			.dev_dir = l->dev_dir,
			.buffer = l->cfg->sync0_buffer,
			.clock = l->cfg->sync0_clock,
		};
		char why[GPIO_WHY_BYTES] = "";

		if (ol->gpio != NULL) {
			open++;
			continue;
		}
		ol->error = gpio_open(&spec, &ol->gpio, why);
		if (ol->error < 0) {
			ol->gpio = NULL;
			report_once(l, i, why, report, ctx);
			continue;
		}
		ol->reason[0] = '\0';
		open++;
		report(ctx, i, NULL);
	}
	return open;
}

void gpio_lines_wait(const struct gpio_lines *l, int ms)
{
	struct pollfd fds[LIMIT_SYNC0_LINES];
	nfds_t n = 0;

	for (size_t i = 0; i < l->count; i++) {
		if (l->line[i].gpio != NULL) {
			fds[n++] =
				(struct pollfd){ .fd = gpio_fd(l->line[i].gpio), .events = POLLIN };
		}
	}
	poll(fds, n, ms);
}

static int read_line(struct gpio_lines *l, size_t number,
		     void (*take)(void *ctx, const struct edge *edge), void *ctx)
{
	struct edge edges[EDGES];
	int n;

	do {
		n = gpio_read(l->line[number].gpio, edges, EDGES);
		for (int i = 0; i < n; i++) {
			edges[i].line = (uint16_t)number;
			take(ctx, &edges[i]);
		}
	} while (n == EDGES);
	return n;
}

void gpio_lines_read(struct gpio_lines *l, void (*take)(void *ctx, const struct edge *edge),
		     gpio_lines_report report, void *ctx)
{
	for (size_t i = 0; i < l->count; i++) {
		if (l->line[i].gpio != NULL && read_line(l, i, take, ctx) < 0) {
			gpio_close(l->line[i].gpio);
			l->line[i].gpio = NULL;
			l->line[i].error = -ENODEV;
			report_once(l, i, "its chip is gone", report, ctx);
		}
	}
}
