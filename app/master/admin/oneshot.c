/* SPDX-License-Identifier: MIT */
/* The request to fire SYNC0 once, in one slave or in all that can, at one DC time. */
#include <errno.h>
#include <inttypes.h>
#include <string.h>

#include "admin/command_internal.h"

/* Of a slave with a one-shot mode: the DC time at which its SYNC0 shall fire (DESIGN 5). */
#define ONESHOT_ENTRY "oneshot_time"

static int find_oneshot(const struct admin_target *t, uint16_t slave_pos)
{
	for (size_t i = 0; i < t->channel_count; i++) {
		const struct channel *ch = &t->channels[i];
		const char *entry = strrchr(ch->name, '.');

		if (ch->slave_pos == slave_pos && ch->direction == CHANNEL_OUTPUT &&
		    entry != NULL && strcmp(entry + 1, ONESHOT_ENTRY) == 0) {
			return (int)i;
		}
	}
	return -ENOENT;
}

/* The absolute time asked for, if it can still be reached; else the refusal. */
static int oneshot_time(const struct admin_target *t, const struct admin_request *rq,
			int64_t *ret_time_ns, struct admin_reply *reply)
{
	int64_t margin_ns = ADMIN_ONESHOT_MARGIN_CYCLES * t->cfg->cycle_period_ns;
	int64_t now_ns;
	int64_t at_ns = rq->dc_time_ns;

	if (t->dc_now(t->ctx, &now_ns) < 0) {
		admin_reply_refuse(reply, -EAGAIN, "the DC time is not known yet");
		return reply->result;
	}
	if (rq->is_relative && __builtin_add_overflow(now_ns, rq->dc_time_ns, &at_ns)) {
		admin_reply_refuse(reply, -ERANGE, "the time is out of range");
		return reply->result;
	}
	if (at_ns <= now_ns) {
		admin_reply_refuse(reply, -ETIME,
				   "the time is in the past (DC time is %" PRId64 " ns)", now_ns);
		return reply->result;
	}
	if (at_ns - now_ns < margin_ns) {
		admin_reply_refuse(reply, -ETIME,
				   "only %" PRId64 " ns ahead, at least %" PRId64 " ns are needed",
				   at_ns - now_ns, margin_ns);
		return reply->result;
	}
	if (at_ns - now_ns > ADMIN_ONESHOT_AHEAD_NS) {
		admin_reply_refuse(reply, -ERANGE,
				   "%" PRId64 " s ahead, at most %" PRId64 " s are taken",
				   (at_ns - now_ns) / NS_PER_S, ADMIN_ONESHOT_AHEAD_NS / NS_PER_S);
		return reply->result;
	}
	*ret_time_ns = at_ns;
	return 0;
}

static int place_oneshot(const struct admin_target *t, uint16_t slave_pos, int64_t at_ns,
			 struct placed *ret_placed, struct admin_reply *reply)
{
	int channel = find_oneshot(t, slave_pos);
	int r;

	if (channel < 0) {
		admin_reply_refuse(reply, -EOPNOTSUPP, "%s: has no output " ONESHOT_ENTRY,
				   t->slaves[slave_pos].name);
		return reply->result;
	}
	if (!config_is_oneshot(t->cfg, slave_pos)) {
		admin_reply_refuse(reply, -EOPNOTSUPP,
				   "%s: is in periodic mode (slaves[%u].mode: oneshot)",
				   t->slaves[slave_pos].name, slave_pos);
		return reply->result;
	}
	r = command_check_output(t, (size_t)channel, (uint64_t)at_ns, reply);
	if (r < 0) {
		return r;
	}
	*ret_placed = (struct placed){
		.channel = (size_t)channel,
		.output = command_output_index(t, (size_t)channel),
		.raw = (uint64_t)at_ns,
	};
	return 0;
}

/* One slave, or all that have a one-shot output. Returns how many are placed, or the refusal. */
static int place_oneshots(const struct admin_target *t, const struct admin_request *rq,
			  struct placed *ret_placed, struct admin_reply *reply)
{
	int is_all = rq->slave_pos == ADMIN_ALL_SLAVES;
	int64_t at_ns = 0;
	int count = 0;

	if (!command_has_op(t, reply)) {
		return reply->result;
	}
	if (!is_all && rq->slave_pos >= t->slave_count) {
		admin_reply_refuse(reply, -ENODEV, "slave %u: there are %zu slaves", rq->slave_pos,
				   t->slave_count);
		return reply->result;
	}
	for (uint16_t pos = 0; pos < t->slave_count; pos++) {
		if (is_all ? find_oneshot(t, pos) < 0 : pos != rq->slave_pos) {
			continue;
		}
		/* The time last: what can never be armed is said first. */
		if (place_oneshot(t, pos, 0, &ret_placed[count], reply) < 0) {
			return reply->result;
		}
		count++;
	}
	if (count == 0) {
		admin_reply_refuse(reply, -EOPNOTSUPP, "no slave has an output " ONESHOT_ENTRY);
		return reply->result;
	}
	if (oneshot_time(t, rq, &at_ns, reply) < 0) {
		return reply->result;
	}
	for (int i = 0; i < count; i++) {
		ret_placed[i].raw = (uint64_t)at_ns;
		if (command_check_output(t, ret_placed[i].channel, (uint64_t)at_ns, reply) < 0) {
			return reply->result;
		}
	}
	reply->dc_time_ns = at_ns;
	return count;
}

enum admin_outcome command_oneshot(const struct admin_target *t, const struct admin_request *rq,
				   uint32_t uid, struct admin_reply *reply, uint64_t *ret_sequence)
{
	struct placed placed[LIMIT_SLAVES] = { { .channel = 0 } };
	int count = place_oneshots(t, rq, placed, reply);

	if (count < 0) {
		command_emit(t, EVENT_COMMAND_REFUSED, rq->slave_pos, -1, reply->result,
			     (int32_t)uid);
		return ADMIN_DONE;
	}
	*ret_sequence = command_put_all(t, placed, (size_t)count);
	command_emit(t, EVENT_COMMAND, rq->slave_pos, reply->dc_time_ns, ADMIN_ONESHOT,
		     (int32_t)uid);
	return ADMIN_DEFERRED;
}
