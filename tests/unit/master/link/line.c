/* SPDX-License-Identifier: MIT */
#include "link/line.h"

#include <pthread.h>
#include <sched.h>
#include <stdatomic.h>

#include "harness/test.h"
#include "unit/master/link/fake_wire.h"
#include "wire/esc_reg.h"

static const uint8_t source[6] = { 0x10, 0x10, 0x10, 0x10, 0x10, 0x10 };

static size_t make_frame(uint8_t *frame, enum ecat_cmd cmd, uint8_t idx, uint16_t adp, uint16_t ado)
{
	struct ecat_frame_builder fb;

	ecat_frame_begin(&fb, frame, source);
	ecat_frame_add(&fb, cmd, idx, adp, ado, 2);
	return ecat_frame_end(&fb);
}

static struct line *line_on(struct fake_wire *wire)
{
	struct line *line = NULL;

	CHECK_EQ(line_create(fake_platform(wire), fake_transport(wire), &line), 0);
	return line;
}

/* Ask slave 0x1001 for its AL status, index 7, with 2 ms for the answer. */
static int ask_status(struct line *line, uint8_t answer[LIMIT_FRAME_BYTES])
{
	uint8_t frame[LIMIT_FRAME_BYTES];
	size_t len = make_frame(frame, ECAT_CMD_FPRD, 7, 0x1001, ESC_REG_AL_STATUS);

	return line_transact(line, frame, len, answer, LIMIT_FRAME_BYTES, (span_t){ 2000000 });
}

TEST(line, direct_transaction_returns_the_echo)
{
	struct fake_wire wire = { 0 };
	struct line *line = line_on(&wire);
	uint8_t answer[LIMIT_FRAME_BYTES];

	CHECK_EQ(ask_status(line, answer), 60);
	CHECK_EQ(answer[28], 1);
	CHECK_EQ(wire.now_ns, FAKE_TRAVEL_NS);
	CHECK_EQ(line_discarded(line), 0);
	CHECK_EQ(line_answered(line), 1);
	line_destroy(line);
}

TEST(line, lost_frame_costs_the_timeout_and_no_more)
{
	struct fake_wire wire = { .drop = 1 };
	struct line *line = line_on(&wire);
	uint8_t frame[LIMIT_FRAME_BYTES];
	uint8_t answer[LIMIT_FRAME_BYTES] = { 77 };
	size_t len = make_frame(frame, ECAT_CMD_BRD, 0, 0, 0);

	CHECK_EQ(line_transact(line, frame, len, answer, sizeof(answer), (span_t){ 2000000 }),
		 -ETIMEDOUT);
	CHECK_EQ(answer[0], 77);
	CHECK_EQ(wire.now_ns, 2000000);
	line_destroy(line);
}

TEST(line, answer_to_an_earlier_index_is_dropped)
{
	struct fake_wire wire = { 0 };
	struct line *line = line_on(&wire);
	uint8_t stale[LIMIT_FRAME_BYTES];
	uint8_t answer[LIMIT_FRAME_BYTES];
	size_t len = make_frame(stale, ECAT_CMD_FPRD, 6, 0x1001, ESC_REG_AL_STATUS);

	fake_pass_slave(stale, len);
	fake_queue(&wire, stale, len, 0);
	CHECK_EQ(ask_status(line, answer), len);
	CHECK_EQ(answer[17], 7);
	CHECK_EQ(line_discarded(line), 1);
	line_destroy(line);
}

TEST(line, flood_of_foreign_frames_costs_the_timeout_and_no_more)
{
	struct fake_wire wire = { .drop = 1, .flood_ns = 3000 };
	struct line *line = line_on(&wire);
	uint8_t answer[LIMIT_FRAME_BYTES];

	CHECK_EQ(ask_status(line, answer), -ETIMEDOUT);
	CHECK(wire.now_ns >= 2000000 && wire.now_ns <= 2003000);
	CHECK_EQ(line_discarded(line), wire.flooded);
	CHECK_EQ(ask_status(line, answer), 60);
	line_destroy(line);
}

static void shorten(struct fake_wire *wire, uint8_t *frame, size_t len)
{
	(void)wire;
	fake_pass_slave(frame, len);
	frame[14] = (uint8_t)(frame[14] - 1);
}

static void mirror(struct fake_wire *wire, uint8_t *frame, size_t len)
{
	(void)wire;
	(void)frame;
	(void)len;
}

static void readdress(struct fake_wire *wire, uint8_t *frame, size_t len)
{
	(void)wire;
	fake_pass_slave(frame, len);
	frame[20] ^= 0x40;
}

static void check_refused(void (*answer_fn)(struct fake_wire *, uint8_t *, size_t))
{
	struct fake_wire wire = { .answer = answer_fn };
	struct line *line = line_on(&wire);
	uint8_t answer[LIMIT_FRAME_BYTES];

	CHECK_EQ(ask_status(line, answer), -ETIMEDOUT);
	CHECK_EQ(line_discarded(line), 1);
	line_destroy(line);
}

TEST(line, answer_of_another_length_is_refused)
{
	check_refused(shorten);
}

TEST(line, own_frame_mirrored_is_not_an_answer)
{
	check_refused(mirror);
}

TEST(line, answer_from_another_register_is_refused)
{
	check_refused(readdress);
}

TEST(line, broadcast_answer_may_carry_a_counted_position)
{
	struct fake_wire wire = { .drop = 1 };
	struct line *line = line_on(&wire);
	uint8_t frame[LIMIT_FRAME_BYTES];
	uint8_t back[LIMIT_FRAME_BYTES];
	uint8_t answer[LIMIT_FRAME_BYTES];
	size_t len = make_frame(frame, ECAT_CMD_BRD, 3, 0, 0);

	memcpy(back, frame, len);
	fake_pass_slave(back, len);
	back[18] = 3;
	fake_queue(&wire, back, len, 10);
	CHECK_EQ(line_transact(line, frame, len, answer, sizeof(answer), (span_t){ 2000000 }), len);
	line_destroy(line);
}

TEST(line, interface_down_is_reported_after_the_timeout)
{
	struct fake_wire wire = { .send_error = -ENETDOWN };
	struct line *line = line_on(&wire);
	uint8_t frame[LIMIT_FRAME_BYTES];
	uint8_t answer[LIMIT_FRAME_BYTES];
	size_t len = make_frame(frame, ECAT_CMD_BRD, 0, 0, 0);

	CHECK_EQ(line_transact(line, frame, len, answer, sizeof(answer), (span_t){ 2000000 }),
		 -ENETDOWN);
	CHECK_EQ(wire.now_ns, 2000000);
	CHECK_EQ(line_transact(line, frame, 10, answer, sizeof(answer), (span_t){ 2000000 }),
		 -EINVAL);
	line_destroy(line);
}

/* --- riding, one thread: the waiter is the cycle --- */

struct ride {
	struct fake_wire *wire;
	struct line *line;
	unsigned cycles;
	unsigned taken;
	unsigned deaf; /* cycles that leave the answer on the wire */
};

static void one_cycle(void *ctx, mono_t until)
{
	struct ride *ride = ctx;
	uint8_t frame[LIMIT_FRAME_BYTES];
	const struct transport *tp = line_transport(ride->line);
	const uint8_t *out;
	size_t len;
	int r;

	ride->cycles++;
	ride->wire->now_ns += 1000000;
	if (ride->wire->now_ns > until.ns) {
		ride->wire->now_ns = until.ns;
	}
	out = line_ride_take(ride->line, &len);
	if (out != NULL) {
		ride->taken++;
		tp->send(tp->ctx, out, len);
	}
	if (ride->deaf > 0) {
		ride->deaf--;
		return;
	}
	r = tp->receive(tp->ctx, frame, sizeof(frame), (mono_t){ ride->wire->now_ns + 100000 },
			NULL);
	if (r > 0) {
		line_ride_answer(ride->line, frame, (size_t)r);
	}
}

TEST(line, riding_frame_is_sent_by_the_cycle_and_answered)
{
	struct fake_wire wire = { 0 };
	struct ride ride = { .wire = &wire, .line = line_on(&wire), .deaf = 3 };
	uint8_t frame[LIMIT_FRAME_BYTES];
	uint8_t answer[LIMIT_FRAME_BYTES];
	size_t len = make_frame(frame, ECAT_CMD_FPRD, 9, 0x1001, ESC_REG_AL_STATUS);

	line_ride_begin(ride.line, (struct line_waiter){ one_cycle, &ride });
	CHECK_EQ(line_transact(ride.line, frame, len, answer, sizeof(answer), (span_t){ 2000000 }),
		 len);
	CHECK_EQ(ride.taken, 1);
	CHECK_EQ(ride.cycles, 4);
	CHECK_EQ(line_ride_is_out(ride.line), 0);
	line_ride_end(ride.line);
	CHECK_EQ(line_transact(ride.line, frame, len, answer, sizeof(answer), (span_t){ 2000000 }),
		 len);
	CHECK_EQ(ride.cycles, 4);
	line_destroy(ride.line);
}

TEST(line, riding_frame_that_is_lost_times_out_and_its_late_answer_does_no_harm)
{
	struct fake_wire wire = { .drop = 1 };
	struct ride ride = { .wire = &wire, .line = line_on(&wire) };
	uint8_t frame[LIMIT_FRAME_BYTES];
	uint8_t late[LIMIT_FRAME_BYTES];
	uint8_t answer[LIMIT_FRAME_BYTES];
	size_t len = make_frame(frame, ECAT_CMD_FPRD, 9, 0x1001, ESC_REG_AL_STATUS);

	line_ride_begin(ride.line, (struct line_waiter){ one_cycle, &ride });
	CHECK_EQ(line_transact(ride.line, frame, len, answer, sizeof(answer), (span_t){ 2000000 }),
		 -ETIMEDOUT);
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

	CHECK(line_ride_take(line, &len) == NULL);
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

/* --- riding, two threads: a cycle that echoes, with holes, against a service that gives up --- */

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
	atomic_fetch_add(&st->clock_ns, NS_PER_MS); /* a lost frame costs a hundred of these */
	sched_yield();
}

static void *stress_cycle(void *arg)
{
	struct stress *st = arg;
	uint8_t back[LIMIT_FRAME_BYTES];
	unsigned n = 0;

	while (!atomic_load(&st->stop)) {
		size_t len;
		const uint8_t *out = line_ride_take(st->line, &len);

		if (out == NULL) {
			sched_yield(); /* two threads, and maybe one core for them */
			continue;
		}
		if (n++ % 7 == 0) {
			continue;
		}
		memcpy(back, out, len);
		fake_pass_slave(back, len);
		line_ride_answer(st->line, back, len);
	}
	return NULL;
}

TEST(line, handover_between_two_threads_never_mixes_frames)
{
	struct stress st = { 0 };
	struct platform platform = { .now = stress_now, .ctx = &st };
	pthread_t cycle;
	unsigned answered = 0;

	CHECK_EQ(line_create(platform, (struct transport){ 0 }, &st.line), 0);
	line_ride_begin(st.line, (struct line_waiter){ stress_wait, &st });
	CHECK_EQ(pthread_create(&cycle, NULL, stress_cycle, &st), 0);
	for (unsigned i = 0; i < STRESS_FRAMES; i++) {
		uint8_t frame[LIMIT_FRAME_BYTES];
		uint8_t answer[LIMIT_FRAME_BYTES];
		size_t len = make_frame(frame, ECAT_CMD_FPRD, (uint8_t)i, (uint16_t)i, 0x0130);
		int r = line_transact(st.line, frame, len, answer, sizeof(answer), (span_t){ 0 });

		if (r > 0) {
			CHECK_EQ(get_le16(answer + 18), (uint16_t)i);
			answered++;
		} else {
			CHECK_EQ(r, -ETIMEDOUT);
		}
	}
	atomic_store(&st.stop, 1);
	pthread_join(cycle, NULL);
	CHECK(answered > 0);
	line_destroy(st.line);
}

TEST(line, each_try_waits_longer_than_the_one_before)
{
	struct fake_wire wire = { 0 };
	struct line *line = line_on(&wire);

	CHECK_EQ(line_timeout(line, 0).ns, 2 * NS_PER_MS);
	line_timeout_set(line, (span_t){ 20 * NS_PER_MS });
	CHECK_EQ(line_timeout(line, 0).ns, 20 * NS_PER_MS);
	CHECK_EQ(line_timeout(line, 1).ns, 100 * NS_PER_MS);
	CHECK_EQ(line_timeout(line, LINE_TRIES - 1).ns, 500 * NS_PER_MS);
	line_destroy(line);
}

static void count_call(void *ctx)
{
	(*(unsigned *)ctx)++;
}

TEST(line, the_keepalive_is_called_for_every_frame_and_pause_even_on_a_dead_wire)
{
	struct fake_wire wire = { .drop = 1 };
	struct line *line = line_on(&wire);
	uint8_t frame[LIMIT_FRAME_BYTES];
	uint8_t answer[LIMIT_FRAME_BYTES];
	size_t len = make_frame(frame, ECAT_CMD_BRD, 0, 0, 0);
	unsigned calls = 0;

	line_set_keepalive(line, count_call, &calls);
	CHECK_EQ(line_transact(line, frame, len, answer, sizeof(answer), (span_t){ NS_PER_MS }),
		 -ETIMEDOUT);
	CHECK_EQ(calls, 1);
	line_sleep(line, (span_t){ NS_PER_MS });
	CHECK_EQ(calls, 2);
	line_set_keepalive(line, NULL, NULL);
	line_sleep(line, (span_t){ NS_PER_MS });
	CHECK_EQ(calls, 2);
	line_destroy(line);
}
