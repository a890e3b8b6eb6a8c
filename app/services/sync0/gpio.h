/* SPDX-License-Identifier: MIT */
/*
 * One GPIO line that SYNC0 is wired to, through libgpiod 2: rising edges only (the line is masked
 * until its interrupt thread has run, so a falling edge 50 us later cannot be timed), no debounce,
 * a large queue, times of the hardware timestamp engine where there is one, else CLOCK_MONOTONIC
 * read in the hard interrupt. Context: blocking.
 */
#ifndef SYNC0_GPIO_H
#define SYNC0_GPIO_H

#include <stddef.h>
#include <stdint.h>

#include "config/config.h"
#include "sync0/edge.h"

enum { GPIO_WHY_BYTES = 256 };

struct gpio_spec {
	const char *line;    /* "GPIO17", or "pinctrl-bcm2711:17" */
	const char *dev_dir; /* "/dev" */
	uint32_t buffer;     /* events */
	enum config_edge_clock clock;
};

struct gpio;

/**
 * Find and request the line. 0; or -errno with one line of reason in @why (GPIO_WHY_BYTES):
 * -ENOENT no such chip or name, -ERANGE no such line, -EBUSY in use, -EACCES no permission,
 * -ENOTUNIQ two lines of this name. Free with gpio_close().
 */
int gpio_open(const struct gpio_spec *spec, struct gpio **ret_gpio, char *why);
void gpio_close(struct gpio *gpio);
/** For poll(): readable when edges wait. */
int gpio_fd(const struct gpio *gpio);
/** 1 if the times are those of the hardware timestamp engine. */
int gpio_is_hte(const struct gpio *gpio);
/**
 * Take up to @limit edges that wait; their line is left 0. Returns how many, or -errno: the chip
 * is gone. Never waits.
 */
int gpio_read(struct gpio *gpio, struct edge *edges, size_t limit);

#endif
