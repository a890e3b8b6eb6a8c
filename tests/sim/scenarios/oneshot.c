/* SPDX-License-Identifier: MIT */
/* Outputs and one-shot conversions, through the admin socket as `ecdaq` uses it. */
#include <errno.h>

#include "devices/fb1111_piccolo.h"
#include "harness/test.h"
#include "sim/harness/virtual_master.h"

enum { STATUS_ONESHOT = 1, STATUS_ARMED = 2 };

static const char *const oneshot_mode[] = { "slaves[0].name=a", "slaves[1].name=b",
					    "slaves[0].mode=oneshot", "slaves[1].mode=oneshot",
					    NULL };
static const char *const periodic_mode[] = { "slaves[0].name=a", "slaves[1].name=b",
					     "slaves[0].mode=periodic", "slaves[1].mode=periodic",
					     NULL };

static struct virtual_bench b;
static struct virtual_master vm;

static void open_all(const char *const *settings)
{
	virtual_bench_init(&b, &(struct virtual_spec){ .ppm = { 100, -100 }, .seed = 21 });
	virtual_master_init(&vm, &b, settings);
	if (virtual_master_bring_up(&vm) < 0) {
		test_fail(__FILE__, __LINE__, "%s", vm.failure.text);
	}
	virtual_master_run(&vm, 2000);
}

static void close_all(void)
{
	virtual_master_close(&vm);
}

static struct admin_reply fire(uint16_t slave_pos, uint8_t is_relative, int64_t time_ns)
{
	struct admin_request rq = { .magic = ADMIN_MAGIC,
				    .verb = ADMIN_ONESHOT,
				    .slave_pos = slave_pos,
				    .is_relative = is_relative,
				    .dc_time_ns = time_ns };

	return virtual_master_ask(&vm, &rq);
}

static struct admin_reply set(const char *channel, uint64_t raw)
{
	struct admin_request rq = { .magic = ADMIN_MAGIC, .verb = ADMIN_SET, .count = 1 };

	snprintf(rq.item[0].channel, sizeof(rq.item[0].channel), "%s", channel);
	rq.item[0].raw = raw;
	return virtual_master_ask(&vm, &rq);
}

static void check_fired(unsigned slave, const char *name, uint64_t at_ns)
{
	char channel[64];
	struct signal_spec signal = signal_default();

	CHECK_EQ(b.scope.system_ns[slave], at_ns);
	snprintf(channel, sizeof(channel), "%s.sample_time", name);
	CHECK_EQ(virtual_master_value(&vm, channel), at_ns);
	snprintf(channel, sizeof(channel), "%s.adc", name);
	CHECK_EQ(virtual_master_value(&vm, channel), signal_adc(&signal, b.scope.edge_ns[slave]));
	snprintf(channel, sizeof(channel), "%s.status", name);
	CHECK_EQ(virtual_master_value(&vm, channel) & (STATUS_ONESHOT | STATUS_ARMED),
		 STATUS_ONESHOT);
}

TEST(sim_oneshot, sync0_fires_once_at_that_dc_time_in_both_slaves)
{
	struct admin_reply first;
	struct admin_reply second;
	uint64_t edges[2];

	open_all(oneshot_mode);
	edges[0] = b.scope.edges[0];
	edges[1] = b.scope.edges[1];
	virtual_bench_measure(&b);
	first = fire(0, 1, 300 * NS_PER_MS);
	CHECK_EQ(first.result, 0);
	second = fire(1, 0, first.dc_time_ns);
	CHECK_EQ(second.result, 0);
	CHECK_EQ(second.dc_time_ns, first.dc_time_ns);
	virtual_master_run(&vm, 400);
	CHECK_EQ(b.scope.edges[0], edges[0] + 1);
	CHECK_EQ(b.scope.edges[1], edges[1] + 1);
	check_fired(0, "a", (uint64_t)first.dc_time_ns);
	check_fired(1, "b", (uint64_t)first.dc_time_ns);
	printf("one-shot SYNC0 of both slaves %lld ns apart\n",
	       (long long)llabs(b.scope.edge_ns[0] - b.scope.edge_ns[1]));
	CHECK(llabs(b.scope.edge_ns[0] - b.scope.edge_ns[1]) <= 100);
	CHECK_EQ(vm.result.gaps, 0);
	close_all();
}

TEST(sim_oneshot, one_shot_after_one_shot_each_fires_once)
{
	open_all(oneshot_mode);
	for (int i = 0; i < 5; i++) {
		uint64_t edges = b.scope.edges[1];
		struct admin_reply reply = fire(1, 1, 100 * NS_PER_MS);

		CHECK_EQ(reply.result, 0);
		virtual_master_run(&vm, 150);
		CHECK_EQ(b.scope.edges[1], edges + 1);
		check_fired(1, "b", (uint64_t)reply.dc_time_ns);
	}
	CHECK_EQ(b.scope.edges[0], 0);
	close_all();
}

TEST(sim_oneshot, a_time_in_the_past_or_too_near_is_refused_and_nothing_fires)
{
	struct admin_reply reply;
	int64_t past_ns;

	open_all(oneshot_mode);
	past_ns = virtual_master_sample(&vm)->frame_dc_ns;
	reply = fire(0, 0, past_ns);
	CHECK_EQ(reply.result, -ETIME);
	CHECK(strstr(reply.text, "in the past") != NULL);
	CHECK_EQ(fire(0, 1, 2 * NS_PER_MS).result, -ETIME);
	CHECK_EQ(fire(0, 1, -NS_PER_S).result, -ETIME);
	CHECK_EQ(fire(5, 1, NS_PER_S).result, -ENODEV);
	virtual_master_run(&vm, 100);
	CHECK_EQ(b.scope.edges[0], 0);
	CHECK_EQ(atomic_load(&session_page(vm.session)->bus_state), BUS_OP);
	close_all();
}

TEST(sim_oneshot, a_periodic_slave_takes_no_one_shot)
{
	struct admin_reply reply;

	open_all(periodic_mode);
	reply = fire(0, 1, NS_PER_S);
	CHECK_EQ(reply.result, -EOPNOTSUPP);
	CHECK(strstr(reply.text, "periodic mode") != NULL);
	close_all();
}

static void check_led_follows(void)
{
	struct admin_reply reply = set("b.led", 1);
	uint64_t cycle;

	CHECK_EQ(reply.result, 0);
	cycle = reply.cycle;
	CHECK(cycle > 0 && cycle <= virtual_master_sample(&vm)->cycle);
	virtual_master_run(&vm, 50);
	CHECK_EQ(virtual_master_value(&vm, "b.led"), 1);
	CHECK_EQ(fb1111_piccolo_led(segment_device(b.segment, 1)), 1);
	CHECK_EQ(fb1111_piccolo_led(segment_device(b.segment, 0)), 0);
	CHECK_EQ(set("b.led", 0).result, 0);
	virtual_master_run(&vm, 50);
	CHECK_EQ(fb1111_piccolo_led(segment_device(b.segment, 1)), 0);
}

TEST(sim_oneshot, the_led_is_set_in_both_modes)
{
	open_all(periodic_mode);
	check_led_follows();
	close_all();
	open_all(oneshot_mode);
	check_led_follows();
	close_all();
}

TEST(sim_oneshot, the_led_is_dark_after_an_orderly_stop)
{
	open_all(periodic_mode);
	CHECK_EQ(set("a.led", 1).result, 0);
	virtual_master_run(&vm, 50);
	CHECK_EQ(fb1111_piccolo_led(segment_device(b.segment, 0)), 1);
	CHECK_EQ(virtual_master_stop(&vm), 0);
	segment_advance(b.segment, virtual_bench_now_ns(&b) + 200 * NS_PER_MS);
	CHECK_EQ(fb1111_piccolo_led(segment_device(b.segment, 0)), 0);
	close_all();
}

TEST(sim_oneshot, sdo_requests_ride_along_and_leave_the_samples_alone)
{
	struct admin_request rq = {
		.magic = ADMIN_MAGIC, .verb = ADMIN_SDO_READ, .index = 0x8000, .subindex = 2
	};
	struct admin_reply reply;

	open_all(periodic_mode);
	virtual_master_forget(&vm);
	for (int i = 0; i < 20; i++) {
		rq.slave_pos = (uint16_t)(i % 2);
		reply = virtual_master_ask(&vm, &rq);
		CHECK_EQ(reply.result, 0);
		CHECK_EQ(reply.data_len, 2);
		CHECK_EQ(reply.data[0], 10);
	}
	rq.index = 0x9999;
	reply = virtual_master_ask(&vm, &rq);
	CHECK(reply.result < 0);
	CHECK_EQ(reply.slave_code, 0x06020000);
	CHECK_EQ(vm.result.bad, 0);
	CHECK_EQ(vm.result.lost, 0);
	close_all();
}
