/* SPDX-License-Identifier: MIT */
/* The GPIO lines of the configuration, opened one by one: one that cannot be opened does not affect
 * the others, and is retried. Context: blocking. */
#ifndef SYNC0_GPIO_LINES_H
#define SYNC0_GPIO_LINES_H

#include <stddef.h>
#include <stdint.h>

#include "config/config.h"
#include "sync0/edge.h"

struct gpio_lines;

/** A line was opened (@why is NULL), cannot be opened, or was lost. */
typedef void (*gpio_lines_report)(void *ctx, size_t line, const char *why);

/** For the slaves of @cfg that have one. NULL with errno; ENOENT: none has. */
struct gpio_lines *gpio_lines_create(const struct config *cfg, const char *dev_dir);
void gpio_lines_destroy(struct gpio_lines *l);
size_t gpio_lines_count(const struct gpio_lines *l);
/** Of slaves[], from 0. */
uint16_t gpio_lines_item(const struct gpio_lines *l, size_t line);
const char *gpio_lines_text(const struct gpio_lines *l, size_t line);
int gpio_lines_is_open(const struct gpio_lines *l, size_t line);
/** Why it is not: the last error of gpio_open(), or -ENODEV: its chip is gone. */
int gpio_lines_error(const struct gpio_lines *l, size_t line);
int gpio_lines_is_hte(const struct gpio_lines *l, size_t line);
/** Open what is not open. Returns how many are. */
size_t gpio_lines_open(struct gpio_lines *l, gpio_lines_report report, void *ctx);
/** Wait at most @ms for an edge on any line. */
void gpio_lines_wait(const struct gpio_lines *l, int ms);
/** Pass every queued edge to @take. */
void gpio_lines_read(struct gpio_lines *l, void (*take)(void *ctx, const struct edge *edge),
		     gpio_lines_report report, void *ctx);

#endif
