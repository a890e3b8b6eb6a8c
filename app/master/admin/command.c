/* SPDX-License-Identifier: MIT */
#include "admin/command.h"

#include <errno.h>
#include <inttypes.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include "config/output.h"
#include "image/entry.h"
#include "image/image.h"

/* One item of a set, resolved. */
struct placed {
	size_t channel;
	unsigned output; /* its place on the board */
	uint64_t raw;
};

static void refuse(struct admin_reply *reply, int result, const char *format, ...)
	__attribute__((format(printf, 3, 4)));

static void refuse(struct admin_reply *reply, int result, const char *format, ...)
{
	va_list args;

	reply->result = result;
	va_start(args, format);
	vsnprintf(reply->text, sizeof(reply->text), format, args);
	va_end(args);
}

static void emit(const struct admin_target *t, enum event_id id, uint16_t slave_pos, int64_t value,
		 int32_t arg0, int32_t arg1)
{
	struct event ev = {
		.id = (uint16_t)id,
		.slave_pos = slave_pos,
		.value = value,
		.arg = { arg0, arg1 },
	};

	t->emit(t->ctx, &ev);
}

static int has_op(const struct admin_target *t, struct admin_reply *reply)
{
	if (t->board == NULL || !t->is_op) {
		refuse(reply, -EAGAIN, "the bus is not in OP");
		return 0;
	}
	return 1;
}

/* May the local writer put @raw on @channel? 0, or the refusal in @reply. */
static int check_output(const struct admin_target *t, size_t channel, uint64_t raw,
			struct admin_reply *reply)
{
	reply->result = config_output_check(t->cfg, &t->channels[channel], CONFIG_OWNER_LOCAL, raw,
					    reply->text, sizeof(reply->text));
	return reply->result;
}

static int place_item(const struct admin_target *t, const struct admin_item *item,
		      struct placed *ret_placed, struct admin_reply *reply)
{
	int channel = image_channel_find(t->channels, t->channel_count, item->channel);
	int r;

	if (channel < 0) {
		refuse(reply, -ENOENT, "%s: no such channel", item->channel);
		return reply->result;
	}
	r = check_output(t, (size_t)channel, item->raw, reply);
	if (r < 0) {
		return r;
	}
	*ret_placed = (struct placed){
		.channel = (size_t)channel,
		.output = config_output_index(t->channels, (size_t)channel),
		.raw = item->raw,
	};
	return 0;
}

static uint64_t put_all(const struct admin_target *t, const struct placed *placed, size_t count)
{
	board_begin(t->board);
	for (size_t i = 0; i < count; i++) {
		board_put(t->board, placed[i].output, placed[i].raw);
	}
	return board_commit(t->board);
}

/* Each pass: have the values taken effect? */
static void poll_board(struct admin_pending *pending, const struct admin_target *t)
{
	/* Sequences only grow: a newer set in effect holds the values of this one, too. */
	if (t->board == NULL) {
		admin_pending_refuse(pending, -ECANCELED, "the cycle has ended");
	} else if (atomic_load_explicit(&t->board->taken_sequence, memory_order_acquire) >=
		   pending->sequence) {
		pending->reply.cycle =
			atomic_load_explicit(&t->board->taken_cycle, memory_order_relaxed);
		admin_pending_complete(pending, 0);
	}
}

/* Nobody was told that the values are in effect: they must not get so later. */
static void withdraw(struct admin_pending *pending)
{
	struct board *board = pending->work;

	if (atomic_load_explicit(&board->taken_sequence, memory_order_acquire) <
	    pending->sequence) {
		board_withdraw(board, pending->sequence);
	}
	admin_pending_complete(pending, -ECANCELED);
}

static void wait_for_cycle(const struct admin_target *t, struct admin_pending *pending,
			   const struct placed *placed, size_t count)
{
	pending->sequence = put_all(t, placed, count);
	pending->poll = poll_board;
	pending->cancel = withdraw;
	pending->work = t->board;
}

static void run_set(const struct admin_target *t, struct admin_pending *pending)
{
	struct placed placed[ADMIN_ITEMS] = { { .channel = 0 } };
	const struct admin_request *rq = &pending->request;
	struct admin_reply *reply = &pending->reply;
	int32_t uid = (int32_t)pending->uid;

	if (!has_op(t, reply)) {
		emit(t, EVENT_COMMAND_REFUSED, EVENT_NO_SLAVE, -1, reply->result, uid);
		admin_pending_complete(pending, reply->result);
		return;
	}
	/* All or nothing: the board is touched when every item has been found good. */
	for (size_t i = 0; i < rq->count; i++) {
		if (place_item(t, &rq->item[i], &placed[i], reply) < 0) {
			int channel = image_channel_find(t->channels, t->channel_count,
							 rq->item[i].channel);

			emit(t, EVENT_COMMAND_REFUSED, EVENT_NO_SLAVE, channel < 0 ? -1 : channel,
			     reply->result, uid);
			admin_pending_complete(pending, reply->result);
			return;
		}
	}
	wait_for_cycle(t, pending, placed, rq->count);
	for (size_t i = 0; i < rq->count; i++) {
		emit(t, EVENT_OUTPUT_SET, t->channels[placed[i].channel].slave_pos,
		     (int64_t)placed[i].channel, 0, uid);
	}
}

/* --- one-shot: fire SYNC0 once, in one slave or in all that can, at one DC time --- */

/* Of a slave with a one-shot mode: the DC time at which its SYNC0 is to fire. */
#define ONESHOT_ENTRY "oneshot_time"

static int find_oneshot(const struct admin_target *t, uint16_t slave_pos)
{
	for (size_t i = 0; i < t->channel_count; i++) {
		const struct channel *ch = &t->channels[i];

		if (ch->slave_pos == slave_pos && ch->direction == CHANNEL_OUTPUT &&
		    channel_is_entry(&t->slaves[slave_pos], ch, ONESHOT_ENTRY)) {
			return (int)i;
		}
	}
	return -ENOENT;
}

/* The requested absolute time, if it can still be reached; else the refusal. */
static int oneshot_time(const struct admin_target *t, const struct admin_request *rq,
			int64_t *ret_time_ns, struct admin_reply *reply)
{
	int64_t margin_ns = ADMIN_ONESHOT_MARGIN_CYCLES * t->cfg->cycle_period_ns;
	int64_t now_ns;
	int64_t at_ns = rq->dc_time_ns;

	if (t->dc_now(t->ctx, &now_ns) < 0) {
		refuse(reply, -EAGAIN, "the DC time is not known yet");
		return reply->result;
	}
	if (rq->is_relative && __builtin_add_overflow(now_ns, rq->dc_time_ns, &at_ns)) {
		refuse(reply, -ERANGE, "the time is out of range");
		return reply->result;
	}
	if (at_ns <= now_ns) {
		refuse(reply, -ETIME, "the time is in the past (DC time is %" PRId64 " ns)",
		       now_ns);
		return reply->result;
	}
	if (at_ns - now_ns < margin_ns) {
		refuse(reply, -ETIME,
		       "only %" PRId64 " ns ahead, at least %" PRId64 " ns are needed",
		       at_ns - now_ns, margin_ns);
		return reply->result;
	}
	if (at_ns - now_ns > ADMIN_ONESHOT_AHEAD_NS) {
		refuse(reply, -ERANGE, "%" PRId64 " s ahead, at most %" PRId64 " s are taken",
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
		refuse(reply, -EOPNOTSUPP, "%s: has no output " ONESHOT_ENTRY,
		       t->slaves[slave_pos].name);
		return reply->result;
	}
	if (!config_is_oneshot(t->cfg, slave_pos)) {
		refuse(reply, -EOPNOTSUPP, "%s: is in periodic mode (slaves[%u].mode: oneshot)",
		       t->slaves[slave_pos].name, slave_pos);
		return reply->result;
	}
	r = check_output(t, (size_t)channel, (uint64_t)at_ns, reply);
	if (r < 0) {
		return r;
	}
	*ret_placed = (struct placed){
		.channel = (size_t)channel,
		.output = config_output_index(t->channels, (size_t)channel),
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

	if (!has_op(t, reply)) {
		return reply->result;
	}
	if (!is_all && rq->slave_pos >= t->slave_count) {
		refuse(reply, -ENODEV, "slave %u: there are %zu slaves", rq->slave_pos,
		       t->slave_count);
		return reply->result;
	}
	for (uint16_t pos = 0; pos < t->slave_count; pos++) {
		if (is_all ? find_oneshot(t, pos) < 0 : pos != rq->slave_pos) {
			continue;
		}
		/* The time last: report first what can never be armed. */
		if (place_oneshot(t, pos, 0, &ret_placed[count], reply) < 0) {
			return reply->result;
		}
		count++;
	}
	if (count == 0) {
		refuse(reply, -EOPNOTSUPP, "no slave has an output " ONESHOT_ENTRY);
		return reply->result;
	}
	if (oneshot_time(t, rq, &at_ns, reply) < 0) {
		return reply->result;
	}
	for (int i = 0; i < count; i++) {
		ret_placed[i].raw = (uint64_t)at_ns;
		if (check_output(t, ret_placed[i].channel, (uint64_t)at_ns, reply) < 0) {
			return reply->result;
		}
	}
	reply->dc_time_ns = at_ns;
	return count;
}

static void run_oneshot(const struct admin_target *t, struct admin_pending *pending)
{
	struct placed placed[LIMIT_SLAVES] = { { .channel = 0 } };
	const struct admin_request *rq = &pending->request;
	struct admin_reply *reply = &pending->reply;
	int count = place_oneshots(t, rq, placed, reply);

	if (count < 0) {
		emit(t, EVENT_COMMAND_REFUSED, rq->slave_pos, -1, reply->result,
		     (int32_t)pending->uid);
		admin_pending_complete(pending, reply->result);
		return;
	}
	wait_for_cycle(t, pending, placed, (size_t)count);
	emit(t, EVENT_COMMAND, rq->slave_pos, reply->dc_time_ns, ADMIN_ONESHOT,
	     (int32_t)pending->uid);
}

/* --- requests to one slave --- */

/* 1 if the slave is there; else the refusal. */
static int has_slave(const struct admin_target *t, struct admin_pending *pending)
{
	if (t->slave_count == 0) {
		admin_pending_refuse(pending, -EAGAIN, "the bus is down");
		return 0;
	}
	if (pending->request.slave_pos >= t->slave_count) {
		admin_pending_refuse(pending, -ENODEV, "slave %u: there are %zu slaves",
				     pending->request.slave_pos, t->slave_count);
		return 0;
	}
	return 1;
}

/* Requests to a mailbox that only read are no event. */
static int is_mailbox_command(uint32_t verb)
{
	return verb == ADMIN_SDO_WRITE || verb == ADMIN_FOE_WRITE || verb == ADMIN_SOE_WRITE ||
	       verb == ADMIN_EOE_IP_WRITE || verb == ADMIN_AOE_WRITE || verb == ADMIN_VOE;
}

/* Never a password. */
static int64_t mailbox_object(const struct admin_request *rq)
{
	switch (rq->verb) {
	case ADMIN_SDO_WRITE:
		return (int64_t)rq->index << 8 | rq->subindex;
	case ADMIN_SOE_WRITE:
		return rq->index;
	case ADMIN_AOE_WRITE:
		return rq->argument[1];
	default: /* they have none */
		return 0;
	}
}

static void run_mailbox(const struct admin_target *t, struct admin_pending *pending)
{
	const struct admin_request *rq = &pending->request;

	if (t->mailbox == NULL) {
		admin_pending_refuse(pending, -EAGAIN, "the bus is down");
		return;
	}
	if (!has_slave(t, pending)) {
		return;
	}
	if (is_mailbox_command(rq->verb)) {
		emit(t, EVENT_COMMAND, rq->slave_pos, mailbox_object(rq), (int32_t)rq->verb,
		     (int32_t)pending->uid);
	}
	t->mailbox(t->ctx, pending);
}

static void report_sdo(const struct admin_target *t, struct admin_pending *pending)
{
	const struct admin_request *rq = &pending->request;
	int32_t object = (int32_t)((uint32_t)rq->index << 8 | rq->subindex);

	if (pending->reply.slave_code != 0) {
		emit(t, EVENT_SDO_ABORT, rq->slave_pos, pending->reply.slave_code, object, 0);
	}
}

/* It changes something, which is an event. */
static int is_command(enum admin_verb verb)
{
	return verb != ADMIN_REGISTER_READ && verb != ADMIN_SII_READ && verb != ADMIN_DIAGNOSIS &&
	       verb != ADMIN_DATAGRAMS && verb != ADMIN_COMPARE && verb != ADMIN_STARTUP;
}

int admin_command_takes_frame(enum admin_verb verb)
{
	return verb == ADMIN_STATE || verb == ADMIN_REGISTER_READ || verb == ADMIN_REGISTER_WRITE ||
	       verb == ADMIN_SII_READ || verb == ADMIN_SII_WRITE || verb == ADMIN_SII_ALIAS ||
	       verb == ADMIN_DIAGNOSIS || verb == ADMIN_ERRORS_RESET;
}

static void run_on_bus(const struct admin_target *t, struct admin_pending *pending);

static const char brought_up[] = "the bus is being brought up";

static void run_when_up(struct admin_pending *pending, const struct admin_target *target)
{
	if (target->bus_request != NULL) {
		pending->poll = NULL;
		pending->cancel = NULL;
		pending->outlives_bus = 0;
		pending->waits_for = NULL;
		run_on_bus(target, pending);
	}
}

static void leave(struct admin_pending *pending)
{
	admin_pending_complete(pending, -ECANCELED);
}

/* The bus is being brought up: what only looks waits for the end of that. */
static void run_later(struct admin_pending *pending)
{
	if (is_command((enum admin_verb)pending->request.verb)) {
		admin_pending_refuse(pending, -EBUSY, "%s", brought_up);
		return;
	}
	pending->waits_for = brought_up;
	pending->poll = run_when_up;
	pending->cancel = leave;
	pending->outlives_bus = 1; /* a bring-up begins without one */
}

static void run_on_bus(const struct admin_target *t, struct admin_pending *pending)
{
	const struct admin_request *rq = &pending->request;
	int is_all = rq->verb == ADMIN_RESCAN || rq->verb == ADMIN_DATAGRAMS ||
		     rq->verb == ADMIN_COMPARE || rq->verb == ADMIN_CONFIG_RELOAD ||
		     rq->slave_pos == ADMIN_ALL_SLAVES;

	if (t->bus_request == NULL) {
		run_later(pending);
		return;
	}
	if (!is_all && !has_slave(t, pending)) {
		return;
	}
	if (is_command((enum admin_verb)rq->verb)) {
		emit(t, EVENT_COMMAND, is_all ? EVENT_NO_SLAVE : rq->slave_pos,
		     rq->verb == ADMIN_REGISTER_WRITE ? rq->address : rq->argument[0],
		     (int32_t)rq->verb, (int32_t)pending->uid);
	}
	t->bus_request(t->ctx, pending);
}

/* --- all --- */

void admin_command_report(const struct admin_target *target, struct admin_pending *pending)
{
	enum admin_verb verb = (enum admin_verb)pending->request.verb;

	if (pending->is_reported) {
		return;
	}
	pending->is_reported = 1;
	if (verb == ADMIN_SDO_READ || verb == ADMIN_SDO_WRITE) {
		report_sdo(target, pending);
	}
}

static void run_simple(const struct admin_target *t, struct admin_pending *pending,
		       void (*act)(void *ctx))
{
	emit(t, EVENT_COMMAND, EVENT_NO_SLAVE, 0, (int32_t)pending->request.verb,
	     (int32_t)pending->uid);
	act(t->ctx);
	admin_pending_complete(pending, 0);
}

void admin_command_run(const struct admin_target *target, struct admin_pending *pending)
{
	switch ((enum admin_verb)pending->request.verb) {
	case ADMIN_PING:
		admin_pending_complete(pending, 0);
		return;
	case ADMIN_SET:
		run_set(target, pending);
		return;
	case ADMIN_ONESHOT:
		run_oneshot(target, pending);
		return;
	case ADMIN_SDO_READ:
	case ADMIN_SDO_WRITE:
	case ADMIN_SDO_LIST:
	case ADMIN_SDO_OBJECT:
	case ADMIN_SDO_ENTRY:
	case ADMIN_FOE_READ:
	case ADMIN_FOE_WRITE:
	case ADMIN_SOE_READ:
	case ADMIN_SOE_WRITE:
	case ADMIN_EOE_IP_READ:
	case ADMIN_EOE_IP_WRITE:
	case ADMIN_AOE_READ:
	case ADMIN_AOE_WRITE:
	case ADMIN_VOE:
		run_mailbox(target, pending);
		return;
	case ADMIN_STOP:
		run_simple(target, pending, target->stop);
		return;
	case ADMIN_CLEAR:
		run_simple(target, pending, target->clear);
		return;
	case ADMIN_RESCAN:
	case ADMIN_STATE:
	case ADMIN_REGISTER_READ:
	case ADMIN_REGISTER_WRITE:
	case ADMIN_SII_READ:
	case ADMIN_SII_WRITE:
	case ADMIN_SII_ALIAS:
	case ADMIN_DIAGNOSIS:
	case ADMIN_ERRORS_RESET:
	case ADMIN_DATAGRAMS:
	case ADMIN_COMPARE:
	case ADMIN_CONFIG_RELOAD:
	case ADMIN_STARTUP:
		run_on_bus(target, pending);
		return;
	case ADMIN_CAPTURE:
		emit(target, EVENT_COMMAND, EVENT_NO_SLAVE, 0, ADMIN_CAPTURE,
		     (int32_t)pending->uid);
		target->capture(target->ctx, pending);
		return;
	case ADMIN_CANCEL:
	case ADMIN_DATA:
		break; /* the server's own */
	}
	admin_pending_refuse(pending, -EINVAL, "unknown verb %u", pending->request.verb);
}
