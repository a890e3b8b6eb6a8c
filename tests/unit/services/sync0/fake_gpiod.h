/* SPDX-License-Identifier: MIT */
/* A libgpiod of our own under sync0/gpio.c: one chip of the tests' making, with its ways to refuse.
 */
#ifndef TESTS_UNIT_SYNC0_FAKE_GPIOD_H
#define TESTS_UNIT_SYNC0_FAKE_GPIOD_H

#include <stdint.h>

struct fake_gpiod {
	int open_error;    /* errno of gpiod_chip_open(); 0: it works */
	int request_error; /* of every request */
	int has_hte;
	const char *label;
	const char *name_of_5; /* of line 5 of every chip */
	unsigned lines;
	const char *consumer;
	int read_error;
	/* what was asked for */
	unsigned asked_buffer;
	int asked_clock;
	int asked_edge;
	unsigned long asked_debounce_us;
	unsigned asked_offset;
	int live; /* objects not freed */
};

extern struct fake_gpiod fake_gpiod;

/** As after power-on: one label, 54 lines, no hardware timestamps. */
void fake_gpiod_reset(void);
/** An edge of the requested line. */
void fake_gpiod_edge(uint64_t at_ns, unsigned long seqno);
/** The chip is pulled out: poll() says so. */
void fake_gpiod_unplug(void);

#endif
