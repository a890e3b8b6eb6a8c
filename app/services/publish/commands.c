/* SPDX-License-Identifier: MIT */
#include "publish/commands.h"

#include <errno.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "ecdaq.h"
#include "publish/domain.h"
#include "publish/remote_board.h"

enum { REFUSALS_PER_STEP = 32, CHANGES_MAX = 256 };

/* Longer than any recovery of a cycle. */
#define TAKE_TIMEOUT_NS (200 * NS_PER_MS)

/* Reported by the listener's thread; guarded by lock. */
struct liveliness_change {
	uint64_t sender;
	int is_alive;
};

/* The command that was put on the board and is not answered yet. */
struct pending {
	ecdaq_CommandV1 *command; /* NULL: none */
	uint64_t sender;
	uint64_t sequence; /* of its set on the board */
	int64_t since_ns;
	struct gate_item item[GATE_ITEMS];
};

struct commands {
	const struct config *cfg;
	struct gate *gate;
	struct remote_board board;
	struct pending pending;
	struct commands_counts counts;
	uint64_t session;
	uint64_t alive[GATE_COMMANDERS]; /* 0: free */
	pthread_mutex_t lock;
	struct liveliness_change change[CHANGES_MAX]; /* [listener] */
	size_t change_count;                          /* [listener] */
	int has_overflowed;                           /* [listener] changes were dropped */
};

static void on_liveliness(dds_entity_t reader, const dds_liveliness_changed_status_t status,
			  void *arg)
{
	struct commands *c = arg;

	(void)reader;
	pthread_mutex_lock(&c->lock);
	if (c->change_count == CHANGES_MAX) {
		c->has_overflowed = 1;
	} else if (status.alive_count_change != 0 || status.not_alive_count_change != 0) {
		c->change[c->change_count++] =
			(struct liveliness_change){ .sender = status.last_publication_handle,
						    .is_alive = status.alive_count_change > 0 };
	}
	pthread_mutex_unlock(&c->lock);
}

int commands_create(const struct config *cfg, struct commands **ret_commands)
{
	struct commands *c = calloc(1, sizeof(*c));
	int r;

	if (c == NULL) {
		return -ENOMEM;
	}
	c->cfg = cfg;
	remote_board_init(&c->board);
	pthread_mutex_init(&c->lock, NULL);
	c->gate = gate_create(cfg);
	r = c->gate == NULL ? -ENOMEM
			    : config_run_path(cfg, CONFIG_RUN_COMMANDS_REMOTE, c->board.path,
					      sizeof(c->board.path));
	if (r < 0) {
		commands_destroy(c);
		return r;
	}
	*ret_commands = c;
	return 0;
}

dds_listener_t *commands_listener(struct commands *commands)
{
	dds_listener_t *listener = dds_create_listener(commands);

	if (listener != NULL) {
		dds_lset_liveliness_changed(listener, on_liveliness);
	}
	return listener;
}

void commands_follow(struct commands *commands)
{
	struct board *board;

	/* The board is not opened while commands are disabled. */
	if (!domain_takes_commands(commands->cfg) || remote_board_follow(&commands->board) != 1) {
		return;
	}
	/* A killed ecdaq-dds may have left values there: our first heartbeat must not revive them.
	 */
	board = commands->board.board;
	board_begin(board);
	for (unsigned i = 0; i < BOARD_OUTPUTS; i++) {
		board_unset(board, i);
	}
	board_commit(board);
}

struct commands_counts commands_counts(const struct commands *commands)
{
	return commands->counts;
}

/* --- commanders --- */

static uint64_t *find_alive(struct commands *c, uint64_t sender)
{
	for (size_t i = 0; i < GATE_COMMANDERS; i++) {
		if (c->alive[i] == sender) {
			return &c->alive[i];
		}
	}
	return NULL;
}

/*
 * Revert the outputs that @sender (0: anybody) set to fail-safe. Outputs without a timeout hold
 * their value, unless there is no @table.
 */
static void revert_outputs(struct commands *c, const struct channel_table *table, uint64_t sender)
{
	struct board *board = c->board.board;

	if (board == NULL) {
		return;
	}
	board_begin(board);
	for (unsigned i = 0; i < BOARD_OUTPUTS; i++) {
		uint64_t setter = gate_setter(c->gate, i);

		if (setter != 0 && (sender == 0 || setter == sender) &&
		    (table == NULL || gate_has_timeout(table, c->cfg, i))) {
			board_unset(board, i);
		}
	}
	board_commit(board);
}

static void remove_commander(struct commands *c, const struct channel_table *table, uint64_t sender)
{
	uint64_t *place = find_alive(c, sender);

	if (place != NULL) {
		*place = 0;
	}
	revert_outputs(c, table, sender);
	gate_remove(c->gate, sender);
}

static void add_commander(struct commands *c, uint64_t sender)
{
	uint64_t *place = find_alive(c, sender);

	place = place != NULL ? place : find_alive(c, 0);
	if (place != NULL) {
		*place = sender;
	}
}

static void handle_liveliness(struct commands *c, const struct channel_table *table)
{
	struct liveliness_change change[CHANGES_MAX];
	size_t count;
	int has_overflowed;

	pthread_mutex_lock(&c->lock);
	count = c->change_count;
	has_overflowed = c->has_overflowed;
	memcpy(change, c->change, count * sizeof(change[0]));
	c->change_count = 0;
	c->has_overflowed = 0;
	pthread_mutex_unlock(&c->lock);
	for (size_t i = 0; i < count; i++) {
		if (change[i].is_alive) {
			add_commander(c, change[i].sender);
		} else {
			remove_commander(c, table, change[i].sender);
		}
	}
	/* Changes were dropped: no commander is known to be alive. */
	for (size_t i = 0; has_overflowed && i < GATE_COMMANDERS; i++) {
		if (c->alive[i] != 0) {
			remove_commander(c, table, c->alive[i]);
		}
	}
}

/* The cycle reverts remote outputs when this stops. */
static void heartbeat(struct commands *c)
{
	for (unsigned i = 0; c->board.board != NULL && i < BOARD_OUTPUTS; i++) {
		if (gate_setter(c->gate, i) != 0) {
			atomic_fetch_add_explicit(&c->board.board->beat, 1, memory_order_relaxed);
			return;
		}
	}
}

/* --- replies --- */

static void send_reply(const struct commands *c, const struct topics *topics,
		       const ecdaq_CommandV1 *command, const struct gate_answer *answer)
{
	char reason[GATE_REASON_BYTES];
	ecdaq_ReplyV1 m = {
		.commander = command->commander,
		.id = command->id,
		.session = c->session,
		.is_accepted = answer->is_accepted,
		.cycle = answer->cycle,
		.reason = reason,
	};

	memcpy(reason, answer->reason, sizeof(reason));
	(void)topics_write_now(topics->reply, &m);
}

static void reply(struct commands *c, const struct topics *topics, const ecdaq_CommandV1 *command,
		  uint64_t sender, const struct gate_answer *answer)
{
	gate_note_answer(c->gate, sender, command->id, answer);
	send_reply(c, topics, command, answer);
	if (answer->is_accepted) {
		c->counts.accepted++;
	} else {
		c->counts.refused++;
	}
}

static void finish(struct commands *c)
{
	ecdaq_CommandV1_free(c->pending.command, DDS_FREE_ALL);
	c->pending.command = NULL;
}

/* Answer the pending command once the cycle has taken it, or after the timeout. */
static void check_pending(struct commands *c, const struct topics *topics, int64_t now_ns)
{
	struct pending *p = &c->pending;
	struct board *board = c->board.board;
	struct gate_answer answer = { .is_accepted = 1 };

	if (p->command == NULL) {
		return;
	}
	if (board != NULL &&
	    atomic_load_explicit(&board->taken_sequence, memory_order_acquire) >= p->sequence) {
		answer.cycle = atomic_load_explicit(&board->taken_cycle, memory_order_relaxed);
		reply(c, topics, p->command, p->sender, &answer);
		finish(c);
		return;
	}
	if (board != NULL && now_ns - p->since_ns < TAKE_TIMEOUT_NS) {
		return;
	}
	if (board != NULL) {
		board_begin(board);
		for (uint32_t i = 0; i < p->command->channel._length; i++) {
			board_unset(board, p->item[i].output);
			gate_note_set(c->gate, p->item[i].output, 0);
		}
		board_commit(board);
	}
	answer = (struct gate_answer){ .reason = "not taken by the master in time: reverted" };
	reply(c, topics, p->command, p->sender, &answer);
	finish(c);
}

/* --- commands --- */

/* Put the checked @command on the board; it is pending from now on. */
static void send_set(struct commands *c, ecdaq_CommandV1 *command, uint64_t sender, int64_t now_ns)
{
	struct pending *p = &c->pending;
	struct board *board = c->board.board;

	board_begin(board);
	for (uint32_t i = 0; i < command->channel._length; i++) {
		board_put(board, p->item[i].output, p->item[i].raw);
		gate_note_set(c->gate, p->item[i].output, sender);
	}
	p->sequence = board_commit(board);
	p->command = command;
	p->sender = sender;
	p->since_ns = now_ns;
}

static int check(struct commands *c, const ecdaq_CommandV1 *m, uint64_t sender,
		 const struct gate_view *view, char *reason)
{
	struct gate_command command = {
		.sender = sender,
		.id = m->id,
		.session = m->session,
		.not_after_cycle = m->not_after_cycle,
		.is_raw = m->is_raw,
		.count = m->channel._length,
		.value_count = m->values._length,
		.raw_count = m->raw._length,
		.channel = m->channel._buffer,
		.values = m->values._buffer,
		.raw = m->raw._buffer,
	};
	int r = gate_check(c->gate, &command, view, c->pending.item, reason);

	if (r == 0 && find_alive(c, sender) == NULL) {
		snprintf(reason, GATE_REASON_BYTES,
			 "the commander is not alive, or there are too many");
		r = -EPERM;
	}
	if (r == 0 && c->board.board == NULL) {
		snprintf(reason, GATE_REASON_BYTES, "%s cannot be written",
			 CONFIG_RUN_COMMANDS_REMOTE);
		r = -EACCES;
	}
	return r;
}

/* Returns 1 if there may be more. */
static int take_command(struct commands *c, const struct topics *topics,
			const struct gate_view *view)
{
	ecdaq_CommandV1 *command;
	uint64_t sender;
	const struct gate_answer *given;
	struct gate_answer refusal = { .is_accepted = 0 };

	if (!topics_take_command(topics, &command, &sender)) {
		return 0;
	}
	given = gate_find_answer(c->gate, sender, command->id);
	if (given != NULL) {
		send_reply(c, topics, command, given);
	} else if (check(c, command, sender, view, refusal.reason) == 0) {
		send_set(c, command, sender, view->now_ns);
		return 0;
	} else {
		reply(c, topics, command, sender, &refusal);
	}
	ecdaq_CommandV1_free(command, DDS_FREE_ALL);
	return 1;
}

int commands_step(struct commands *commands, const struct topics *topics,
		  const struct gate_view *view)
{
	struct commands *c = commands;
	uint64_t session = view->table == NULL ? 0 : view->table->meta.session;

	handle_liveliness(c, view->table);
	check_pending(c, topics, view->now_ns);
	if (session != c->session) {
		/* Another run of the master, with a new board: nothing is set on it. */
		for (unsigned i = 0; i < BOARD_OUTPUTS; i++) {
			gate_note_set(c->gate, i, 0);
		}
		gate_forget_answers(c->gate);
		c->session = session;
	}
	for (int n = 0; c->pending.command == NULL && n < REFUSALS_PER_STEP; n++) {
		if (!take_command(c, topics, view)) {
			break;
		}
	}
	heartbeat(c);
	return c->pending.command != NULL;
}

void commands_destroy(struct commands *commands)
{
	if (commands == NULL) {
		return;
	}
	if (commands->gate != NULL) {
		revert_outputs(commands, NULL, 0);
	}
	if (commands->pending.command != NULL) {
		finish(commands);
	}
	remote_board_close(&commands->board);
	gate_destroy(commands->gate);
	pthread_mutex_destroy(&commands->lock);
	free(commands);
}
