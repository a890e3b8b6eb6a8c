/* SPDX-License-Identifier: MIT */
#include "cycle/dc_servo.h"

#include <math.h>
#include <stdlib.h>

#include "base/prng.h"
#include "harness/test.h"

#define PERIOD_NS 1000000

static const struct dc_servo_spec spec = {
	.period_ns = PERIOD_NS,
	.set_point_ns = PERIOD_NS / 2,
	.lock_limit_ns = 10000,
	.lock_cycles = 200,
	.unlock_limit_ns = 50000,
	.slew_ns = 20000,
	.kp = 0.02,
	.ki = 0.0001,
};

/* A host whose clock runs @ppm fast against the reference, waking late by up to @latency_ns. */
struct plant {
	struct dc_servo servo;
	struct prng prng;
	double host_ns; /* deadline, on the reference's time axis */
	double ppm;
	int64_t latency_ns;
	double held_share; /* of the frames: held up on the way to the reference */
	int64_t held_ns;   /* by up to this */
};

static struct dc_servo_result turn(struct plant *p)
{
	int64_t late =
		p->latency_ns > 0 ? (int64_t)prng_below(&p->prng, (uint64_t)p->latency_ns) : 0;
	int64_t held = p->held_share > 0 && prng_unit(&p->prng) < p->held_share
			       ? (int64_t)prng_below(&p->prng, (uint64_t)p->held_ns)
			       : 0;
	struct dc_servo_result r =
		dc_servo_update(&p->servo, (int64_t)p->host_ns + late + held, late);

	p->host_ns += (double)(PERIOD_NS + r.correction_ns) * (1.0 + p->ppm * 1e-6);
	return r;
}

static struct plant make_plant(uint64_t seed, double start_ns, double ppm, int64_t latency_ns)
{
	struct plant p = {
		.prng = { seed }, .host_ns = start_ns, .ppm = ppm, .latency_ns = latency_ns
	};

	dc_servo_init(&p.servo, &spec);
	return p;
}

TEST(dc_servo, it_locks_within_a_second_from_any_phase_and_any_drift)
{
	for (uint64_t seed = 0; seed < 200; seed++) {
		struct prng prng = { seed };
		double start = 1e9 + (double)prng_below(&prng, PERIOD_NS);
		double ppm = (prng_unit(&prng) - 0.5) * 400.0;
		struct plant p = make_plant(seed, start, ppm, 80000);
		unsigned cycles = 0;

		while (p.servo.state != DC_LOCKED) {
			turn(&p);
			CHECK(++cycles < 1000);
		}
		for (unsigned i = 0; i < 2000; i++) {
			turn(&p);
		}
		for (unsigned i = 0; i < 1000; i++) {
			CHECK(llabs(turn(&p).error_ns) < 1000);
		}
		CHECK_EQ(p.servo.state, DC_LOCKED);
	}
}

TEST(dc_servo, a_late_wake_is_not_mistaken_for_drift)
{
	struct plant p = make_plant(1, 1e9, 0, 0);

	for (unsigned i = 0; i < 2000; i++) {
		turn(&p);
	}
	p.latency_ns = 400000;
	for (unsigned i = 0; i < 100; i++) {
		CHECK(llabs(turn(&p).error_ns) <= 1);
	}
}

/* Always late: if used, one frame in ten would be 100 ppm. */
TEST(dc_servo, frames_held_up_on_their_way_delay_no_lock_and_shift_no_frequency)
{
	for (uint64_t seed = 0; seed < 100; seed++) {
		struct prng prng = { seed };
		double start = 1e9 + (double)prng_below(&prng, PERIOD_NS);
		double ppm = (prng_unit(&prng) - 0.5) * 200.0;
		struct plant p = make_plant(seed, start, ppm, 80000);
		double off_ppm = 0;
		unsigned cycles = 0;

		p.held_share = 0.25;
		p.held_ns = 300000;
		while (p.servo.state != DC_LOCKED) {
			turn(&p);
			CHECK(++cycles < 2000);
		}
		for (unsigned i = 0; i < 1000; i++) {
			turn(&p);
		}
		for (unsigned i = 0; i < 2000; i++) {
			turn(&p);
			off_ppm += p.servo.integral_ns * 1e6 / PERIOD_NS + ppm;
		}
		CHECK(fabs(off_ppm / 2000) < 5.0);
		CHECK_EQ(p.servo.state, DC_LOCKED);
	}
}

TEST(dc_servo, one_wild_frame_moves_the_deadline_by_less_than_two_microseconds)
{
	struct plant p = make_plant(1, 1e9, 0, 0);
	struct dc_servo_result r;

	for (unsigned i = 0; i < 2000; i++) {
		turn(&p);
	}
	r = dc_servo_update(&p.servo, (int64_t)p.host_ns + 300000, 0);
	CHECK(llabs(r.correction_ns) < 2000);
	CHECK_EQ(p.servo.state, DC_LOCKED);
}

TEST(dc_servo, it_keeps_the_frequency_over_an_outage_and_reports_the_loss_of_lock)
{
	struct plant p = make_plant(7, 1e9, 80.0, 0);
	double before;

	for (unsigned i = 0; i < 5000; i++) {
		turn(&p);
	}
	before = p.host_ns;
	for (unsigned i = 0; i < 150; i++) {
		struct dc_servo_result r = dc_servo_coast(&p.servo);

		p.host_ns += (double)(PERIOD_NS + r.correction_ns) * (1.0 + p.ppm * 1e-6);
	}
	CHECK(fabs(p.host_ns - before - 150.0 * PERIOD_NS) < 500.0);
	CHECK_EQ(p.servo.state, DC_LOCKED);
	for (unsigned i = 0; i < 100; i++) {
		dc_servo_coast(&p.servo);
	}
	CHECK_EQ(p.servo.state, DC_LOST);
}

/* How far the deadline walks off in @cycles without a measurement, at @ppm. */
static double walk_without_reference(double ppm, unsigned cycles)
{
	struct plant p = make_plant(11, 1e9, ppm, 0);
	double before;

	for (unsigned i = 0; i < 20000; i++) {
		turn(&p);
	}
	CHECK_EQ(p.servo.state, DC_LOCKED);
	before = p.host_ns;
	for (unsigned i = 0; i < cycles; i++) {
		struct dc_servo_result r = dc_servo_coast(&p.servo);

		p.host_ns += (double)(PERIOD_NS + r.correction_ns) * (1.0 + p.ppm * 1e-6);
	}
	CHECK_EQ(p.servo.state, DC_LOST);
	/* The frequency, not the phase, is what was learnt: relock is a jump and no search. */
	for (unsigned i = 0; i < spec.lock_cycles + 1; i++) {
		turn(&p);
		CHECK_EQ(p.servo.state, i < spec.lock_cycles ? DC_LOST : DC_LOCKED);
	}
	return fabs(p.host_ns - before - (double)(cycles + spec.lock_cycles + 1) * PERIOD_NS);
}

TEST(dc_servo, without_a_reference_for_minutes_the_frequency_stays)
{
	CHECK(walk_without_reference(80.0, 1000) < 1000.0);
	CHECK(walk_without_reference(80.0, 60000) < 60000.0);
	CHECK(walk_without_reference(-120.0, 60000) < 60000.0);
}

TEST(dc_servo, a_step_of_the_reference_loses_the_lock_and_finds_it_again)
{
	struct plant p = make_plant(3, 1e9, -50.0, 20000);
	unsigned cycles = 0;
	int was_lost = 0;

	for (unsigned i = 0; i < 3000; i++) {
		turn(&p);
	}
	p.host_ns += 333333;
	do {
		turn(&p);
		was_lost |= p.servo.state == DC_LOST;
		CHECK(++cycles < 2000);
	} while (!was_lost || p.servo.state != DC_LOCKED);
}

/* Beyond what one frame counts for, and too near for a jump. */
TEST(dc_servo, a_step_of_80_microseconds_is_followed_without_losing_the_lock)
{
	for (int sign = -1; sign <= 1; sign += 2) {
		struct plant p = make_plant(4, 1e9, 30.0, 20000);

		for (unsigned i = 0; i < 3000; i++) {
			turn(&p);
		}
		p.host_ns += sign * 80000;
		for (unsigned i = 0; i < 1000; i++) {
			turn(&p);
			CHECK_EQ(p.servo.state, DC_LOCKED);
		}
		CHECK(llabs(turn(&p).error_ns) < 1000);
	}
}

TEST(dc_servo, corrections_never_exceed_the_slew_after_the_first_jump)
{
	struct plant p = make_plant(9, 1e9 + 700000, 100.0, 300000);

	turn(&p);
	for (unsigned i = 0; i < 1000; i++) {
		CHECK(llabs(turn(&p).correction_ns) <= spec.slew_ns + 1);
	}
}

TEST(dc_servo, a_reference_time_that_is_pure_noise_is_never_locked_to)
{
	struct prng prng = { 5 };
	struct dc_servo servo;

	dc_servo_init(&servo, &spec);
	for (unsigned i = 0; i < 20000; i++) {
		dc_servo_update(&servo, (int64_t)prng_below(&prng, 1000000000), 0);
		CHECK_EQ(servo.state, DC_ACQUIRING);
	}
}
