/* SPDX-License-Identifier: MIT */
/* A program on two slaves' channels, with a clock that the test turns. */
#ifndef TESTS_UNIT_CONTROL_BENCH_H
#define TESTS_UNIT_CONTROL_BENCH_H

#include "control/program.h"
#include "harness/control_probe/probe.h"
#include "harness/test.h"

/* Image: outputs led (bit 0), out12 (12 bits signed from bit 8), f32; inputs adc, signed. */
enum { BENCH_IMAGE_BYTES = 16 };
enum bench_board { BOARD_LED, BOARD_OUT12, BOARD_FLOAT, BOARD_FOREIGN };

struct bench {
	struct config cfg;
	struct control_status status;
	struct control *control;
	int64_t now_ns;
	int64_t call_ns; /* what the next reading of the clock adds */
	uint8_t image[BENCH_IMAGE_BYTES];
	struct sample_header sample;
	char error[320];
};

extern struct bench bench;

/** Defaults, with the probe as program and led, out12 and f32 its own. */
struct probe *bench_configure(void);
/** control_load(), 0 or -errno with bench.error. */
int bench_load(void);
/** control_load() and control_begin(). */
int bench_begin(void);
/** The next cycle. */
enum control_result bench_run(void);
/** What the cycle would take: 1 and the value, 0: none. */
int bench_output(unsigned place, uint64_t *ret_raw);
void bench_done(void);

#endif
