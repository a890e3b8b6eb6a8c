/* SPDX-License-Identifier: MIT */
/* Between load.c, calls.c and run.c; not for others. */
#ifndef CONTROL_INTERNAL_H
#define CONTROL_INTERNAL_H

#include <stdatomic.h>

#include "base/limits.h"
#include "base/slave_set.h"
#include "control/arguments.h"
#include "control/control.h"
#include "control/guard.h"
#include "control/program.h"

enum { CONTROL_TEXT_BYTES = 256 };

/* An output as the program has set it. */
struct control_output {
	uint16_t channel;
	uint8_t is_own; /* its owner is the program */
	uint8_t is_set;
	uint64_t raw;
	double min; /* outputs[].min and max */
	double max;
};

struct control {
	const struct config *cfg;
	void *object; /* of dlopen() */
	const struct ecdaq_program *program;
	void *state;
	int is_guarded;
	int has_begun;
	struct control_spec spec;
	struct arguments arguments;
	char message[CONTROL_TEXT_BYTES];     /* of the program */
	char first_error[CONTROL_TEXT_BYTES]; /* of the first of our calls that failed */
	/* the cycle's */
	const uint8_t *image;
	struct ecdaq_cycle now;
	struct slave_set slaves_bad; /* what now.slaves_bad points to */
	int verdict;
	int has_called;      /* since the last pause */
	uint64_t last_cycle; /* of the last call */
	int64_t time_ns;     /* of the last call */
	uint64_t end_cycle;  /* in which it was stopped or crashed */
	enum control_state state_now;
	struct guard guard;
	_Atomic int64_t entered_ns;        /* [cycle] 0: outside */
	int16_t output_of[LIMIT_CHANNELS]; /* place on the board; -1: no output */
	struct control_output output[BOARD_OUTPUTS];
	size_t output_count;
	struct board board;
};

extern const struct ecdaq_calls control_calls;

#endif
