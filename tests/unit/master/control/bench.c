/* SPDX-License-Identifier: MIT */
#include "bench.h"

#include "harness/test.h"

struct bench bench;

static const struct channel channels[] = {
	{ .name = "a.adc",
	  .type = CHANNEL_UINT,
	  .bit_len = 12,
	  .bit_offset = 64,
	  .scale = 0.5,
	  .offset = 1 },
	{ .name = "a.led",
	  .direction = CHANNEL_OUTPUT,
	  .type = CHANNEL_BOOL,
	  .bit_len = 1,
	  .scale = 1 },
	{ .name = "b.signed",
	  .slave_pos = 1,
	  .type = CHANNEL_INT,
	  .bit_len = 16,
	  .bit_offset = 80,
	  .scale = 1 },
	{ .name = "b.out12",
	  .slave_pos = 1,
	  .direction = CHANNEL_OUTPUT,
	  .type = CHANNEL_INT,
	  .bit_len = 12,
	  .bit_offset = 8,
	  .scale = 0.1 },
	{ .name = "b.f32",
	  .slave_pos = 1,
	  .direction = CHANNEL_OUTPUT,
	  .type = CHANNEL_FLOAT,
	  .bit_len = 32,
	  .bit_offset = 24,
	  .scale = 1 },
	{ .name = "b.foreign",
	  .slave_pos = 1,
	  .direction = CHANNEL_OUTPUT,
	  .type = CHANNEL_UINT,
	  .bit_len = 8,
	  .bit_offset = 56,
	  .scale = 1 },
};

static mono_t now(void *ctx)
{
	(void)ctx;
	bench.now_ns += bench.call_ns;
	bench.call_ns = 0;
	return (mono_t){ bench.now_ns };
}

static void set(const char *assignment)
{
	char error[256] = "";

	if (config_set(&bench.cfg, assignment, error, sizeof(error)) < 0) {
		test_fail(__FILE__, __LINE__, "%s", error);
	}
}

struct probe *bench_configure(void)
{
	memset(&bench, 0, sizeof(bench));
	bench.now_ns = 1000;
	bench.sample.cycle = 100;
	config_defaults(&bench.cfg);
	set("control.program=" PROBE_PATH);
	set("outputs[0].channel=a.led");
	set("outputs[0].owner=program");
	set("outputs[1].channel=b.out12");
	set("outputs[1].owner=program");
	set("outputs[1].min=-50");
	set("outputs[1].max=100");
	set("outputs[2].channel=b.f32");
	set("outputs[2].owner=program");
	return probe_use();
}

int bench_load(void)
{
	return control_load(&bench.cfg, &bench.control, bench.error, sizeof(bench.error));
}

int bench_begin(void)
{
	const struct control_spec spec = {
		.platform = { .now = now },
		.channels = channels,
		.channel_count = sizeof(channels) / sizeof(channels[0]),
		.slave_count = 2,
		.status = &bench.status,
	};
	int r = bench_load();

	return r < 0 ? r : control_begin(bench.control, &spec, bench.error, sizeof(bench.error));
}

enum control_result bench_run(void)
{
	bench.sample.cycle++;
	bench.sample.dc_time_ns = (int64_t)bench.sample.cycle * 1000000;
	return control_run(bench.control, &bench.sample, bench.image);
}

int bench_output(unsigned place, uint64_t *ret_raw)
{
	static struct board_set newest;

	newest.sequence = 0;
	CHECK_EQ(board_take(control_board(bench.control), BOARD_OUTPUTS, &newest), 1);
	*ret_raw = newest.raw[place];
	return newest.is_set[place];
}

void bench_done(void)
{
	control_destroy(bench.control);
	bench.control = NULL;
}
