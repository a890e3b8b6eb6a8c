/* SPDX-License-Identifier: MIT */
/* The segment as a master's platform and transport on virtual time. */
#include "segment/in_process.h"

#include <errno.h>
#include <time.h>

#include "bench.h"
#include "harness/test.h"
#include "wire/esc_reg.h"

enum { CYCLE_NS = 1000000, WIRE_NS = 4000, FRAMES = 3000 };

struct host {
	struct bench *bench;
	struct fault_plan *faults;
	struct in_process *ip;
	struct platform platform;
	struct transport transport;
};

static struct host make_host(uint64_t seed, double host_ppm, const char *fault)
{
	struct host h = { .bench = bench_create(
				  (struct bench_slave[]){
					  { .pdi = 5, .config = 0x0c, .ppm = 40 },
					  { .pdi = 5, .config = 0x0c, .ppm = -70 } },
				  2) };
	struct in_process_spec spec = { .segment = h.bench->segment,
					.seed = seed,
					.host_ppm = host_ppm,
					.tai_start_ns = 1000,
					.wake_sigma_ns = 2000,
					.wake_spike_ns = 50000,
					.spikes_per_million = 1000,
					.transmit_ns = WIRE_NS };
	char error[64];

	if (fault != NULL) {
		h.faults = fault_plan_create(seed, 0);
		CHECK_EQ(fault_plan_add(h.faults, fault, 2, error, sizeof(error)), 0);
		spec.faults = h.faults;
	}
	CHECK_EQ(in_process_create(&spec, &h.ip), 0);
	h.platform = in_process_platform(h.ip);
	h.transport = in_process_transport(h.ip);
	return h;
}

static void end_host(struct host *h)
{
	in_process_destroy(h->ip);
	fault_plan_destroy(h->faults);
	bench_destroy(h->bench);
}

static mono_t after(mono_t t, int64_t ns)
{
	return (mono_t){ t.ns + ns };
}

static size_t make_frame(uint8_t *frame, uint8_t idx)
{
	static const uint8_t source[6] = { 0x10 };
	struct ecat_frame_builder fb;

	ecat_frame_begin(&fb, frame, source);
	CHECK(ecat_frame_add(&fb, ECAT_CMD_FRMW, idx, BENCH_STATION, ESC_REG_DC_SYSTEM_TIME, 8));
	CHECK(ecat_frame_add(&fb, ECAT_CMD_BRD, idx, 0, ESC_REG_AL_STATUS, 2));
	return ecat_frame_end(&fb);
}

/* FNV-1a over what came back, when, and when the host woke. */
static uint64_t digest(uint64_t hash, const void *data, size_t len)
{
	const uint8_t *bytes = data;

	for (size_t i = 0; i < len; i++) {
		hash = (hash ^ bytes[i]) * UINT64_C(0x100000001b3);
	}
	return hash;
}

static uint64_t run(uint64_t seed, const char *fault)
{
	struct host h = make_host(seed, 30.0, fault);
	mono_t deadline = h.platform.now(h.platform.ctx);
	uint64_t hash = UINT64_C(0xcbf29ce484222325);

	for (int n = 0; n < FRAMES; n++) {
		uint8_t frame[ECAT_FRAME_MAX_BYTES];
		size_t len = make_frame(frame, (uint8_t)n);
		mono_t now;
		int got;

		deadline.ns += CYCLE_NS;
		CHECK_EQ(h.platform.sleep_until(h.platform.ctx, deadline), 0);
		CHECK_EQ(h.transport.send(h.transport.ctx, frame, len), 0);
		got = h.transport.receive(h.transport.ctx, frame, sizeof(frame),
					  after(deadline, CYCLE_NS / 2), &now);
		now = h.platform.now(h.platform.ctx);
		hash = digest(hash, &now, sizeof(now));
		hash = digest(hash, &got, sizeof(got));
		hash = digest(hash, frame, got > 0 ? (size_t)got : 0);
	}
	end_host(&h);
	return hash;
}

TEST(in_process, the_same_seed_gives_the_same_bytes_at_the_same_times)
{
	CHECK_EQ(run(1, "p=0.05 lose"), run(1, "p=0.05 lose"));
	CHECK(run(1, "p=0.05 lose") != run(2, "p=0.05 lose"));
	CHECK(run(1, NULL) != run(1, "frame=100 lose"));
}

TEST(in_process, a_frame_comes_back_after_wire_slaves_and_its_own_length)
{
	struct host h = make_host(1, 0.0, NULL);
	uint8_t frame[ECAT_FRAME_MAX_BYTES];
	size_t len = make_frame(frame, 1);
	mono_t sent = h.platform.now(h.platform.ctx);
	mono_t at;

	CHECK_EQ(h.transport.send(h.transport.ctx, frame, len), 0);
	CHECK_EQ(in_process_in_flight(h.ip), 1);
	CHECK_EQ(h.transport.receive(h.transport.ctx, frame, sizeof(frame), after(sent, CYCLE_NS),
				     &at),
		 (long long)len);
	/* 80 ns a byte with preamble, check sum and gap; two slaves: 5+150+5+150+5+140+5. */
	CHECK_EQ(at.ns - sent.ns, 2 * WIRE_NS + (int64_t)(len + 24) * 80 + 460);
	CHECK_EQ(in_process_in_flight(h.ip), 0);
	end_host(&h);
}

TEST(in_process, receiving_waits_until_its_deadline_and_no_longer)
{
	struct host h = make_host(1, 0.0, NULL);
	uint8_t frame[ECAT_FRAME_MAX_BYTES];
	mono_t now = h.platform.now(h.platform.ctx);
	size_t len = make_frame(frame, 1);

	CHECK_EQ(h.transport.receive(h.transport.ctx, frame, sizeof(frame), after(now, 7000), NULL),
		 -EAGAIN);
	CHECK_EQ(h.platform.now(h.platform.ctx).ns, now.ns + 7000);
	/* A deadline in the past looks once. */
	CHECK_EQ(h.transport.receive(h.transport.ctx, frame, sizeof(frame), now, NULL), -EAGAIN);
	CHECK_EQ(h.platform.now(h.platform.ctx).ns, now.ns + 7000);
	CHECK_EQ(h.transport.send(h.transport.ctx, frame, len), 0);
	CHECK_EQ(h.transport.receive(h.transport.ctx, frame, sizeof(frame), now, NULL), -EAGAIN);
	CHECK_EQ(h.transport.send(h.transport.ctx, frame, ECAT_FRAME_MAX_BYTES + 1), -EMSGSIZE);
	end_host(&h);
}

TEST(in_process, faults_lose_delay_and_double_what_comes_back)
{
	struct host h = make_host(1, 0.0, "frame=1 lose");
	uint8_t frame[ECAT_FRAME_MAX_BYTES];
	size_t len = make_frame(frame, 1);
	mono_t sent;
	mono_t at;
	char error[64];

	CHECK_EQ(fault_plan_add(h.faults, "frame=2 delay by=5ms", 2, error, sizeof(error)), 0);
	CHECK_EQ(fault_plan_add(h.faults, "frame=3 double", 2, error, sizeof(error)), 0);
	CHECK_EQ(h.transport.send(h.transport.ctx, frame, len), 0);
	CHECK_EQ(in_process_in_flight(h.ip), 0);
	sent = h.platform.now(h.platform.ctx);
	CHECK_EQ(h.transport.send(h.transport.ctx, frame, len), 0);
	CHECK_EQ(h.transport.send(h.transport.ctx, frame, len), 0);
	CHECK_EQ(in_process_in_flight(h.ip), 3);
	/* The doubled one overtakes the delayed one. */
	for (int n = 0; n < 2; n++) {
		CHECK(h.transport.receive(h.transport.ctx, frame, sizeof(frame),
					  after(sent, CYCLE_NS), &at) > 0);
		CHECK(at.ns - sent.ns < 100000);
	}
	CHECK(h.transport.receive(h.transport.ctx, frame, sizeof(frame), after(sent, 10 * CYCLE_NS),
				  &at) > 0);
	CHECK(at.ns - sent.ns > 5000000);
	end_host(&h);
}

TEST(in_process, a_stall_delays_one_wake_and_a_step_of_the_wall_clock_none)
{
	struct host h = make_host(1, 0.0, NULL);
	mono_t start = h.platform.now(h.platform.ctx);
	int64_t tai = h.platform.tai_ns(h.platform.ctx);

	in_process_stall(h.ip, 3 * CYCLE_NS);
	h.platform.sleep_until(h.platform.ctx, after(start, CYCLE_NS));
	CHECK(h.platform.now(h.platform.ctx).ns - start.ns >= 4 * CYCLE_NS);
	h.platform.sleep_until(h.platform.ctx, after(start, 5 * CYCLE_NS));
	CHECK(h.platform.now(h.platform.ctx).ns - start.ns < 5 * CYCLE_NS + 100000);
	in_process_step_tai(h.ip, -3600 * INT64_C(1000000000));
	CHECK(h.platform.now(h.platform.ctx).ns - start.ns < 5 * CYCLE_NS + 100000);
	CHECK_EQ(h.platform.tai_ns(h.platform.ctx) - tai,
		 h.platform.now(h.platform.ctx).ns - start.ns - 3600 * INT64_C(1000000000));
	end_host(&h);
}

TEST(in_process, the_hosts_clock_runs_off_true_time_by_its_ppm)
{
	struct host h = make_host(1, 100.0, NULL);
	mono_t hour = { INT64_C(3600000000000) };

	CHECK_EQ(in_process_true_ns(h.ip, hour), hour.ns + 360000000);
	end_host(&h);
}

TEST(in_process, ten_seconds_of_bus_time_pass_in_a_fraction_of_a_second)
{
	struct host h = make_host(1, 20.0, NULL);
	mono_t deadline = h.platform.now(h.platform.ctx);
	struct timespec start;
	struct timespec end;
	double seconds;

	clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &start);
	for (int n = 0; n < 10000; n++) {
		uint8_t frame[ECAT_FRAME_MAX_BYTES];
		size_t len = make_frame(frame, (uint8_t)n);

		deadline.ns += CYCLE_NS;
		h.platform.sleep_until(h.platform.ctx, deadline);
		CHECK_EQ(h.transport.send(h.transport.ctx, frame, len), 0);
		CHECK(h.transport.receive(h.transport.ctx, frame, sizeof(frame),
					  after(deadline, CYCLE_NS / 2), NULL) > 0);
	}
	clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &end);
	seconds =
		(double)(end.tv_sec - start.tv_sec) + (double)(end.tv_nsec - start.tv_nsec) * 1e-9;
	printf("10 s of bus time, two slaves, in %.3f s of CPU time: %.0f times as fast\n", seconds,
	       10.0 / seconds);
	/* The promise is 20 times; sanitizers are let off with one. */
	CHECK(seconds < 10.0);
	end_host(&h);
}
