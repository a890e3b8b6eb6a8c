/* SPDX-License-Identifier: MIT */
/*
 * Checks which commands may go to the board. Independent of DDS: the sender of a command is a
 * number that the transport guarantees. Context: any but the cycle.
 */
#ifndef PUBLISH_GATE_H
#define PUBLISH_GATE_H

#include <stddef.h>
#include <stdint.h>

#include "base/board.h"
#include "config/config.h"
#include "reader/table.h"

enum { GATE_COMMANDERS = 32, GATE_ITEMS = 64, GATE_NAME_BYTES = 64, GATE_REASON_BYTES = 200 };

struct gate_command {
	uint64_t sender; /* from the transport, not from the command's text */
	uint64_t id;
	uint64_t session;
	uint64_t not_after_cycle;
	int is_raw;
	uint32_t count; /* channels */
	uint32_t value_count;
	uint32_t raw_count;
	char *const *channel;
	const double *values;
	const uint64_t *raw;
};

/* State of the master now. */
struct gate_view {
	const struct channel_table *table; /* NULL: no master */
	int is_op;
	uint64_t cycle; /* newest */
	int64_t now_ns; /* CLOCK_MONOTONIC */
};

/* What a command was answered. */
struct gate_answer {
	int is_accepted;
	uint64_t cycle; /* whose frame carried it, if accepted */
	char reason[GATE_REASON_BYTES];
};

/* A checked value: index of the output channel (base/board.h) and its bits in the image. */
struct gate_item {
	unsigned output;
	uint64_t raw;
};

struct gate;

/** @cfg is kept by the caller. NULL with errno. */
struct gate *gate_create(const struct config *cfg);
void gate_destroy(struct gate *gate);

/**
 * Check @cmd. 0 and @ret_items (GATE_ITEMS, @cmd->count of them); or -errno with the reason in one
 * line in @reason (GATE_REASON_BYTES), @ret_items undefined: -EPERM not allowed, an input or not
 * owner, -EINVAL malformed, -ENOENT no such channel, -ERANGE value, -EALREADY repeated, -ESTALE
 * stale, -EAGAIN rate exceeded or bus not in OP, -EUSERS too many commanders.
 */
int gate_check(struct gate *gate, const struct gate_command *cmd, const struct gate_view *view,
	       struct gate_item *ret_items, char *reason);

/**
 * Note the answer to the last command of @sender that gate_check() has judged by its id; another
 * @id is ignored. The same command, repeated, is to be answered by it and not executed again: a
 * commander whose answer was lost cannot know what became of its command.
 */
void gate_note_answer(struct gate *gate, uint64_t sender, uint64_t id,
		      const struct gate_answer *answer);
/** The noted answer to this command; NULL: none. Valid until the next call for @gate. */
const struct gate_answer *gate_find_answer(struct gate *gate, uint64_t sender, uint64_t id);
/** Another run of the master: its cycles are not those of the answers. */
void gate_forget_answers(struct gate *gate);

/**
 * @sender is lost: it owns no outputs any more. Its ids are remembered (it may come back, and an
 * old command must not pass then) until its entry is needed for another commander.
 */
void gate_remove(struct gate *gate, uint64_t sender);

/** Who last set @output (0: nobody), and whether it goes fail-safe when that commander is lost. */
void gate_note_set(struct gate *gate, unsigned output, uint64_t sender);
uint64_t gate_setter(const struct gate *gate, unsigned output);
int gate_has_timeout(const struct channel_table *table, const struct config *cfg, unsigned output);

/** Longest liveliness lease a commander may have: half the shortest timeout of an output, 20 ms to
 * 1 s. */
int64_t gate_lease_ns(const struct config *cfg);

#endif
