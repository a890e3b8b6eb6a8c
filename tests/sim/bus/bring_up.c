/* SPDX-License-Identifier: MIT */
#include "harness/test.h"
#include "sim/bus/bus_bench.h"
#include "sim/devices/fb1111_piccolo.h"
#include "wire/esc_reg.h"

TEST(bring_up, two_piccolos_come_to_op_and_count)
{
	struct bus_bench *b = bench_create(&(struct bench_spec){
		.piccolos = 2, .ppm = { 100, -100 }, .host_ppm = 50, .seed = 1 });
	uint64_t before[2];

	bench_bring_up(b);
	CHECK_EQ(bus_plan(b->bus)->wkc_expected, 6);
	bench_run(b, 100);
	before[0] = bench_value(b, "piccolo0.counter");
	before[1] = bench_value(b, "piccolo1.counter");
	bench_run(b, 1000);
	CHECK_EQ((uint16_t)(bench_value(b, "piccolo0.counter") - before[0]), 1000);
	CHECK_EQ((uint16_t)(bench_value(b, "piccolo1.counter") - before[1]), 1000);
	CHECK_EQ(bench_value(b, "piccolo0.sample_time"), bench_value(b, "piccolo1.sample_time"));
	CHECK(bench_value(b, "piccolo0.adc") > 0);
	CHECK_EQ(bench_watch(b).is_all_op, 1);
	CHECK_EQ(bench_stop(b), 0);
	bench_destroy(b);
}
