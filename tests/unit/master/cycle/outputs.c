/* SPDX-License-Identifier: MIT */
/* Limits and timeouts of outputs, as raw values on the wire. */
#include "cycle/outputs.h"

#include <math.h>

#include "harness/test.h"
#include "image/image.h"

/* 12 bits in steps of 0.1: -204.8 to 204.7. */
static const struct channel valve = { .name = "a.valve",
				      .direction = CHANNEL_OUTPUT,
				      .type = CHANNEL_INT,
				      .bit_len = 12,
				      .scale = 0.1 };
static const struct channel speed = { .name = "a.speed",
				      .direction = CHANNEL_OUTPUT,
				      .type = CHANNEL_FLOAT,
				      .bit_len = 32,
				      .scale = 1 };
static struct config cfg;
static struct board board;
static struct outputs outputs;
static const struct slave_set only_slave = { .word = { 1 } };

static void start_with(const struct channel *channel, const struct config_output *rules,
		       enum cycle_writer writer)
{
	char error[128] = "";
	struct cycle_spec spec = { .cfg = &cfg, .channels = channel, .channel_count = 1 };

	spec.boards[writer] = &board;
	memset(&cfg, 0, sizeof(cfg));
	cfg.cycle_period_ns = 1000000;
	cfg.output_count = 1;
	cfg.output[0] = *rules;
	snprintf(cfg.output[0].channel, sizeof(cfg.output[0].channel), "%s", channel->name);
	board_init(&board);
	CHECK_EQ(outputs_init(&outputs, &spec, error, sizeof(error)), 0);
}

static void start(double min, double max)
{
	start_with(&valve, &(struct config_output){ .min = min, .max = max }, CYCLE_WRITER_LOCAL);
}

static void command(uint64_t raw)
{
	board_begin(&board);
	board_put(&board, 0, raw);
	board_commit(&board);
}

/* What goes out when @physical is commanded, in tenths. */
static int sent(double physical)
{
	uint8_t image[2] = { 0 };
	uint64_t raw;

	CHECK_EQ(image_physical_to_raw(&valve, physical, &raw), 0);
	command(raw);
	CHECK_EQ(outputs_choose(&outputs, image, &only_slave, 1), 0);
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

/* What goes out of the channel a.speed when the float @text is commanded. */
static float speed_sent(const char *text)
{
	uint8_t image[4];
	uint64_t raw;

	CHECK_EQ(image_raw_parse(&speed, text, &raw), 0);
	command(raw);
	CHECK_EQ(outputs_choose(&outputs, image, &only_slave, 1), 0);
	return (float)image_get_physical(image, &speed);
}

TEST(outputs, a_value_that_is_not_a_number_goes_out_as_the_fail_safe_value)
{
	start_with(&speed, &(struct config_output){ .min = -10, .max = 10, .fail_safe = 3 },
		   CYCLE_WRITER_LOCAL);
	CHECK(speed_sent("5") == 5.0f);
	CHECK(speed_sent("nan") == 3.0f);
	CHECK(speed_sent("-nan") == 3.0f);
	CHECK(speed_sent("inf") == 10.0f);
	CHECK(speed_sent("-inf") == -10.0f);
	CHECK(speed_sent("1e9") == 10.0f);
}

TEST(outputs, a_value_that_is_not_a_number_is_not_sent_where_there_is_no_limit)
{
	start_with(&speed,
		   &(struct config_output){ .min = -INFINITY, .max = INFINITY, .fail_safe = 0.5 },
		   CYCLE_WRITER_LOCAL);
	CHECK(speed_sent("1e9") == 1e9f);
	CHECK(speed_sent("nan") == 0.5f);
}

/* The first cycle in which the output is fail-safe, when its owner was alive in cycle 100. */
static uint64_t silent_since(int64_t period_ns, int64_t timeout_ns, uint64_t step)
{
	uint8_t image[2] = { 0 };
	uint64_t cycle = 100;
	char error[128] = "";
	struct cycle_spec spec = { .cfg = &cfg,
				   .channels = &valve,
				   .channel_count = 1,
				   .boards = { [CYCLE_WRITER_REMOTE] = &board } };

	start_with(&valve,
		   &(struct config_output){ .min = -50,
					    .max = 50,
					    .owner = CONFIG_OWNER_REMOTE,
					    .timeout_ns = timeout_ns },
		   CYCLE_WRITER_REMOTE);
	cfg.cycle_period_ns = period_ns;
	CHECK_EQ(outputs_init(&outputs, &spec, error, sizeof(error)), 0);
	command(7);
	CHECK_EQ(outputs_choose(&outputs, image, &only_slave, cycle), 0);
	CHECK_EQ(image_get_raw(image, &valve), 7);
	while (outputs_choose(&outputs, image, &only_slave, cycle) == 0) {
		CHECK_EQ(image_get_raw(image, &valve), 7);
		cycle += step;
		CHECK(cycle < 1000);
	}
	CHECK_EQ(image_get_raw(image, &valve), 0);
	return cycle;
}

TEST(outputs, a_timeout_below_a_period_is_one_period)
{
	CHECK_EQ(silent_since(10000000, 5000000, 1), 102);
	CHECK_EQ(silent_since(10000000, 1, 1), 102);
	CHECK_EQ(silent_since(10000000, 10000000, 1), 102);
	CHECK_EQ(silent_since(10000000, 10000001, 1), 103);
}

TEST(outputs, a_timeout_counts_the_cycles_that_an_overrun_has_skipped)
{
	CHECK_EQ(silent_since(1000000, 50000000, 1), 151);
	CHECK_EQ(silent_since(1000000, 50000000, 10), 160);
	CHECK_EQ(silent_since(1000000, 50000000, 60), 160);
}

/* --- answers --- */

static const struct channel lamps[] = {
	{ .name = "a.led",
	  .direction = CHANNEL_OUTPUT,
	  .type = CHANNEL_BOOL,
	  .bit_len = 1,
	  .scale = 1 },
	{ .name = "b.led",
	  .direction = CHANNEL_OUTPUT,
	  .type = CHANNEL_BOOL,
	  .bit_len = 1,
	  .bit_offset = 1,
	  .slave_pos = 1,
	  .scale = 1 },
};
static const struct slave_set second = { .word = { 2 } };
static const struct slave_set both = { .word = { 3 } };
static const struct slave_set none;

static void start_lamps(void)
{
	char error[128] = "";
	struct cycle_spec spec = { .cfg = &cfg,
				   .channels = lamps,
				   .channel_count = 2,
				   .boards = { [CYCLE_WRITER_LOCAL] = &board } };

	memset(&cfg, 0, sizeof(cfg));
	cfg.cycle_period_ns = 1000000;
	board_init(&board);
	CHECK_EQ(outputs_init(&outputs, &spec, error, sizeof(error)), 0);
}

static uint64_t light(unsigned lamp)
{
	board_begin(&board);
	board_put(&board, lamp, 1);
	return board_commit(&board);
}

/* One cycle: the frame of @cycle carries what was chosen before it. */
static void cycle_with(const struct slave_set *live, const struct slave_set *arrived,
		       uint64_t cycle)
{
	uint8_t image[1] = { 0 };

	outputs_arrived(&outputs, arrived, cycle);
	outputs_choose(&outputs, image, live, cycle);
}

static void check_answered(uint64_t sequence, uint64_t cycle)
{
	CHECK_EQ(board.taken_sequence, sequence);
	CHECK_EQ(board.taken_cycle, cycle);
}

TEST(outputs, a_set_is_answered_with_the_first_cycle_whose_frame_came_back_with_it)
{
	uint64_t sequence;

	start_lamps();
	sequence = light(0);
	cycle_with(&both, &both, 10); /* it is chosen at the end of this one */
	CHECK_EQ(board.taken_sequence, 0);
	cycle_with(&both, &none, 11);   /* lost */
	cycle_with(&both, &second, 12); /* the data of the other slave only */
	CHECK_EQ(board.taken_sequence, 0);
	cycle_with(&both, &both, 13);
	check_answered(sequence, 13);
}

TEST(outputs, a_set_is_not_answered_while_its_output_is_at_fail_safe)
{
	uint64_t sequence;

	start_lamps();
	sequence = light(0);
	for (uint64_t cycle = 10; cycle < 20; cycle++) {
		cycle_with(&none, &both, cycle);
	}
	cycle_with(&second, &both, 20);
	cycle_with(&second, &both, 21);
	CHECK_EQ(board.taken_sequence, 0);
	cycle_with(&both, &both, 22);
	CHECK_EQ(board.taken_sequence, 0);
	cycle_with(&both, &both, 23);
	check_answered(sequence, 23);
}

TEST(outputs, an_output_that_is_not_in_the_set_does_not_keep_its_answer_back)
{
	uint64_t sequence;

	start_lamps();
	light(0);
	cycle_with(&both, &both, 10);
	cycle_with(&both, &both, 11);
	CHECK_EQ(board.taken_cycle, 11);
	sequence = light(1); /* slave a has left OP meanwhile */
	cycle_with(&second, &second, 12);
	cycle_with(&second, &second, 13);
	check_answered(sequence, 13);
}

TEST(outputs, a_withdrawn_set_is_answered_by_the_next_frame)
{
	uint64_t sequence;

	start_lamps();
	sequence = light(0);
	cycle_with(&second, &second, 10);
	cycle_with(&second, &second, 11);
	CHECK_EQ(board.taken_sequence, 0);
	board_withdraw(&board, sequence);
	cycle_with(&second, &second, 12);
	cycle_with(&second, &second, 13);
	CHECK_EQ(board.taken_sequence, sequence + 2);
	CHECK_EQ(outputs.set[CYCLE_WRITER_LOCAL].is_set[0], 0);
}
