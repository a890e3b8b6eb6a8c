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

enum { REFUSALS_A_STEP = 32, NEWS = 256 };

/* Longer than any recovery of a cycle, shorter than a person's patience. */
#define TAKEN_WITHIN_NS (200 * NS_PER_MS)

/* What the listener's thread heard; guarded by lock. */
struct news {
	uint64_t sender;
	int is_alive;
};

struct flight {
	ecdaq_CommandV1 *command; /* NULL: none is on its way */
	uint64_t sender;
	uint64_t sequence; /* of its set */
	int64_t since_ns;
	struct gate_item item[GATE_ITEMS];
};

struct commands {
	const struct config *cfg;
	struct gate *gate;
	struct remote_board board;
	struct flight flight;
	struct commands_counts counts;
	uint64_t session;
	uint64_t alive[GATE_COMMANDERS]; /* 0: free */
	pthread_mutex_t lock;
	struct news news[NEWS]; /* [listener] */
	size_t news_count;      /* [listener] */
	int has_lost_news;      /* [listener] */
};

static void on_liveliness(dds_entity_t reader, const dds_liveliness_changed_status_t status,
			  void *arg)
{
	struct commands *c = arg;

	(void)reader;
	pthread_mutex_lock(&c->lock);
	if (c->news_count == NEWS) {
		c->has_lost_news = 1;
	} else if (status.alive_count_change != 0 || status.not_alive_count_change != 0) {
		c->news[c->news_count++] =
			(struct news){ .sender = status.last_publication_handle,
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

	/* Where commands are off the board is not even opened. */
	if (!domain_takes_commands(commands->cfg) || remote_board_follow(&commands->board) != 1) {
		return;
	}
	/* What an ecdaq-dds that was killed left there must not come back with our first beat. */
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

/* What @sender set goes back to fail-safe, but for outputs without a time-out, which hold. 0: all.
 */
static void take_back(struct commands *c, const struct slave_table *table, uint64_t sender)
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

static void lose(struct commands *c, const struct slave_table *table, uint64_t sender)
{
	uint64_t *place = find_alive(c, sender);

	if (place != NULL) {
		*place = 0;
	}
	take_back(c, table, sender);
	gate_lose(c->gate, sender);
}

static void gain(struct commands *c, uint64_t sender)
{
	uint64_t *place = find_alive(c, sender);

	place = place != NULL ? place : find_alive(c, 0);
	if (place != NULL) {
		*place = sender;
	}
}

static void hear(struct commands *c, const struct slave_table *table)
{
	struct news news[NEWS];
	size_t count;
	int has_lost;

	pthread_mutex_lock(&c->lock);
	count = c->news_count;
	has_lost = c->has_lost_news;
	memcpy(news, c->news, count * sizeof(news[0]));
	c->news_count = 0;
	c->has_lost_news = 0;
	pthread_mutex_unlock(&c->lock);
	for (size_t i = 0; i < count; i++) {
		if (news[i].is_alive) {
			gain(c, news[i].sender);
		} else {
			lose(c, table, news[i].sender);
		}
	}
	/* More came than we could hear: nobody is known to be alive any more. */
	for (size_t i = 0; has_lost && i < GATE_COMMANDERS; i++) {
		if (c->alive[i] != 0) {
			lose(c, table, c->alive[i]);
		}
	}
}

static void beat(struct commands *c)
{
	for (unsigned i = 0; c->board.board != NULL && i < BOARD_OUTPUTS; i++) {
		if (gate_setter(c->gate, i) != 0) {
			atomic_fetch_add_explicit(&c->board.board->beat, 1, memory_order_relaxed);
			return;
		}
	}
}

/* --- answers --- */

static void reply(struct commands *c, const struct topics *topics, const ecdaq_CommandV1 *command,
		  uint64_t cycle, char *reason)
{
	ecdaq_ReplyV1 m = {
		.commander = command->commander,
		.id = command->id,
		.session = c->session,
		.is_accepted = reason[0] == '\0',
		.cycle = cycle,
		.reason = reason,
	};

	(void)topics_write_now(topics->reply, &m);
	c->counts.accepted += m.is_accepted;
	c->counts.refused += !m.is_accepted;
}

static void land(struct commands *c)
{
	ecdaq_CommandV1_free(c->flight.command, DDS_FREE_ALL);
	c->flight.command = NULL;
}

/* Has the cycle taken the set that is on its way? */
static void look_after_flight(struct commands *c, const struct topics *topics, int64_t now_ns)
{
	struct flight *f = &c->flight;
	struct board *board = c->board.board;
	char no_reason[1] = "";
	char late[] = "the master did not take it in time; taken back";

	if (f->command == NULL) {
		return;
	}
	if (board != NULL &&
	    atomic_load_explicit(&board->taken_sequence, memory_order_acquire) >= f->sequence) {
		reply(c, topics, f->command,
		      atomic_load_explicit(&board->taken_cycle, memory_order_relaxed), no_reason);
		land(c);
		return;
	}
	if (board != NULL && now_ns - f->since_ns < TAKEN_WITHIN_NS) {
		return;
	}
	if (board != NULL) {
		board_begin(board);
		for (uint32_t i = 0; i < f->command->channel._length; i++) {
			board_unset(board, f->item[i].output);
			gate_note_set(c->gate, f->item[i].output, 0);
		}
		board_commit(board);
	}
	reply(c, topics, f->command, 0, late);
	land(c);
}

/* --- commands --- */

static void launch(struct commands *c, ecdaq_CommandV1 *command, uint64_t sender, int64_t now_ns)
{
	struct flight *f = &c->flight;
	struct board *board = c->board.board;

	board_begin(board);
	for (uint32_t i = 0; i < command->channel._length; i++) {
		board_put(board, f->item[i].output, f->item[i].raw);
		gate_note_set(c->gate, f->item[i].output, sender);
	}
	f->sequence = board_commit(board);
	f->command = command;
	f->sender = sender;
	f->since_ns = now_ns;
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
	int r = gate_check(c->gate, &command, view, c->flight.item, reason);

	if (r == 0 && find_alive(c, sender) == NULL) {
		snprintf(reason, GATE_REASON_BYTES, "the commander is gone, or one too many");
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
static int take_one(struct commands *c, const struct topics *topics, const struct gate_view *view)
{
	ecdaq_CommandV1 *command = ecdaq_CommandV1__alloc();
	void *message = command;
	dds_sample_info_t info;
	char reason[GATE_REASON_BYTES] = "";
	int taken = dds_take(topics->command, &message, &info, 1, 1);

	if (taken == 1 && info.valid_data &&
	    check(c, command, info.publication_handle, view, reason) == 0) {
		launch(c, command, info.publication_handle, view->now_ns);
		return 0;
	}
	if (taken == 1 && info.valid_data) {
		reply(c, topics, command, 0, reason);
	}
	ecdaq_CommandV1_free(command, DDS_FREE_ALL);
	return taken == 1;
}

int commands_step(struct commands *commands, const struct topics *topics,
		  const struct gate_view *view)
{
	struct commands *c = commands;
	uint64_t session = view->table == NULL ? 0 : view->table->meta->session;

	hear(c, view->table);
	look_after_flight(c, topics, view->now_ns);
	if (session != c->session) {
		/* Another run of the master, with a board that knows nothing of the last one's. */
		for (unsigned i = 0; i < BOARD_OUTPUTS; i++) {
			gate_note_set(c->gate, i, 0);
		}
		c->session = session;
	}
	for (int n = 0; c->flight.command == NULL && n < REFUSALS_A_STEP; n++) {
		if (!take_one(c, topics, view)) {
			break;
		}
	}
	beat(c);
	return c->flight.command != NULL;
}

void commands_destroy(struct commands *commands)
{
	if (commands == NULL) {
		return;
	}
	if (commands->gate != NULL) {
		take_back(commands, NULL, 0);
	}
	remote_board_close(&commands->board);
	gate_destroy(commands->gate);
	pthread_mutex_destroy(&commands->lock);
	free(commands);
}
