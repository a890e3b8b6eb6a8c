/* SPDX-License-Identifier: MIT */
/* Limits of outputs, as raw values on the wire. */
#include "cycle/outputs.h"

#include "harness/test.h"
#include "image/image.h"

/* 12 bits in steps of 0.1: -204.8 to 204.7. */
static const struct channel valve = { .name = "a.valve",
				      .direction = CHANNEL_OUTPUT,
				      .type = CHANNEL_INT,
				      .bit_len = 12,
				      .scale = 0.1 };
static struct config cfg;
static struct board board;
static struct outputs outputs;

static void start(double min, double max)
{
	char error[128] = "";
	struct cycle_spec spec = { .cfg = &cfg,
				   .channels = &valve,
				   .channel_count = 1,
				   .boards = { [CYCLE_WRITER_LOCAL] = &board } };

	memset(&cfg, 0, sizeof(cfg));
	cfg.cycle_period_ns = 1000000;
	cfg.output_count = 1;
	cfg.output[0] = (struct config_output){ .channel = "a.valve", .min = min, .max = max };
	board_init(&board);
	CHECK_EQ(outputs_init(&outputs, &spec, error, sizeof(error)), 0);
}

/* What goes out when @physical is commanded, in tenths. */
static int sent(double physical)
{
	uint8_t image[2] = { 0 };
	uint64_t raw;

	CHECK_EQ(image_physical_to_raw(&valve, physical, &raw), 0);
	board_begin(&board);
	board_put(&board, 0, raw);
	board_commit(&board);
	CHECK_EQ(outputs_choose(&outputs, image, 1), 0);
	raw = image_get_raw(image, &valve);
	return raw & 0x800 ? (int)raw - 0x1000 : (int)raw;
}

TEST(outputs, a_value_beyond_a_limit_goes_out_as_the_limit)
{
	start(-50, 100);
	CHECK_EQ(sent(-80), -500);
	CHECK_EQ(sent(-50.1), -500);
	CHECK_EQ(sent(-50), -500);
	CHECK_EQ(sent(-49.9), -499);
	CHECK_EQ(sent(100), 1000);
	CHECK_EQ(sent(100.1), 1000);
	CHECK_EQ(sent(204.7), 1000);
}

TEST(outputs, a_limit_that_the_channel_cannot_reach_does_not_limit)
{
	start(-1e9, 1e9);
	CHECK_EQ(sent(-204.8), -2048);
	CHECK_EQ(sent(204.7), 2047);
}

TEST(outputs, a_limit_of_one_side_leaves_the_other_side_alone)
{
	start(-50, 1e9);
	CHECK_EQ(sent(-80), -500);
	CHECK_EQ(sent(204.7), 2047);
	start(-1e9, 100);
	CHECK_EQ(sent(-204.8), -2048);
	CHECK_EQ(sent(150), 1000);
}
