/* SPDX-License-Identifier: MIT */
/* Limits and timeouts of outputs, as raw values on the wire. */
#include "cycle/outputs.h"

#include <errno.h>
#include <math.h>

#include "base/prng.h"
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

TEST(outputs, new_limits_are_in_force_from_the_next_cycle_on)
{
	char error[128] = "";

	start(-50, 100);
	CHECK_EQ(sent(150), 1000);
	cfg.output[0].max = 120;
	CHECK_EQ(sent(150), 1000); /* nobody has handed them over */
	for (int i = 0; i < 4; i++) {
		cfg.output[0].max = 110 + i;
		CHECK_EQ(outputs_rules_set(&outputs, &cfg, error, sizeof(error)), 0);
		CHECK_EQ(outputs_rules_set(&outputs, &cfg, error, sizeof(error)), 0);
		CHECK_EQ(sent(150), 1100 + 10 * i);
		CHECK_EQ(sent(-80), -500);
	}
}

TEST(outputs, rules_that_a_channel_cannot_hold_change_nothing)
{
	char error[128] = "";

	start(-50, 100);
	cfg.output[0].max = 50;
	cfg.output[0].fail_safe = 1e9;
	CHECK_EQ(outputs_rules_set(&outputs, &cfg, error, sizeof(error)), -EINVAL);
	CHECK(strstr(error, "the channel cannot hold its fail_safe value") != NULL);
	CHECK_EQ(sent(150), 1000);
	cfg.output[0].fail_safe = 0;
	CHECK_EQ(outputs_rules_set(&outputs, &cfg, error, sizeof(error)), 0);
	CHECK_EQ(sent(150), 500);
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

/* --- against a reference that chooses all outputs anew in each cycle --- */

enum { RANDOM_OUTPUTS = 5, RANDOM_CYCLES = 20000 };

static const enum cycle_writer random_writers[] = { CYCLE_WRITER_LOCAL, CYCLE_WRITER_REMOTE };
static struct board random_boards[CYCLE_WRITERS];
static struct channel random_channels[RANDOM_OUTPUTS];
static uint64_t chosen_timeout[RANDOM_OUTPUTS];

static void set_random_rules(struct prng *prng)
{
	for (unsigned i = 0; i < RANDOM_OUTPUTS; i++) {
		struct config_output *rules = &cfg.output[i];

		chosen_timeout[i] = prng_below(prng, 2) * (1 + prng_below(prng, 6));
		snprintf(rules->channel, sizeof(rules->channel), "a.o%u", i);
		rules->fail_safe = (double)prng_below(prng, 3);
		rules->min = -INFINITY;
		rules->max = prng_below(prng, 2) == 0 ? INFINITY : 50.0 + i;
		rules->owner = i % 2 == 0 ? CONFIG_OWNER_LOCAL : CONFIG_OWNER_REMOTE;
		rules->timeout_ns = (int64_t)chosen_timeout[i] * cfg.cycle_period_ns;
	}
}

static void start_random(struct prng *prng)
{
	struct cycle_spec spec = { .cfg = &cfg,
				   .channels = random_channels,
				   .channel_count = RANDOM_OUTPUTS };
	char error[128] = "";

	memset(&cfg, 0, sizeof(cfg));
	cfg.cycle_period_ns = 1000000;
	cfg.output_count = RANDOM_OUTPUTS;
	for (unsigned i = 0; i < RANDOM_OUTPUTS; i++) {
		random_channels[i] = (struct channel){ .direction = CHANNEL_OUTPUT,
						       .type = CHANNEL_UINT,
						       .bit_len = i == 2 ? 16 : 11,
						       .bit_offset = 16 * i + (i == 2 ? 0 : 3),
						       .slave_pos = (uint16_t)(60 + 2 * i),
						       .scale = 1 };
		snprintf(random_channels[i].name, sizeof(random_channels[i].name), "a.o%u", i);
	}
	for (unsigned i = 0; i < 2; i++) {
		board_init(&random_boards[random_writers[i]]);
		spec.boards[random_writers[i]] = &random_boards[random_writers[i]];
	}
	set_random_rules(prng);
	CHECK_EQ(outputs_init(&outputs, &spec, error, sizeof(error)), 0);
}

static void act(struct prng *prng, struct slave_set *live)
{
	struct board *b = &random_boards[random_writers[prng_below(prng, 2)]];
	char error[128] = "";

	switch (prng_below(prng, 12)) {
	case 0:
	case 1:
		board_begin(b);
		for (unsigned i = 0; i < RANDOM_OUTPUTS; i++) {
			if (prng_below(prng, 3) == 0) {
				board_unset(b, i);
			} else if (prng_below(prng, 2) == 0) {
				board_put(b, i, prng_below(prng, 100));
			}
		}
		board_commit(b);
		break;
	case 2:
	case 3:
	case 4:
		b->beat++;
		break;
	case 5:
		live->word[prng_below(prng, 2)] ^= UINT64_C(1) << prng_below(prng, 64);
		live->word[0] |= UINT64_C(0x5) << 60;
		break;
	case 6:
		if (prng_below(prng, 10) == 0) {
			set_random_rules(prng);
			CHECK_EQ(outputs_rules_set(&outputs, &cfg, error, sizeof(error)), 0);
		}
		break;
	default:
		break;
	}
}

/* What one output is to be, and whether it is counted as timed out. */
static uint64_t reference(unsigned i, const struct slave_set *live, uint64_t cycle,
			  unsigned *timed_out)
{
	const struct config_output *rules = &cfg.output[i];
	enum cycle_writer writer = i % 2 == 0 ? CYCLE_WRITER_LOCAL : CYCLE_WRITER_REMOTE;
	const struct board_set *set = &outputs.set[writer];
	int is_silent =
		chosen_timeout[i] > 0 && cycle - outputs.alive_cycle[writer] > chosen_timeout[i];
	int is_wanted = set->is_set[i] && slave_set_has(live, random_channels[i].slave_pos);

	*timed_out += is_wanted && is_silent;
	if (!is_wanted || is_silent) {
		return (uint64_t)rules->fail_safe;
	}
	return (double)set->raw[i] > rules->max ? (uint64_t)rules->max : set->raw[i];
}

TEST(outputs, what_is_written_when_something_changes_is_what_each_cycle_would_write)
{
	struct slave_set live = { .word = { UINT64_MAX, UINT64_MAX } };
	struct prng prng = { 5 };
	uint8_t image[2 * RANDOM_OUTPUTS] = { 0 };
	uint64_t cycle = 1;
	unsigned times = 0;

	start_random(&prng);
	for (unsigned n = 0; n < RANDOM_CYCLES; n++) {
		unsigned expected = 0;
		unsigned timed_out;

		act(&prng, &live);
		cycle += prng_below(&prng, 10) == 0 ? 1 + prng_below(&prng, 4) : 1;
		timed_out = outputs_choose(&outputs, image, &live, cycle);
		for (unsigned i = 0; i < RANDOM_OUTPUTS; i++) {
			uint64_t wanted = reference(i, &live, cycle, &expected);

			CHECK_EQ(image_get_raw(image, &random_channels[i]), wanted);
		}
		CHECK_EQ(timed_out, expected);
		times += timed_out > 0;
	}
	CHECK(times > RANDOM_CYCLES / 50 && times < RANDOM_CYCLES);
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
