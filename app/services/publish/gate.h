/* SPDX-License-Identifier: MIT */
/*
 * Which commands may pass to the board. Knows nothing of DDS: who sent a command is a number that
 * the transport vouches for. Context: any but the cycle.
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
	uint64_t sender; /* of the transport, not of the command's text */
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

/* How the master is at this moment. */
struct gate_view {
	const struct channel_table *table; /* NULL: no master */
	int is_op;
	uint64_t cycle; /* newest */
	int64_t now_ns; /* CLOCK_MONOTONIC */
};

/* A value on its way: the n-th output channel (base/board.h) and what goes into the image. */
struct gate_item {
	unsigned output;
	uint64_t raw;
};

struct gate;

/** @cfg is kept by the caller. NULL with errno. */
struct gate *gate_create(const struct config *cfg);
void gate_destroy(struct gate *gate);

/**
 * May @cmd pass? 0 and @ret_items (GATE_ITEMS, @cmd->count of them); or -errno with the reason in
 * one line, @ret_items then being of no use: -EPERM not allowed or not owner, -EINVAL malformed,
 * -ENOENT no such output, -ERANGE value, -EALREADY doubled, -ESTALE stale, -EAGAIN too often or bus
 * not in OP, -EUSERS too many commanders.
 */
int gate_check(struct gate *gate, const struct gate_command *cmd, const struct gate_view *view,
	       struct gate_item *ret_items, char *reason);

/**
 * @sender is not heard of: it owns nothing any more. Its ids are remembered (it may be heard of
 * again, and an old command must not pass then) until its place is needed for another.
 */
void gate_remove(struct gate *gate, uint64_t sender);

/** Who last set @output (0: nobody), and whether a lost owner leaves it fail-safe (has a time-out).
 */
void gate_note_set(struct gate *gate, unsigned output, uint64_t sender);
uint64_t gate_setter(const struct gate *gate, unsigned output);
int gate_has_timeout(const struct channel_table *table, const struct config *cfg, unsigned output);

/** Longest liveliness lease a commander may have: half the shortest time-out, 20 ms to 1 s. */
int64_t gate_lease_ns(const struct config *cfg);

#endif
