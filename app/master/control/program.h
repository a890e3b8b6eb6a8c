/* SPDX-License-Identifier: MIT */
/*
 * The other side of control.h: load the user's program, resolve its channels, call it once a cycle,
 * and put its outputs on a command board, from which the cycle takes its outputs like those of any
 * other writer. Timeouts, failures and crashes are described in app/doc/reference/control.md and
 * ADR 0033.
 */
#ifndef CONTROL_PROGRAM_H
#define CONTROL_PROGRAM_H

#include <stddef.h>
#include <stdint.h>

#include "base/board.h"
#include "base/platform.h"
#include "base/sample.h"
#include "base/status.h"
#include "config/config.h"

struct control;

/**
 * Load @cfg->control_program: the file, its symbol, its ABI. 0, or -errno with one line in @error.
 * Free with control_destroy(). Context: blocking.
 */
int control_load(const struct config *cfg, struct control **ret_control, char *error,
		 size_t error_bytes);

/* What the program works on; all of it outlives the program. */
struct control_spec {
	struct platform platform;
	const struct channel *channels;
	size_t channel_count;
	size_t slave_count;
	struct control_status *status;
};

/** Call its init(). 0, or -errno with one line in @error. Context: blocking, once. */
int control_begin(struct control *control, const struct control_spec *spec, char *error,
		  size_t error_bytes);

/** Call its exit() if it has begun and not crashed, and unload it. NULL is fine. Context: blocking,
 * not while a cycle runs. */
void control_destroy(struct control *control);

/** Where the cycle takes the program's outputs from. */
struct board *control_board(struct control *control);

/**
 * The calling thread is the one that will run the program: gives it a signal stack and unblocks the
 * signals of a crash. control_leave() restores both. Context: cycle thread.
 */
void control_enter(struct control *control);
void control_leave(struct control *control);

enum control_result {
	CONTROL_DONE,
	CONTROL_OVERRAN, /* and control.overrun is count */
	CONTROL_PARK,    /* and it is fail_safe: not called until the bus reaches OP again */
	CONTROL_STOP,    /* and it is stop: not called again */
	CONTROL_CRASH,   /* not called again: end the process as soon as the outputs are safe */
	CONTROL_REST,    /* not called: it is parked, stopped or has crashed */
};

/** One cycle: @image holds its inputs, @sample what is known of them. RT-safe, if the program is.
 */
enum control_result control_run(struct control *control, const struct sample_header *sample,
				const uint8_t *image);
/** A cycle in which outputs are not live: the next call has ECDAQ_FIRST. RT-safe. */
void control_pause(struct control *control);

/** 1 if the program's outputs hold their fail-safe values although the bus is in OP. RT-safe. */
int control_is_safe(const struct control *control);
/** How long the last call took. RT-safe. */
int64_t control_time_ns(const struct control *control);

/* How it crashed. */
struct control_crash {
	int number; /* of the signal */
	uintptr_t address;
	uint64_t cycle;
};

/** 0, or -ENODATA: it has not. Context: any, after the cycle has ended. */
int control_crash(const struct control *control, struct control_crash *ret_crash);
/** Why the cycle was stopped by the program, one line with its name; "" if it was not. Context:
 * any, after the cycle has ended. */
void control_describe_end(const struct control *control, char *text, size_t text_bytes);

/** How long it has been inside cycle() at @now; 0: it is not. Context: any. */
int64_t control_busy_ns(const struct control *control, mono_t now);
/** Its name, as it calls itself; the file's path. */
const char *control_name(const struct control *control);

#endif
