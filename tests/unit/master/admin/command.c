/* SPDX-License-Identifier: MIT */
#include "admin/command.h"

#include <errno.h>

#include "harness/test.h"
#include "unit/master/admin/target.h"

enum { USER = 1000, OUTPUT_LED = 0, OUTPUT_LEVEL = 1, OUTPUT_ONESHOT = 2 };

enum outcome { DONE, DEFERRED };

/* Started, not finished. */
static struct admin_pending *start(const struct admin_target *target,
				   const struct admin_request *rq)
{
	static struct admin_pending pending;

	CHECK_EQ(admin_pending_init(&pending, rq, USER), 0);
	admin_command_run(target, &pending);
	return &pending;
}

static struct admin_reply run(struct fake *fake, const struct admin_request *rq,
			      enum outcome wanted)
{
	struct admin_target target = fake_target(fake);
	struct admin_pending *pending = start(&target, rq);

	CHECK_EQ(pending->state == ADMIN_PENDING_COMPLETE, wanted == DONE);
	if (wanted == DONE) {
		admin_command_report(&target, pending);
	}
	CHECK_EQ(pending->reply.magic, ADMIN_MAGIC);
	return pending->reply;
}

static struct admin_reply set_one(struct fake *fake, const char *channel, uint64_t raw,
				  enum outcome wanted)
{
	struct admin_request rq = fake_request(ADMIN_SET);

	fake_item(&rq, channel, raw);
	return run(fake, &rq, wanted);
}

static uint32_t is_set(const struct fake *fake, unsigned output)
{
	return fake->board.output[output].is_set;
}

TEST(admin, a_set_goes_to_the_board_and_is_answered_with_the_cycle_of_its_frame)
{
	struct fake fake;
	struct admin_target target;
	struct admin_request rq = fake_request(ADMIN_SET);
	struct admin_pending *pending;

	fake_init(&fake);
	target = fake_target(&fake);
	fake_item(&rq, "a.led", 1);
	fake_item(&rq, "a.level", 0xf9); /* -7 */
	pending = start(&target, &rq);
	pending->poll(pending, &target);
	CHECK_EQ(pending->state, ADMIN_PENDING_OPEN);
	CHECK_EQ(fake.board.output[OUTPUT_LED].raw, 1);
	CHECK_EQ(fake.board.output[OUTPUT_LEVEL].raw, 0xf9);
	CHECK_EQ(is_set(&fake, OUTPUT_ONESHOT), 0);
	fake_cycle(&fake, 4711);
	pending->poll(pending, &target);
	CHECK_EQ(pending->state, ADMIN_PENDING_COMPLETE);
	CHECK_EQ(pending->reply.result, 0);
	CHECK_EQ(pending->reply.cycle, 4711);
	CHECK_EQ(fake.events, 2);
	CHECK_EQ(fake.event[0].id, EVENT_OUTPUT_SET);
	CHECK_EQ(fake.event[0].value, FAKE_LED);
	CHECK_EQ(fake.event[0].arg[1], USER);
}

TEST(admin, one_bad_item_leaves_the_whole_board_unchanged)
{
	struct fake fake;
	struct admin_request rq = fake_request(ADMIN_SET);
	struct admin_reply reply;

	fake_init(&fake);
	fake_item(&rq, "a.led", 1);
	fake_item(&rq, "a.nothing", 1);
	reply = run(&fake, &rq, DONE);
	CHECK_EQ(reply.result, -ENOENT);
	CHECK_STR(reply.text, "a.nothing: no such channel");
	CHECK_EQ(is_set(&fake, OUTPUT_LED), 0);
	CHECK_EQ(fake.board.sequence, 0);
	CHECK_EQ(fake.event[0].id, EVENT_COMMAND_REFUSED);
	CHECK_EQ(fake.event[0].arg[0], -ENOENT);
}

TEST(admin, an_input_is_not_set)
{
	struct fake fake;
	struct admin_reply reply;

	fake_init(&fake);
	reply = set_one(&fake, "a.adc", 1, DONE);
	CHECK_EQ(reply.result, -EPERM);
	CHECK_STR(reply.text, "a.adc: is an input");
}

TEST(admin, an_output_with_another_owner_is_refused)
{
	struct fake fake;

	fake_init(&fake);
	fake.cfg.output[0].owner = CONFIG_OWNER_REMOTE;
	CHECK_STR(set_one(&fake, "a.level", 1, DONE).text,
		  "a.level: owned by remote, not local (outputs[].owner)");
	fake.cfg.output[0].owner = CONFIG_OWNER_PROGRAM;
	CHECK_EQ(set_one(&fake, "a.level", 1, DONE).result, -EPERM);
	CHECK_EQ(is_set(&fake, OUTPUT_LEVEL), 0);
}

TEST(admin, values_outside_the_limits_or_the_type_are_refused)
{
	struct fake fake;

	fake_init(&fake);
	CHECK_EQ(set_one(&fake, "a.level", 11, DONE).result, -ERANGE);
	CHECK_EQ(set_one(&fake, "a.level", 0xf5, DONE).result, -ERANGE); /* -11 */
	CHECK_EQ(set_one(&fake, "a.level", 0x100, DONE).result, -ERANGE);
	CHECK_EQ(set_one(&fake, "a.led", 2, DONE).result, -ERANGE);
	CHECK_EQ(set_one(&fake, "a.level", 10, DEFERRED).result, 0);
	CHECK_EQ(set_one(&fake, "a.level", 0xf6, DEFERRED).result, 0); /* -10 */
}

TEST(admin, nothing_is_set_unless_the_bus_is_in_op)
{
	struct fake fake;
	struct admin_target target;
	struct admin_request rq = fake_request(ADMIN_SET);

	fake_init(&fake);
	fake_item(&rq, "a.led", 1);
	target = fake_target(&fake);
	target.is_op = 0;
	CHECK_STR(start(&target, &rq)->reply.text, "the bus is not in OP");
	target.is_op = 1;
	target.board = NULL;
	CHECK_EQ(start(&target, &rq)->reply.result, -EAGAIN);
	CHECK_EQ(fake.board.sequence, 0);
}

static struct admin_request oneshot(uint16_t slave_pos, uint8_t is_relative, int64_t time_ns)
{
	struct admin_request rq = fake_request(ADMIN_ONESHOT);

	rq.slave_pos = slave_pos;
	rq.is_relative = is_relative;
	rq.dc_time_ns = time_ns;
	return rq;
}

TEST(admin, a_one_shot_time_goes_out_as_an_absolute_time)
{
	struct fake fake;
	struct admin_request rq = oneshot(1, 1, 20 * FAKE_PERIOD_NS);
	struct admin_reply reply;

	fake_init(&fake);
	reply = run(&fake, &rq, DEFERRED);
	CHECK_EQ(reply.dc_time_ns, FAKE_NOW_NS + 20 * FAKE_PERIOD_NS);
	CHECK_EQ(fake.board.output[OUTPUT_ONESHOT].raw, FAKE_NOW_NS + 20 * FAKE_PERIOD_NS);
	CHECK_EQ(fake.event[0].id, EVENT_COMMAND);
	CHECK_EQ(fake.event[0].value, reply.dc_time_ns);
	rq = oneshot(1, 0, FAKE_NOW_NS + 5 * FAKE_PERIOD_NS);
	CHECK_EQ(run(&fake, &rq, DEFERRED).dc_time_ns, FAKE_NOW_NS + 5 * FAKE_PERIOD_NS);
}

TEST(admin, a_one_shot_time_in_the_past_or_too_near_is_refused)
{
	struct fake fake;
	struct admin_request past = oneshot(1, 0, FAKE_NOW_NS - 1);
	struct admin_request now = oneshot(1, 1, 0);
	struct admin_request near = oneshot(1, 1, 5 * FAKE_PERIOD_NS - 1);
	struct admin_request back = oneshot(1, 1, -FAKE_PERIOD_NS);
	struct admin_request far = oneshot(1, 1, INT64_MAX);

	fake_init(&fake);
	CHECK_EQ(run(&fake, &past, DONE).result, -ETIME);
	CHECK(strstr(run(&fake, &past, DONE).text, "in the past") != NULL);
	CHECK_EQ(run(&fake, &now, DONE).result, -ETIME);
	CHECK_EQ(run(&fake, &near, DONE).result, -ETIME);
	CHECK_EQ(run(&fake, &back, DONE).result, -ETIME);
	CHECK_EQ(run(&fake, &far, DONE).result, -ERANGE);
	CHECK_EQ(fake.board.sequence, 0);
	CHECK_EQ(fake.event[0].id, EVENT_COMMAND_REFUSED);
}

TEST(admin, a_one_shot_needs_a_slave_that_can_and_is_in_that_mode)
{
	struct fake fake;
	struct admin_request cannot = oneshot(0, 1, 20 * FAKE_PERIOD_NS);
	struct admin_request absent = oneshot(2, 1, 20 * FAKE_PERIOD_NS);
	struct admin_request right = oneshot(1, 1, 20 * FAKE_PERIOD_NS);

	fake_init(&fake);
	CHECK_EQ(run(&fake, &cannot, DONE).result, -EOPNOTSUPP);
	CHECK_EQ(run(&fake, &absent, DONE).result, -ENODEV);
	fake.cfg.slave[1].mode = CONFIG_MODE_PERIODIC;
	CHECK_STR(run(&fake, &right, DONE).text,
		  "b: is in periodic mode (slaves[1].mode: oneshot)");
	fake.cfg.slave[1].mode = CONFIG_MODE_UNSET;
	CHECK_EQ(run(&fake, &right, DONE).result, -EOPNOTSUPP);
	fake.cfg.sdo[0] =
		(struct config_sdo){ .slave_pos = 1, .index = 0x8000, .subindex = 1, .value = 1 };
	fake.cfg.sdo_count = 1;
	CHECK_EQ(run(&fake, &right, DEFERRED).result, 0);
	fake.has_dc = 0;
	CHECK_EQ(run(&fake, &right, DONE).result, -EAGAIN);
}

/* Both slaves of the fake with a one-shot output: its LED's channel becomes the first one's. */
static void make_both_oneshot(struct fake *fake)
{
	fake_init(fake);
	fake->channels[FAKE_LED] = fake->channels[FAKE_ONESHOT];
	fake->channels[FAKE_LED].slave_pos = 0;
	snprintf(fake->channels[FAKE_LED].name, sizeof(fake->channels[FAKE_LED].name),
		 "a.oneshot_time");
	fake->cfg.slave_count = 2;
	fake->cfg.slave[0].mode = CONFIG_MODE_ONESHOT;
}

TEST(admin, a_one_shot_of_all_slaves_is_one_set)
{
	struct fake fake;
	struct admin_request all = oneshot(ADMIN_ALL_SLAVES, 1, 20 * FAKE_PERIOD_NS);
	struct admin_reply reply;

	make_both_oneshot(&fake);
	reply = run(&fake, &all, DEFERRED);
	CHECK_EQ(fake.board.sequence, 2);
	CHECK_EQ(fake.board.output[OUTPUT_LED].raw, reply.dc_time_ns);
	CHECK_EQ(fake.board.output[OUTPUT_ONESHOT].raw, reply.dc_time_ns);
}

TEST(admin, a_one_shot_of_all_slaves_arms_none_if_one_cannot)
{
	struct fake fake;
	struct admin_request all = oneshot(ADMIN_ALL_SLAVES, 1, 20 * FAKE_PERIOD_NS);

	make_both_oneshot(&fake);
	fake.cfg.slave[1].mode = CONFIG_MODE_PERIODIC;
	CHECK_STR(run(&fake, &all, DONE).text, "b: is in periodic mode (slaves[1].mode: oneshot)");
	CHECK_EQ(fake.board.sequence, 0);
	fake.channels[FAKE_LED].name[0] = 'x';
	fake.channels[FAKE_LED].direction = CHANNEL_INPUT;
	fake.channels[FAKE_ONESHOT].direction = CHANNEL_INPUT;
	CHECK_EQ(run(&fake, &all, DONE).result, -EOPNOTSUPP);
	CHECK_EQ(fake.board.sequence, 0);
}

TEST(admin, a_one_shot_more_than_an_hour_ahead_is_refused)
{
	struct fake fake;
	struct admin_request far = oneshot(1, 1, ADMIN_ONESHOT_AHEAD_NS + FAKE_PERIOD_NS);
	struct admin_request just = oneshot(1, 1, ADMIN_ONESHOT_AHEAD_NS);

	fake_init(&fake);
	CHECK_STR(run(&fake, &far, DONE).text, "3600 s ahead, at most 3600 s are taken");
	CHECK_EQ(fake.board.sequence, 0);
	CHECK_EQ(run(&fake, &just, DEFERRED).result, 0);
}

TEST(admin, an_sdo_gives_data_or_its_abort_code)
{
	struct fake fake;
	struct admin_request rq = fake_request(ADMIN_SDO_READ);
	struct admin_reply reply;

	fake_init(&fake);
	rq.index = 0x8000;
	rq.subindex = 2;
	reply = run(&fake, &rq, DONE);
	CHECK_EQ(reply.result, 0);
	CHECK_EQ(reply.data_len, 1);
	CHECK_EQ(reply.data[0], 2);
	fake.sdo_result = -EIO;
	fake.sdo_abort = 0x06020000;
	reply = run(&fake, &rq, DONE);
	CHECK_EQ(reply.slave_code, 0x06020000);
	CHECK_EQ(reply.data_len, 0);
	CHECK_EQ(fake.event[0].id, EVENT_SDO_ABORT);
	fake.sdo_abort = 0;
	rq.verb = ADMIN_SDO_WRITE;
	rq.data_len = 1;
	CHECK_EQ(run(&fake, &rq, DONE).result, -EIO);
	rq.slave_pos = 2;
	CHECK_EQ(run(&fake, &rq, DONE).result, -ENODEV);
}

TEST(admin, an_sdo_without_a_bus_is_refused)
{
	struct fake fake;
	struct admin_request rq = fake_request(ADMIN_SDO_READ);
	struct admin_target target;

	fake_init(&fake);
	target = fake_target(&fake);
	target.mailbox = NULL;
	CHECK_EQ(start(&target, &rq)->state, ADMIN_PENDING_COMPLETE);
	CHECK_EQ(start(&target, &rq)->reply.result, -EAGAIN);
}

TEST(admin, stop_and_clear_are_passed_on_and_logged_with_their_user)
{
	struct fake fake;
	struct admin_request ping = fake_request(ADMIN_PING);
	struct admin_request stop = fake_request(ADMIN_STOP);
	struct admin_request clear = fake_request(ADMIN_CLEAR);

	fake_init(&fake);
	CHECK_EQ(run(&fake, &ping, DONE).result, 0);
	CHECK_EQ(fake.events, 0);
	run(&fake, &stop, DONE);
	run(&fake, &clear, DONE);
	CHECK_EQ(fake.stops, 1);
	CHECK_EQ(fake.clears, 1);
	CHECK_EQ(fake.events, 2);
	CHECK_EQ(fake.event[1].arg[0], ADMIN_CLEAR);
	CHECK_EQ(fake.event[1].arg[1], USER);
}

static void take(void *ctx, struct admin_pending *pending)
{
	struct fake *fake = ctx;

	fake->pending = pending;
	admin_pending_complete(pending, 0);
}

/* It is answered when the bus is there, or cancelled before. */
static void check_waits_for_bring_up(struct fake *fake, struct admin_target *target,
				     const struct admin_request *rq)
{
	struct admin_pending *pending;

	target->bus_request = NULL;
	pending = start(target, rq);
	CHECK_EQ(pending->state, ADMIN_PENDING_OPEN);
	pending->poll(pending, target);
	CHECK_EQ(pending->state, ADMIN_PENDING_OPEN);
	CHECK(pending->outlives_bus);
	pending->cancel(pending);
	CHECK_EQ(pending->reply.result, -ECANCELED);
	pending = start(target, rq);
	target->bus_request = take;
	pending->poll(pending, target);
	CHECK_EQ(pending->state, ADMIN_PENDING_COMPLETE);
	CHECK_EQ(pending->reply.result, 0);
	CHECK(fake->pending == pending);
	fake->pending = NULL;
}

TEST(admin, what_is_asked_of_the_whole_bus_needs_no_slave_takes_no_frame_and_is_no_event)
{
	static const enum admin_verb verbs[] = { ADMIN_DATAGRAMS, ADMIN_COMPARE };

	for (size_t i = 0; i < sizeof(verbs) / sizeof(verbs[0]); i++) {
		struct fake fake;
		struct admin_target target;
		struct admin_request rq = fake_request(verbs[i]);

		fake_init(&fake);
		target = fake_target(&fake);
		target.slave_count = 0;
		rq.slave_pos = 400;
		check_waits_for_bring_up(&fake, &target, &rq);
		target.bus_request = take;
		CHECK_EQ(start(&target, &rq)->reply.result, 0);
		CHECK(fake.pending != NULL);
		CHECK_EQ(fake.events, 0);
		CHECK_EQ(admin_command_takes_frame(verbs[i]), 0);
	}
}

TEST(admin, requests_to_registers_and_eeproms_reach_the_bus_and_those_that_write_are_events)
{
	static const struct {
		enum admin_verb verb;
		unsigned events;
	} verbs[] = { { ADMIN_STARTUP, 0 },        { ADMIN_REGISTER_READ, 0 },
		      { ADMIN_REGISTER_WRITE, 1 }, { ADMIN_SII_READ, 0 },
		      { ADMIN_SII_WRITE, 1 },      { ADMIN_SII_ALIAS, 1 },
		      { ADMIN_DIAGNOSIS, 0 },      { ADMIN_ERRORS_RESET, 1 } };

	for (size_t i = 0; i < sizeof(verbs) / sizeof(verbs[0]); i++) {
		struct fake fake;
		struct admin_target target;
		struct admin_request rq = fake_request(verbs[i].verb);

		fake_init(&fake);
		target = fake_target(&fake);
		rq.slave_pos = 1;
		rq.address = 0x0120;
		if (verbs[i].events == 0) {
			check_waits_for_bring_up(&fake, &target, &rq);
		} else {
			target.bus_request = NULL; /* during a bring-up */
			CHECK_EQ(start(&target, &rq)->reply.result, -EBUSY);
			target.bus_request = take;
		}
		CHECK_EQ(fake.events, 0);
		CHECK_EQ(start(&target, &rq)->reply.result, 0);
		CHECK(fake.pending != NULL && fake.pending->request.verb == verbs[i].verb);
		CHECK_EQ(fake.events, verbs[i].events);
		if (verbs[i].verb == ADMIN_REGISTER_WRITE) {
			CHECK_EQ(fake.event[0].value, 0x0120);
		}
		fake.pending = NULL;
		rq.slave_pos = 2;
		CHECK_EQ(start(&target, &rq)->reply.result, -ENODEV);
		CHECK(fake.pending == NULL);
	}
}
