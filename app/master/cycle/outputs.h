/* SPDX-License-Identifier: MIT */
/*
 * What goes out: for each output channel, the newest value its owner has put on its board, within
 * its limits; its fail-safe value while there is none, while the bus is not in OP, or when the
 * owner has been silent for too long. Context of outputs_choose(): cycle thread, RT-safe.
 */
#ifndef CYCLE_OUTPUTS_H
#define CYCLE_OUTPUTS_H

#include <stdatomic.h>
#include <stddef.h>
#include <stdint.h>

#include "base/board.h"
#include "base/sample.h"
#include "base/slave_set.h"
#include "config/config.h"
#include "cycle/cycle_spec.h"
#include "image/field.h"

struct output {
	const struct channel *channel;
	struct image_field field;
	uint16_t slave_pos;
	enum cycle_writer owner;
};

/* What outputs[] says of an output, but for its owner. */
struct output_rules {
	uint64_t fail_safe_raw;
	double min; /* physical; infinite: no limit */
	double max;
	uint64_t min_raw;
	uint64_t max_raw;
	int has_limits;          /* or values that are not numbers */
	uint64_t timeout_cycles; /* by cycle number: skipped cycles count; 0: none */
};

/*
 * The rules come from the service thread without a lock, as the set of live slaves does
 * (cycle_internal.h): each side owns one of three, and takes the spare one for its own in one
 * atomic step.
 */
#define OUTPUTS_RULES_NEW 4u /* added to the spare's index: not taken yet */

struct outputs_rules {
	struct output_rules of[3][BOARD_OUTPUTS];
	unsigned filled;        /* [service] index of those to be filled next */
	unsigned taken;         /* [cycle] index of those in force */
	_Atomic unsigned spare; /* [any] */
};

/* What outputs_choose() chose by, and chose. It is right until one of these changes, a board has a
 * new set, a timeout ends, or an owner that was silent gives a sign of life. */
struct outputs_choice {
	const struct output_rules *in_force; /* NULL: nothing was chosen yet */
	struct slave_set live;
	uint64_t next_timeout; /* the first cycle in which one more owner may be silent */
	int is_any_silent;
	unsigned timed_out;
};

struct outputs {
	struct board *board[CYCLE_WRITERS];
	struct board_set set[CYCLE_WRITERS];
	uint64_t answered[CYCLE_WRITERS]; /* sequence of the last set that was answered */
	uint64_t beat[CYCLE_WRITERS];
	uint64_t alive_cycle[CYCLE_WRITERS]; /* the last with a sign of life of the writer */
	struct output output[BOARD_OUTPUTS];
	struct outputs_rules rules;
	struct outputs_choice choice;
	uint8_t is_live[BOARD_OUTPUTS]; /* the image last written carries its owner's value */
	size_t output_count;
	unsigned set_words; /* of a set of slaves: those of slaves with outputs */
};

/** 0, or -EINVAL / -E2BIG with one line in @error. Context: blocking. */
int outputs_init(struct outputs *outputs, const struct cycle_spec *spec, char *error,
		 size_t error_bytes);

/**
 * Fail-safe values, limits and timeouts of @cfg from the next cycle on; the owners stay. 0, or
 * -EINVAL with one line in @error: nothing has changed. Context: service thread.
 */
int outputs_rules_set(struct outputs *outputs, const struct config *cfg, char *error,
		      size_t error_bytes);

/**
 * Write all outputs into @image, which is the same in every call and which nobody else changes, so
 * that what is there already is not written again: live for slaves in @live, fail-safe for all
 * others, for a value that is not a number, and for an owner that has been silent for longer than
 * its timeout at
 * @cycle. Returns how many are fail-safe because of the latter.
 */
unsigned outputs_choose(struct outputs *outputs, uint8_t *image, const struct slave_set *live,
			uint64_t cycle);

/** 1 if a board has a set that is not answered: outputs_arrived() has to be called. */
int outputs_are_due(const struct outputs *outputs);

/**
 * The image last written reached the slaves of @arrived with the frame of @cycle. Answers the
 * boards whose newest set is in effect with that: every value that it has put or withdrawn.
 */
void outputs_arrived(struct outputs *outputs, const struct slave_set *arrived, uint64_t cycle);

#endif
