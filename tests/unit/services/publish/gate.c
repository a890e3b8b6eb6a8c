/* SPDX-License-Identifier: MIT */
#include "publish/gate.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "base/clock.h"
#include "harness/test.h"

enum { SLAVES = 1, CHANNELS = 3, SESSION = 77, NOW_CYCLE = 1000 };

/* One slave: an input, a BOOL output of the remote owner, an INT16 output of the remote owner. */
struct scene {
	struct config cfg;
	struct channel_table *table;
	struct gate *gate;
	struct gate_view view;
	struct gate_item item[GATE_ITEMS];
	char reason[GATE_REASON_BYTES];
};

static struct {
	struct sample_meta meta;
	struct slave_info slave[SLAVES];
	struct channel channel[CHANNELS];
} ring_meta_area = {
	.meta = { .version = SAMPLE_VERSION,
		  .slave_count = SLAVES,
		  .channel_count = CHANNELS,
		  .image_bytes = 8,
		  .output_bytes = 4,
		  .period_ns = 1000000,
		  .session = SESSION },
	.slave = { { .name = "s" } },
	.channel = { { .name = "s.adc",
		       .type = CHANNEL_UINT,
		       .bit_len = 16,
		       .bit_offset = 32,
		       .scale = 1 },
		     { .name = "s.led",
		       .type = CHANNEL_BOOL,
		       .direction = CHANNEL_OUTPUT,
		       .bit_len = 1,
		       .scale = 1 },
		     { .name = "s.volt",
		       .type = CHANNEL_INT,
		       .direction = CHANNEL_OUTPUT,
		       .bit_len = 16,
		       .bit_offset = 16,
		       .scale = 0.001 } },
};

static struct scene *scene(void)
{
	static struct scene s;

	gate_destroy(s.gate);
	channel_table_destroy(s.table);
	memset(&s, 0, sizeof(s));
	config_defaults(&s.cfg);
	s.cfg.dds_allow_insecure_commands = 1;
	s.cfg.output_count = 2;
	s.cfg.output[0] = (struct config_output){ .channel = "s.led",
						  .owner = CONFIG_OWNER_REMOTE,
						  .min = -INFINITY,
						  .max = INFINITY,
						  .timeout_ns = 200 * NS_PER_MS };
	s.cfg.output[1] = (struct config_output){
		.channel = "s.volt", .owner = CONFIG_OWNER_REMOTE, .min = -5, .max = 5
	};
	CHECK_EQ(channel_table_create(&ring_meta_area, sizeof(ring_meta_area), &s.table), 0);
	s.gate = gate_create(&s.cfg);
	s.view = (struct gate_view){ .table = s.table, .is_op = 1, .cycle = NOW_CYCLE };
	return &s;
}

static int ask(struct scene *s, uint64_t sender, uint64_t id, const char *name, double value)
{
	char channel[GATE_NAME_BYTES];
	char *channels[] = { channel };
	struct gate_command cmd = { .sender = sender,
				    .id = id,
				    .count = 1,
				    .value_count = 1,
				    .channel = channels,
				    .values = &value };

	snprintf(channel, sizeof(channel), "%s", name);
	return gate_check(s->gate, &cmd, &s->view, s->item, s->reason);
}

TEST(publish_gate, physical_value_becomes_raw_bits_of_the_right_output)
{
	struct scene *s = scene();

	CHECK_EQ(ask(s, 1, 1, "s.volt", -1.5), 0);
	CHECK_EQ(s->item[0].output, 1);
	CHECK_EQ(s->item[0].raw, (uint64_t)(uint16_t)-1500);
	CHECK_EQ(ask(s, 1, 2, "s.led", 1), 0);
	CHECK_EQ(s->item[0].output, 0);
}

TEST(publish_gate, values_out_of_range_and_nan_are_refused)
{
	struct scene *s = scene();

	CHECK_EQ(ask(s, 1, 1, "s.volt", 5.001), -ERANGE);
	CHECK_STR(s->reason, "s.volt: 5.001 is outside -5 to 5 (outputs[])");
	CHECK_EQ(ask(s, 1, 2, "s.volt", (double)NAN), -EINVAL);
	CHECK_EQ(ask(s, 1, 3, "s.volt", 1e300), -ERANGE);
}

TEST(publish_gate, a_bool_output_takes_0_and_1_only)
{
	struct scene *s = scene();
	static const double wrong[] = { 0.4, 0.6, 0.999, 2, -1, -0.1, 1e300 };

	for (size_t i = 0; i < sizeof(wrong) / sizeof(wrong[0]); i++) {
		CHECK_EQ(ask(s, 1, i + 1, "s.led", wrong[i]), -EINVAL);
	}
	CHECK_EQ(ask(s, 1, 20, "s.led", 0.4), -EINVAL);
	CHECK_STR(s->reason, "s.led: 0.4 is not a value of type BOOL");
	CHECK_EQ(ask(s, 1, 21, "s.led", 0), 0);
	CHECK_EQ(s->item[0].raw, 0);
	CHECK_EQ(ask(s, 1, 22, "s.led", 1), 0);
	CHECK_EQ(s->item[0].raw, 1);
}

TEST(publish_gate, only_the_remote_owner_may_write_and_only_outputs)
{
	struct scene *s = scene();

	s->cfg.output[0].owner = CONFIG_OWNER_PROGRAM;
	CHECK_EQ(ask(s, 1, 1, "s.led", 1), -EPERM);
	CHECK_STR(s->reason, "s.led: owned by program, not remote (outputs[].owner)");
	s->cfg.output_count = 0;
	CHECK_EQ(ask(s, 1, 2, "s.volt", 1), -EPERM);
	CHECK_EQ(ask(s, 1, 3, "s.adc", 1), -EPERM);
	CHECK_STR(s->reason, "s.adc: is an input");
	CHECK_EQ(ask(s, 1, 4, "s.none", 1), -ENOENT);
}

TEST(publish_gate, ids_go_up_for_each_sender_by_itself_also_after_it_was_lost)
{
	struct scene *s = scene();

	CHECK_EQ(ask(s, 1, 5, "s.led", 1), 0);
	CHECK_EQ(ask(s, 1, 5, "s.led", 1), -EALREADY);
	CHECK_EQ(ask(s, 1, 4, "s.led", 1), -ESTALE);
	CHECK_EQ(ask(s, 2, 1, "s.led", 1), 0);
	gate_remove(s->gate, 1);
	CHECK_EQ(ask(s, 1, 5, "s.led", 1), -EALREADY);
	CHECK_EQ(ask(s, 1, 6, "s.led", 1), 0);
}

TEST(publish_gate, a_repeated_command_has_the_answer_of_the_first_one)
{
	const struct gate_answer accepted = { .is_accepted = 1, .cycle = 1001 };
	const struct gate_answer refused = { .reason = "for a reason" };
	struct scene *s = scene();

	CHECK(gate_find_answer(s->gate, 1, 5) == NULL);
	CHECK_EQ(ask(s, 1, 5, "s.led", 1), 0);
	CHECK(gate_find_answer(s->gate, 1, 5) == NULL);
	gate_note_answer(s->gate, 1, 5, &accepted);
	CHECK_EQ(gate_find_answer(s->gate, 1, 5)->cycle, 1001);
	CHECK(gate_find_answer(s->gate, 1, 4) == NULL);
	CHECK(gate_find_answer(s->gate, 2, 5) == NULL);
	/* Also if it has been lost meanwhile. */
	gate_remove(s->gate, 1);
	CHECK(gate_find_answer(s->gate, 1, 5) != NULL);
	/* The answer to a command that was not judged by its id is not noted: it may come again. */
	gate_note_answer(s->gate, 1, 6, &refused);
	CHECK(gate_find_answer(s->gate, 1, 6) == NULL);
	CHECK_EQ(gate_find_answer(s->gate, 1, 5)->cycle, 1001);
	/* The next command takes its place. */
	CHECK_EQ(ask(s, 1, 6, "s.none", 1), -ENOENT);
	CHECK(gate_find_answer(s->gate, 1, 5) == NULL);
	CHECK(gate_find_answer(s->gate, 1, 6) == NULL);
	gate_note_answer(s->gate, 1, 6, &refused);
	CHECK_STR(gate_find_answer(s->gate, 1, 6)->reason, "for a reason");
	gate_forget_answers(s->gate);
	CHECK(gate_find_answer(s->gate, 1, 6) == NULL);
	CHECK_EQ(ask(s, 1, 6, "s.led", 1), -EALREADY);
}

TEST(publish_gate, places_of_lost_commanders_go_to_new_ones)
{
	struct scene *s = scene();

	for (uint64_t sender = 1; sender <= GATE_COMMANDERS; sender++) {
		CHECK_EQ(ask(s, sender, 1, "s.led", 1), 0);
	}
	CHECK_EQ(ask(s, 1000, 1, "s.led", 1), -EUSERS);
	gate_remove(s->gate, 3);
	CHECK_EQ(ask(s, 1000, 1, "s.led", 1), 0);
}

TEST(publish_gate, commands_for_another_session_or_too_late_are_stale)
{
	struct scene *s = scene();
	char name[] = "s.led";
	char *channels[] = { name };
	double value = 1;
	struct gate_command cmd = { .sender = 1,
				    .id = 1,
				    .session = SESSION + 1,
				    .count = 1,
				    .value_count = 1,
				    .channel = channels,
				    .values = &value };

	CHECK_EQ(gate_check(s->gate, &cmd, &s->view, s->item, s->reason), -ESTALE);
	cmd.id = 2;
	cmd.session = SESSION;
	cmd.not_after_cycle = NOW_CYCLE;
	CHECK_EQ(gate_check(s->gate, &cmd, &s->view, s->item, s->reason), -ESTALE);
	cmd.id = 3;
	cmd.not_after_cycle = NOW_CYCLE + 1;
	CHECK_EQ(gate_check(s->gate, &cmd, &s->view, s->item, s->reason), 0);
}

TEST(publish_gate, malformed_commands_are_refused)
{
	struct scene *s = scene();
	char led[] = "s.led";
	char *channels[] = { led, led };
	double values[] = { 1, 1 };
	struct gate_command cmd = { .sender = 1, .channel = channels, .values = values };

	CHECK_EQ(gate_check(s->gate, &cmd, &s->view, s->item, s->reason), -EINVAL);
	cmd.count = GATE_ITEMS + 1;
	CHECK_EQ(gate_check(s->gate, &cmd, &s->view, s->item, s->reason), -EINVAL);
	cmd.count = 1;
	CHECK_EQ(gate_check(s->gate, &cmd, &s->view, s->item, s->reason), -EINVAL);
	cmd.value_count = 1;
	cmd.is_raw = 1;
	CHECK_EQ(gate_check(s->gate, &cmd, &s->view, s->item, s->reason), -EINVAL);
	cmd.is_raw = 0;
	cmd.count = 2;
	cmd.value_count = 2;
	CHECK_EQ(gate_check(s->gate, &cmd, &s->view, s->item, s->reason), -EINVAL);
	CHECK_STR(s->reason, "s.led: listed twice");
}

TEST(publish_gate, rate_of_commands_is_limited)
{
	struct scene *s = scene();

	s->cfg.dds_command_rate = 10;
	for (uint64_t id = 1; id <= 10; id++) {
		CHECK_EQ(ask(s, 1, id, "s.led", 1), 0);
	}
	CHECK_EQ(ask(s, 1, 11, "s.led", 1), -EAGAIN);
	s->view.now_ns += 100 * NS_PER_MS;
	CHECK_EQ(ask(s, 1, 12, "s.led", 1), 0);
	CHECK_EQ(ask(s, 1, 13, "s.led", 1), -EAGAIN);
	CHECK_EQ(ask(s, 2, 1, "s.led", 1), 0);
}

TEST(publish_gate, nothing_passes_without_leave_without_a_master_or_out_of_op)
{
	struct scene *s = scene();

	s->view.is_op = 0;
	CHECK_EQ(ask(s, 1, 1, "s.led", 1), -EAGAIN);
	s->view.is_op = 1;
	s->view.table = NULL;
	CHECK_EQ(ask(s, 1, 2, "s.led", 1), -EAGAIN);
	s->view.table = s->table;
	s->cfg.dds_allow_insecure_commands = 0;
	CHECK_EQ(ask(s, 1, 3, "s.led", 1), -EPERM);
}

TEST(publish_gate, lease_is_half_the_shortest_time_out_within_bounds)
{
	struct scene *s = scene();

	CHECK_EQ(gate_lease_ns(&s->cfg), 100 * NS_PER_MS);
	s->cfg.output[0].timeout_ns = NS_PER_MS;
	CHECK_EQ(gate_lease_ns(&s->cfg), 20 * NS_PER_MS);
	s->cfg.output[0].timeout_ns = 0;
	CHECK_EQ(gate_lease_ns(&s->cfg), NS_PER_S);
	CHECK_EQ(gate_has_timeout(s->table, &s->cfg, 0), 0);
}

TEST(publish_gate, lease_is_half_the_shortest_timeout_of_all_outputs)
{
	struct scene *s = scene();

	s->cfg.output[0].timeout_ns = 200 * NS_PER_MS;
	s->cfg.output[1].timeout_ns = 80 * NS_PER_MS;
	CHECK_EQ(gate_lease_ns(&s->cfg), 40 * NS_PER_MS);
	s->cfg.output[1].timeout_ns = 300 * NS_PER_MS;
	CHECK_EQ(gate_lease_ns(&s->cfg), 100 * NS_PER_MS);
}
