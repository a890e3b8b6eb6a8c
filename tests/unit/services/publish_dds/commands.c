/* SPDX-License-Identifier: MIT */
#include "publish/commands.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/clock.h"
#include "harness/test.h"
#include "unit/services/publish/master_socket.h"
#include "unit/services/publish_dds/fake_topics.h"

enum { ALICE = 11, BOB = 12, LED = 0, VALVE = 1, SESSION = 77, REPLIES = 512 };

struct answer {
	uint64_t id;
	uint64_t cycle;
	int is_accepted;
	char reason[GATE_REASON_BYTES];
};

static struct answer answers[REPLIES];
static size_t answer_count;

static struct {
	struct sample_meta meta;
	struct slave_info slave[1];
	struct channel channel[2];
} ring_meta = {
	.meta = { .version = SAMPLE_VERSION,
		  .slave_count = 1,
		  .channel_count = 2,
		  .image_bytes = 8,
		  .output_bytes = 8,
		  .period_ns = 1000000,
		  .session = SESSION },
	.slave = { { .name = "s" } },
	.channel = { { .name = "s.led",
		       .type = CHANNEL_BOOL,
		       .direction = CHANNEL_OUTPUT,
		       .bit_len = 1,
		       .scale = 1 },
		     { .name = "s.valve",
		       .type = CHANNEL_UINT,
		       .direction = CHANNEL_OUTPUT,
		       .bit_len = 16,
		       .bit_offset = 16,
		       .scale = 1 } },
};

/* The led has a timeout, the valve has none. Alice is alive. */
struct bench {
	char dir[64];
	struct config cfg;
	struct channel_table *table;
	struct gate_view view;
	struct topics topics;
	struct commands *commands;
	struct board *board; /* the master's end */
	int board_fd;
	int socket;
	uint64_t next_id;
};

static void on_write(dds_entity_t writer, const void *message, int64_t utc_ns)
{
	const ecdaq_ReplyV1 *m = message;

	(void)writer;
	CHECK_EQ(utc_ns, 0);
	CHECK(answer_count < REPLIES);
	answers[answer_count] =
		(struct answer){ .id = m->id, .cycle = m->cycle, .is_accepted = m->is_accepted };
	snprintf(answers[answer_count++].reason, GATE_REASON_BYTES, "%s", m->reason);
}

/* As the DDS library calls the listener. */
static void notify(const struct bench *b, uint64_t sender, int is_alive)
{
	dds_listener_t *listener = commands_listener(b->commands);
	dds_liveliness_changed_status_t status = { .alive_count_change = is_alive ? 1 : -1,
						   .not_alive_count_change = is_alive ? -1 : 1,
						   .last_publication_handle = sender };
	dds_on_liveliness_changed_fn call;
	bool reset;
	void *arg;

	CHECK_EQ(dds_lget_liveliness_changed_arg(listener, &call, &arg, &reset), 0);
	call(1, status, arg);
	dds_delete_listener(listener);
}

static int step(struct bench *b)
{
	return commands_step(b->commands, &b->topics, &b->view);
}

static void give_board(struct bench *b)
{
	b->board = board_create_shared(&b->board_fd);
	CHECK(b->board != NULL);
	b->socket = master_socket_listen(b->dir);
	commands_follow(b->commands);
	master_socket_serve(b->socket, b->board_fd);
}

static void bench_open(struct bench *b)
{
	memset(b, 0, sizeof(*b));
	answer_count = 0;
	snprintf(b->dir, sizeof(b->dir), "/tmp/ecdaq-commands-XXXXXX");
	CHECK(mkdtemp(b->dir) != NULL);
	config_defaults(&b->cfg);
	snprintf(b->cfg.run_dir, sizeof(b->cfg.run_dir), "%s", b->dir);
	b->cfg.dds_allow_insecure_commands = 1;
	b->cfg.output_count = 2;
	b->cfg.output[0] = (struct config_output){ .channel = "s.led",
						   .owner = CONFIG_OWNER_REMOTE,
						   .min = -INFINITY,
						   .max = INFINITY,
						   .timeout_ns = 200 * NS_PER_MS };
	b->cfg.output[1] = (struct config_output){
		.channel = "s.valve", .owner = CONFIG_OWNER_REMOTE, .min = 0, .max = 100
	};
	CHECK_EQ(channel_table_create(&ring_meta, sizeof(ring_meta), &b->table), 0);
	b->view = (struct gate_view){ .table = b->table, .is_op = 1, .cycle = 1000 };
	b->topics = fake_topics(on_write);
	CHECK_EQ(commands_create(&b->cfg, &b->commands), 0);
	give_board(b);
	commands_follow(b->commands);
	notify(b, ALICE, 1);
	CHECK_EQ(step(b), 0);
}

static void bench_close(struct bench *b)
{
	char path[128];

	commands_destroy(b->commands);
	channel_table_destroy(b->table);
	fake_topics(NULL);
	board_unmap(b->board);
	close(b->board_fd);
	close(b->socket);
	snprintf(path, sizeof(path), "%s/commands-remote", b->dir);
	unlink(path);
	CHECK_EQ(rmdir(b->dir), 0);
}

/* A command for one output. Returns its id. */
static uint64_t command(struct bench *b, uint64_t sender, const char *channel, double value)
{
	char name[GATE_NAME_BYTES];
	char *names[] = { name };
	char who[] = "who";
	ecdaq_CommandV1 m = { .commander = who,
			      .id = ++b->next_id,
			      .channel = { ._length = 1, ._maximum = 1, ._buffer = names },
			      .values = { ._length = 1, ._maximum = 1, ._buffer = &value } };

	snprintf(name, sizeof(name), "%s", channel);
	fake_topics_command(&m, sender);
	return b->next_id;
}

static int is_set(const struct bench *b, unsigned output)
{
	return (int)atomic_load(&b->board->output[output].is_set);
}

/* What the cycle does: take the newest set and carry it in the frame of @cycle. */
static void take(const struct bench *b, uint64_t cycle)
{
	static struct board_set set;

	set.sequence = 0;
	CHECK_EQ(board_take(b->board, 2, &set), 1);
	board_answer(b->board, set.sequence, cycle);
}

static void set_output(struct bench *b, uint64_t sender, const char *channel)
{
	command(b, sender, channel, 1);
	CHECK_EQ(step(b), 1);
	take(b, 1001);
	CHECK_EQ(step(b), 0);
	CHECK(answer_count > 0 && answers[answer_count - 1].is_accepted);
}

TEST(publish_commands, an_accepted_command_is_answered_with_the_cycle_that_carried_it)
{
	struct bench b;
	uint64_t id;

	bench_open(&b);
	id = command(&b, ALICE, "s.valve", 42);
	CHECK_EQ(step(&b), 1);
	CHECK_EQ(b.board->output[VALVE].raw, 42);
	CHECK_EQ(step(&b), 1); /* the cycle has not taken it */
	CHECK_EQ(answer_count, 0);
	take(&b, 1234);
	CHECK_EQ(step(&b), 0);
	CHECK_EQ(answer_count, 1);
	CHECK_EQ(answers[0].id, id);
	CHECK_EQ(answers[0].cycle, 1234);
	CHECK(answers[0].is_accepted);
	CHECK_STR(answers[0].reason, "");
	CHECK_EQ(step(&b), 0);
	CHECK_EQ(answer_count, 1);
	CHECK_EQ(commands_counts(b.commands).accepted, 1);
	CHECK_EQ(commands_counts(b.commands).refused, 0);
	bench_close(&b);
}

TEST(publish_commands, one_command_is_pending_at_a_time)
{
	struct bench b;

	bench_open(&b);
	command(&b, ALICE, "s.valve", 1);
	command(&b, ALICE, "s.valve", 2);
	CHECK_EQ(step(&b), 1);
	CHECK_EQ(step(&b), 1);
	CHECK_EQ(b.board->output[VALVE].raw, 1);
	take(&b, 1001);
	CHECK_EQ(step(&b), 1);
	CHECK_EQ(b.board->output[VALVE].raw, 2);
	take(&b, 1002);
	CHECK_EQ(step(&b), 0);
	CHECK_EQ(answer_count, 2);
	CHECK_EQ(answers[0].cycle, 1001);
	CHECK_EQ(answers[1].cycle, 1002);
	bench_close(&b);
}

TEST(publish_commands, a_command_that_the_master_does_not_take_in_time_is_reverted)
{
	struct bench b;
	uint64_t beat;

	bench_open(&b);
	command(&b, ALICE, "s.led", 1);
	CHECK_EQ(step(&b), 1);
	CHECK(is_set(&b, LED));
	b.view.now_ns += 200 * NS_PER_MS - 1;
	CHECK_EQ(step(&b), 1);
	CHECK_EQ(answer_count, 0);
	b.view.now_ns += 1;
	CHECK_EQ(step(&b), 0);
	CHECK_EQ(answer_count, 1);
	CHECK(!answers[0].is_accepted);
	CHECK_EQ(answers[0].cycle, 0);
	CHECK_STR(answers[0].reason, "not taken by the master in time: reverted");
	CHECK(!is_set(&b, LED));
	beat = b.board->beat;
	CHECK_EQ(step(&b), 0);
	CHECK_EQ(b.board->beat, beat); /* nobody has set anything */
	CHECK_EQ(commands_counts(b.commands).refused, 1);
	bench_close(&b);
}

TEST(publish_commands, outputs_of_a_lost_commander_are_reverted_if_they_have_a_timeout)
{
	struct bench b;

	bench_open(&b);
	notify(&b, BOB, 1);
	set_output(&b, ALICE, "s.led");
	set_output(&b, ALICE, "s.valve");
	notify(&b, BOB, 0);
	step(&b);
	CHECK(is_set(&b, LED)); /* not Bob's */
	notify(&b, ALICE, 0);
	step(&b);
	CHECK(!is_set(&b, LED));
	CHECK(is_set(&b, VALVE));
	/* Alice alive again: nothing comes back. */
	notify(&b, ALICE, 1);
	step(&b);
	CHECK(!is_set(&b, LED));
	bench_close(&b);
}

TEST(publish_commands, an_output_belongs_to_the_commander_that_set_it_last)
{
	struct bench b;

	bench_open(&b);
	notify(&b, BOB, 1);
	set_output(&b, ALICE, "s.led");
	set_output(&b, BOB, "s.led");
	notify(&b, ALICE, 0);
	step(&b);
	CHECK(is_set(&b, LED));
	notify(&b, BOB, 0);
	step(&b);
	CHECK(!is_set(&b, LED));
	bench_close(&b);
}

TEST(publish_commands, a_command_of_a_commander_that_is_not_alive_is_rejected)
{
	struct bench b;

	bench_open(&b);
	command(&b, BOB, "s.led", 1);
	CHECK_EQ(step(&b), 0);
	CHECK_EQ(answer_count, 1);
	CHECK_STR(answers[0].reason, "the commander is not alive, or there are too many");
	CHECK(!is_set(&b, LED));
	bench_close(&b);
}

TEST(publish_commands, rejected_commands_are_answered_without_delay)
{
	struct bench b;

	bench_open(&b);
	for (int i = 0; i < 20; i++) {
		command(&b, ALICE, "s.nothing", 1);
	}
	command(&b, ALICE, "s.valve", 3);
	CHECK_EQ(step(&b), 1); /* all in one step */
	CHECK_EQ(answer_count, 20);
	CHECK(strstr(answers[19].reason, "no such channel") != NULL);
	CHECK_EQ(b.board->output[VALVE].raw, 3);
	CHECK_EQ(commands_counts(b.commands).refused, 20);
	bench_close(&b);
}

TEST(publish_commands, the_heartbeat_goes_on_while_an_output_is_set)
{
	struct bench b;
	uint64_t beat;

	bench_open(&b);
	beat = b.board->beat;
	step(&b);
	CHECK_EQ(b.board->beat, beat);
	set_output(&b, ALICE, "s.led");
	beat = b.board->beat;
	step(&b);
	step(&b);
	CHECK_EQ(b.board->beat, beat + 2);
	notify(&b, ALICE, 0);
	step(&b);
	CHECK_EQ(b.board->beat, beat + 2);
	bench_close(&b);
}

TEST(publish_commands, a_new_session_of_the_master_has_no_outputs_set)
{
	struct bench b;
	uint64_t beat;

	bench_open(&b);
	set_output(&b, ALICE, "s.led");
	beat = b.board->beat;
	b.table->meta.session++;
	step(&b);
	CHECK_EQ(b.board->beat, beat);
	bench_close(&b);
}

TEST(publish_commands, when_liveliness_changes_were_dropped_no_commander_is_taken_for_alive)
{
	struct bench b;

	bench_open(&b);
	set_output(&b, ALICE, "s.led");
	for (int i = 0; i < 257; i++) {
		notify(&b, BOB, i % 2 == 0);
	}
	step(&b);
	CHECK(!is_set(&b, LED));
	command(&b, ALICE, "s.led", 1);
	CHECK_EQ(step(&b), 0);
	CHECK(!answers[answer_count - 1].is_accepted);
	bench_close(&b);
}

TEST(publish_commands, a_board_is_cleared_before_its_first_heartbeat)
{
	struct bench b;

	bench_open(&b);
	/* A predecessor that was killed has left its values on the next board. */
	board_unmap(b.board);
	close(b.board_fd);
	close(b.socket);
	give_board(&b);
	board_begin(b.board);
	board_put(b.board, LED, 1);
	board_commit(b.board);
	commands_follow(b.commands);
	CHECK(!is_set(&b, LED));
	bench_close(&b);
}

TEST(publish_commands, without_a_board_commands_are_rejected)
{
	struct bench b;
	char path[128];

	bench_open(&b);
	snprintf(path, sizeof(path), "%s/commands-remote", b.dir);
	close(b.socket);
	b.socket = master_socket_listen(b.dir); /* a new master, which has not answered yet */
	commands_follow(b.commands);
	command(&b, ALICE, "s.led", 1);
	CHECK_EQ(step(&b), 0);
	CHECK_STR(answers[0].reason, "commands-remote cannot be written");
	bench_close(&b);
}

TEST(publish_commands, the_end_of_the_program_reverts_every_output)
{
	struct bench b;

	bench_open(&b);
	set_output(&b, ALICE, "s.led");
	set_output(&b, ALICE, "s.valve");
	commands_destroy(b.commands);
	b.commands = NULL;
	CHECK(!is_set(&b, LED));
	CHECK(!is_set(&b, VALVE));
	bench_close(&b);
}
