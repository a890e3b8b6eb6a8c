/* SPDX-License-Identifier: MIT */
/* Between the files of the admin commands; not for others. Context: service thread. */
#ifndef ADMIN_COMMAND_INTERNAL_H
#define ADMIN_COMMAND_INTERNAL_H

#include "admin/command.h"

/* One item of a set, resolved. */
struct placed {
	size_t channel;
	unsigned output; /* its place on the board */
	uint64_t raw;
};

void command_emit(const struct admin_target *t, enum event_id id, uint16_t slave_pos, int64_t value,
		  int32_t arg0, int32_t arg1);
/** 1; 0 and the refusal in @reply while the bus is not in OP. */
int command_has_op(const struct admin_target *t, struct admin_reply *reply);
/** 0, or the refusal: @channel is no output, not ours, or @raw is outside its limits. */
int command_check_output(const struct admin_target *t, size_t channel, uint64_t raw,
			 struct admin_reply *reply);
/** The channel's place on the board: the n-th output of the channel table (base/board.h). */
unsigned command_output_index(const struct admin_target *t, size_t channel);
/** All values as one set. Returns its sequence. */
uint64_t command_put_all(const struct admin_target *t, const struct placed *placed, size_t count);

/** ADMIN_ONESHOT (oneshot.c). */
enum admin_outcome command_oneshot(const struct admin_target *t, const struct admin_request *rq,
				   uint32_t uid, struct admin_reply *reply, uint64_t *ret_sequence);

#endif
