/* SPDX-License-Identifier: MIT */
/* Service frames of both slots while the cycle owns the transport. */
#include "link/line.h"

#include <pthread.h>
#include <sched.h>
#include <stdatomic.h>

#include "unit/master/link/line_bench.h"

/* --- one thread: the waiter is the cycle --- */

TEST(line, riding_frame_is_sent_by_the_cycle_and_answered)
{
	struct fake_wire wire = { 0 };
	struct ride ride = { .wire = &wire, .line = line_on(&wire), .deaf = 1, .room = ROOM };
	uint8_t frame[LIMIT_FRAME_BYTES];
	uint8_t answer[LIMIT_FRAME_BYTES];
	size_t len = make_frame(frame, ECAT_CMD_FPRD, 9, 0x1001, ESC_REG_AL_STATUS);

	line_ride_begin(ride.line, (struct line_waiter){ one_cycle, &ride });
	CHECK_EQ(line_transact(ride.line, frame, len, answer, sizeof(answer), (span_t){ 2000000 }),
		 len);
	CHECK_EQ(ride.taken, 1);
	CHECK_EQ(ride.cycles, 2);
	CHECK_EQ(line_ride_is_out(ride.line), 0);
	line_ride_end(ride.line);
	CHECK_EQ(line_transact(ride.line, frame, len, answer, sizeof(answer), (span_t){ 2000000 }),
		 len);
	CHECK_EQ(ride.cycles, 2);
	line_destroy(ride.line);
}

TEST(line, riding_frame_that_is_lost_times_out_and_its_late_answer_does_no_harm)
{
	struct fake_wire wire = { .drop = 1 };
	struct ride ride = { .wire = &wire, .line = line_on(&wire), .room = ROOM };
	uint8_t frame[LIMIT_FRAME_BYTES];
	uint8_t late[LIMIT_FRAME_BYTES];
	uint8_t answer[LIMIT_FRAME_BYTES];
	size_t len = make_frame(frame, ECAT_CMD_FPRD, 9, 0x1001, ESC_REG_AL_STATUS);

	line_ride_begin(ride.line, (struct line_waiter){ one_cycle, &ride });
	CHECK_EQ(line_transact(ride.line, frame, len, answer, sizeof(answer), (span_t){ 2000000 }),
		 -ETIMEDOUT);
	CHECK_EQ(ride.cycles, 1 + LINE_LOST_CYCLES);
	CHECK_EQ(line_ride_is_out(ride.line), 0);
	memcpy(late, frame, len);
	fake_pass_slave(late, len);
	CHECK_EQ(line_ride_answer(ride.line, late, len), 1);
	make_frame(frame, ECAT_CMD_FPRD, 10, 0x1001, ESC_REG_AL_STATUS);
	CHECK_EQ(line_transact(ride.line, frame, len, answer, sizeof(answer), (span_t){ 2000000 }),
		 len);
	CHECK_EQ(answer[17], 10);
	line_destroy(ride.line);
}

TEST(line, nothing_rides_without_a_request)
{
	struct fake_wire wire = { 0 };
	struct line *line = line_on(&wire);
	uint8_t frame[LIMIT_FRAME_BYTES];
	size_t len = make_frame(frame, ECAT_CMD_FPRD, 9, 0x1001, ESC_REG_AL_STATUS);

	line_ride_advance(line, (span_t){ NS_PER_MS });
	CHECK(line_ride_take(line, ROOM, &len) == NULL);
	fake_pass_slave(frame, len);
	CHECK_EQ(line_ride_answer(line, frame, len), 0);
	line_destroy(line);
}

TEST(line, cycles_run_during_sleep_while_riding)
{
	struct fake_wire wire = { 0 };
	struct ride ride = { .wire = &wire, .line = line_on(&wire) };

	line_ride_begin(ride.line, (struct line_waiter){ one_cycle, &ride });
	line_sleep(ride.line, (span_t){ 5000000 });
	CHECK(ride.cycles >= 4);
	CHECK(wire.now_ns >= 5000000);
	CHECK_EQ(wire.slept, 0);
	line_ride_end(ride.line);
	line_sleep(ride.line, (span_t){ 5000000 });
	CHECK_EQ(wire.slept, 1);
	line_destroy(ride.line);
}

TEST(line, a_slot_takes_one_frame_and_gives_one_result)
{
	struct fake_wire wire = { 0 };
	struct ride ride;

	begin_ride(&ride, &wire);
	CHECK_EQ(collect(ride.line, LINE_MAILBOX), -ENOENT);
	CHECK_EQ(submit(ride.line, LINE_MAILBOX, 0x1001, 2), 0);
	CHECK_EQ(submit(ride.line, LINE_MAILBOX, 0x1002, 2), -EBUSY);
	CHECK_EQ(collect(ride.line, LINE_MAILBOX), -EAGAIN);
	one_cycle(&ride, FOREVER);
	CHECK_EQ(submit(ride.line, LINE_MAILBOX, 0x1002, 2), -EBUSY);
	CHECK_EQ(collect(ride.line, LINE_MAILBOX), 0x1001);
	CHECK_EQ(collect(ride.line, LINE_MAILBOX), -ENOENT);
	CHECK_EQ(submit(ride.line, LINE_MAILBOX, 0x1002, 2), 0);
	line_destroy(ride.line);
}

TEST(line, the_supervisor_goes_before_the_mailbox)
{
	struct fake_wire wire = { 0 };
	struct ride ride;

	begin_ride(&ride, &wire);
	CHECK_EQ(submit(ride.line, LINE_MAILBOX, 0x1001, 2), 0);
	CHECK_EQ(submit(ride.line, LINE_SUPERVISOR, 0x1002, 2), 0);
	one_cycle(&ride, FOREVER);
	CHECK_EQ(collect(ride.line, LINE_MAILBOX), -EAGAIN);
	CHECK_EQ(collect(ride.line, LINE_SUPERVISOR), 0x1002);
	one_cycle(&ride, FOREVER);
	CHECK_EQ(collect(ride.line, LINE_MAILBOX), 0x1001);
	line_destroy(ride.line);
}

/* Equal in every byte but the slot's own bit of the index. */
TEST(line, equal_frames_of_two_slots_get_one_answer_each)
{
	struct fake_wire wire = { 0 };
	struct ride ride;

	begin_ride(&ride, &wire);
	CHECK_EQ(submit(ride.line, LINE_SUPERVISOR, 0x1001, 2), 0);
	CHECK_EQ(submit(ride.line, LINE_MAILBOX, 0x1001, 2), 0);
	wire.drop = 1; /* the supervisor's */
	one_cycle(&ride, FOREVER);
	one_cycle(&ride, FOREVER);
	CHECK_EQ(collect(ride.line, LINE_MAILBOX), 0x1001);
	one_cycle(&ride, FOREVER);
	CHECK_EQ(collect(ride.line, LINE_SUPERVISOR), -ETIMEDOUT);
	line_destroy(ride.line);
}

TEST(line, a_lost_frame_of_one_slot_does_not_hold_up_the_other)
{
	struct fake_wire wire = { .drop = 1 };
	struct ride ride;

	begin_ride(&ride, &wire);
	CHECK_EQ(submit(ride.line, LINE_MAILBOX, 0x1001, 2), 0);
	one_cycle(&ride, FOREVER);
	CHECK_EQ(submit(ride.line, LINE_SUPERVISOR, 0x1002, 2), 0);
	one_cycle(&ride, FOREVER);
	CHECK_EQ(collect(ride.line, LINE_MAILBOX), -EAGAIN);
	CHECK_EQ(collect(ride.line, LINE_SUPERVISOR), 0x1002);
	one_cycle(&ride, FOREVER);
	CHECK_EQ(collect(ride.line, LINE_MAILBOX), -ETIMEDOUT);
	line_destroy(ride.line);
}

TEST(line, a_frame_that_no_cycle_had_room_for_was_never_sent)
{
	struct fake_wire wire = { 0 };
	struct ride ride;

	begin_ride(&ride, &wire);
	ride.room.ns = ecat_wire_time_ns(1000) - 1;
	CHECK_EQ(submit(ride.line, LINE_SUPERVISOR, 0x1001, 1000 - 28), 0);
	while (wire.now_ns < 98 * NS_PER_MS) {
		one_cycle(&ride, FOREVER);
	}
	CHECK_EQ(collect(ride.line, LINE_SUPERVISOR), -EAGAIN);
	one_cycle(&ride, FOREVER);
	one_cycle(&ride, FOREVER);
	CHECK_EQ(collect(ride.line, LINE_SUPERVISOR), -ENOBUFS);
	CHECK_EQ(wire.sent, 0);
	ride.room.ns++;
	CHECK_EQ(submit(ride.line, LINE_SUPERVISOR, 0x1001, 1000 - 28), 0);
	one_cycle(&ride, FOREVER);
	CHECK_EQ(collect(ride.line, LINE_SUPERVISOR), 0x1001);
	line_destroy(ride.line);
}

TEST(line, a_mailbox_frame_does_not_use_the_room_that_the_supervisor_waits_for)
{
	struct fake_wire wire = { 0 };
	struct ride ride;

	begin_ride(&ride, &wire);
	ride.room.ns = ecat_wire_time_ns(500);
	CHECK_EQ(submit(ride.line, LINE_SUPERVISOR, 0x1001, 600), 0);
	CHECK_EQ(submit(ride.line, LINE_MAILBOX, 0x1002, 2), 0);
	one_cycle(&ride, FOREVER);
	CHECK_EQ(wire.sent, 0);
	ride.room = ROOM;
	one_cycle(&ride, FOREVER);
	one_cycle(&ride, FOREVER);
	CHECK_EQ(collect(ride.line, LINE_SUPERVISOR), 0x1001);
	CHECK_EQ(collect(ride.line, LINE_MAILBOX), 0x1002);
	line_destroy(ride.line);
}

TEST(line, service_frames_use_their_share_of_the_period_and_no_more)
{
	struct fake_wire wire = { 0 };
	struct ride ride;
	span_t period = { 250000 };
	const uint8_t *frame;
	size_t len;
	int64_t used_ns = 0;

	begin_ride(&ride, &wire);
	for (unsigned i = 0; i < 1000; i++) {
		line_ride_advance(ride.line, period);
		submit(ride.line, LINE_MAILBOX, 0x1001, 1486);
		submit(ride.line, LINE_SUPERVISOR, 0x1002, 1000);
		while ((frame = line_ride_take(ride.line, ROOM, &len)) != NULL) {
			used_ns += ecat_wire_time_ns(len);
			line_ride_refused(ride.line, -ENOBUFS);
		}
		collect(ride.line, LINE_MAILBOX);
		collect(ride.line, LINE_SUPERVISOR);
	}
	CHECK(used_ns <= 1000 * period.ns * LINE_SHARE_PERCENT / 100);
	CHECK(used_ns >= 1000 * period.ns * (LINE_SHARE_PERCENT - 1) / 100);
	line_destroy(ride.line);
}

TEST(line, a_frame_that_the_transport_refused_was_not_sent)
{
	struct fake_wire wire = { 0 };
	struct ride ride;
	size_t len;

	begin_ride(&ride, &wire);
	CHECK_EQ(submit(ride.line, LINE_MAILBOX, 0x1001, 2), 0);
	line_ride_advance(ride.line, (span_t){ NS_PER_MS });
	CHECK(line_ride_take(ride.line, ROOM, &len) != NULL);
	line_ride_refused(ride.line, -ENETDOWN);
	CHECK_EQ(collect(ride.line, LINE_MAILBOX), -ENETDOWN);
	line_destroy(ride.line);
}

TEST(line, a_frame_longer_than_any_cycle_has_room_for_is_refused_at_once)
{
	struct fake_wire wire = { 0 };
	struct ride ride;

	begin_ride(&ride, &wire);
	CHECK_EQ(line_frame_limit(ride.line), LIMIT_FRAME_BYTES);
	line_frame_limit_set(ride.line, 400);
	CHECK_EQ(submit(ride.line, LINE_MAILBOX, 0x1001, 401 - 28), -EMSGSIZE);
	CHECK_EQ(submit(ride.line, LINE_MAILBOX, 0x1001, 400 - 28), 0);
	line_ride_end(ride.line);
	CHECK_EQ(collect(ride.line, LINE_MAILBOX), -ENOBUFS);
	CHECK_EQ(submit(ride.line, LINE_MAILBOX, 0x1001, 1486), 0);
	CHECK_EQ(collect(ride.line, LINE_MAILBOX), 0x1001);
	line_destroy(ride.line);
}

TEST(line, a_frame_that_was_out_when_the_cycle_began_or_ended_is_lost)
{
	struct fake_wire wire = { .drop = 2 };
	struct ride ride = { .wire = &wire, .line = line_on(&wire), .room = ROOM };

	CHECK_EQ(submit(ride.line, LINE_MAILBOX, 0x1001, 2), 0);
	line_ride_begin(ride.line, (struct line_waiter){ one_cycle, &ride });
	CHECK_EQ(collect(ride.line, LINE_MAILBOX), -ETIMEDOUT);
	CHECK_EQ(submit(ride.line, LINE_MAILBOX, 0x1001, 2), 0);
	one_cycle(&ride, FOREVER);
	line_ride_end(ride.line);
	CHECK_EQ(collect(ride.line, LINE_MAILBOX), -ETIMEDOUT);
	line_destroy(ride.line);
}

TEST(line, the_supervisor_is_served_while_a_mailbox_frame_is_out_in_direct_mode)
{
	struct fake_wire wire = { .travel_ns = 1000000 };
	struct line *line = line_on(&wire);
	uint8_t answer[LIMIT_FRAME_BYTES];

	CHECK_EQ(submit(line, LINE_MAILBOX, 0x1001, 2), 0);
	CHECK_EQ(ask_status(line, answer), 60);
	CHECK_EQ(line_discarded(line), 0);
	CHECK_EQ(collect(line, LINE_MAILBOX), 0x1001);
	CHECK_EQ(line_answered(line), 2);
	wire.drop = 1;
	CHECK_EQ(submit(line, LINE_MAILBOX, 0x1001, 2), 0);
	CHECK_EQ(collect(line, LINE_MAILBOX), -ETIMEDOUT);
	line_destroy(line);
}

/* --- two threads: a cycle that echoes, with holes, against a service that gives up --- */

enum { STRESS_FRAMES = 1000 };

struct stress {
	struct line *line;
	_Atomic int stop;
	_Atomic int64_t clock_ns; /* moved by the service's waits only */
};

static mono_t stress_now(void *ctx)
{
	struct stress *st = ctx;

	return (mono_t){ atomic_load(&st->clock_ns) };
}

static void stress_wait(void *ctx, mono_t until)
{
	struct stress *st = ctx;

	(void)until;
	atomic_fetch_add(&st->clock_ns, NS_PER_MS); /* gives up after a hundred of these */
	sched_yield();
}

static void *stress_cycle(void *arg)
{
	struct stress *st = arg;
	uint8_t back[LIMIT_FRAME_BYTES];
	unsigned n = 0;

	while (!atomic_load(&st->stop)) {
		const uint8_t *out;
		size_t len;

		line_ride_advance(st->line, (span_t){ NS_PER_MS });
		while ((out = line_ride_take(st->line, ROOM, &len)) != NULL) {
			if (++n % 7 == 0) {
				continue;
			}
			if (n % 11 == 0) {
				line_ride_refused(st->line, -ENETDOWN);
				continue;
			}
			memcpy(back, out, len);
			fake_pass_slave(back, len);
			line_ride_answer(st->line, back, len);
		}
		sched_yield(); /* two threads, and maybe one core for them */
	}
	return NULL;
}

static void begin_stress(struct stress *st, pthread_t *cycle)
{
	struct platform platform = { .now = stress_now, .ctx = st };

	memset(st, 0, sizeof(*st));
	CHECK_EQ(line_create(platform, (struct transport){ 0 }, &st->line), 0);
	line_ride_begin(st->line, (struct line_waiter){ stress_wait, st });
	CHECK_EQ(pthread_create(cycle, NULL, stress_cycle, st), 0);
}

static void end_stress(struct stress *st, pthread_t cycle)
{
	atomic_store(&st->stop, 1);
	pthread_join(cycle, NULL);
	line_ride_end(st->line);
	line_destroy(st->line);
}

static void check_failure(int r)
{
	CHECK(r == -ETIMEDOUT || r == -ENOBUFS || r == -ENETDOWN);
}

TEST(line, handover_between_two_threads_never_mixes_frames)
{
	struct stress st;
	pthread_t cycle;
	unsigned answered = 0;

	begin_stress(&st, &cycle);
	for (unsigned i = 0; i < STRESS_FRAMES || answered == 0; i++) {
		uint8_t frame[LIMIT_FRAME_BYTES];
		uint8_t answer[LIMIT_FRAME_BYTES];
		size_t len = make_frame(frame, ECAT_CMD_FPRD, (uint8_t)i, (uint16_t)i, 0x0130);
		int r = line_transact(st.line, frame, len, answer, sizeof(answer), (span_t){ 0 });

		if (r > 0) {
			CHECK_EQ(get_le16(answer + 18), (uint16_t)i);
			answered++;
		} else {
			check_failure(r);
		}
	}
	end_stress(&st, cycle);
}

TEST(line, two_slots_between_two_threads_never_mix_frames)
{
	static const uint16_t length[LINE_SLOTS] = { 2, 200 };
	unsigned answered[LINE_SLOTS] = { 0 };
	unsigned settled = 0;
	struct stress st;
	pthread_t cycle;

	begin_stress(&st, &cycle);
	while (settled < STRESS_FRAMES || answered[0] == 0 || answered[1] == 0) {
		for (unsigned i = 0; i < LINE_SLOTS; i++) {
			int r = collect(st.line, i);

			if (r > 0) {
				CHECK_EQ(r, 0x1000 + i);
				answered[i]++;
			} else if (r != -ENOENT && r != -EAGAIN) {
				check_failure(r);
			}
			if (r != -EAGAIN) {
				settled += r != -ENOENT;
				CHECK_EQ(submit(st.line, i, (uint16_t)(0x1000 + i), length[i]), 0);
			}
		}
		stress_wait(&st, FOREVER);
	}
	end_stress(&st, cycle);
}
