/* SPDX-License-Identifier: MIT */
#include "coupler.h"

#include "devices/wago_750_354.h"
#include "harness/test.h"

static double signal_hz;

int coupler_make(int position, struct segment_slave_spec *ret_spec)
{
	int r = wago_750_354_by_name(position, "wago_750_354", ret_spec);

	ret_spec->signal.frequency_hz = signal_hz;
	ret_spec->signal.amplitude_v = 4.0;
	return r;
}

void coupler_bench_init(struct virtual_bench *bench, double frequency_hz)
{
	signal_hz = frequency_hz;
	virtual_bench_init(bench,
			   &(struct virtual_spec){
				   .slaves = 1, .make = coupler_make, .ppm = { 60 }, .seed = 3 });
}

void coupler_bring_up(struct virtual_master *vm, struct virtual_bench *bench,
		      const char *const *settings)
{
	virtual_master_init(vm, bench, settings);
	if (virtual_master_bring_up(vm) < 0) {
		test_fail(__FILE__, __LINE__, "%s", vm->failure.text);
	}
}

int coupler_get(const struct virtual_bench *bench, enum coupler_slot slot, unsigned channel)
{
	int value = 0;

	CHECK_EQ(wago_750_354_get(segment_device(bench->segment, 0), slot, channel, &value), 0);
	return value;
}

void coupler_set(const struct virtual_bench *bench, enum coupler_slot slot, unsigned channel,
		 int is_on)
{
	CHECK_EQ(wago_750_354_set(segment_device(bench->segment, 0), slot, channel, is_on), 0);
}
