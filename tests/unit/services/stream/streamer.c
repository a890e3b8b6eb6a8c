/* SPDX-License-Identifier: MIT */
/* The whole way from a ring to a broker that is made here: it stores in memory, and fails the n-th
 * call, before or after it has stored what it was given. */
#include "stream/streamer.h"

#include <errno.h>
#include <inttypes.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "harness/made_ring.h"
#include "harness/test.h"
#include "stream/broker.h"

enum { STORED = 4096, CYCLES = 1000, BLOCK = 100, NEVER = 0 };

enum failing { FAIL_BEFORE, FAIL_HALFWAY, FAIL_AFTER };

struct broker {
	int is_connected;
};

struct stored {
	char subject[BROKER_SUBJECT_BYTES];
	struct mark mark;
	char id[BROKER_ID_BYTES];
};

static struct broker the_broker;
static struct stored stored[STORED];
static size_t stored_count;
static unsigned calls; /* of broker_store() */
static unsigned fail_at;
static enum failing how;
static unsigned lines; /* reported */

int broker_create(const struct config *cfg, const char *appliance, struct broker **ret_broker,
		  char problem[BROKER_PROBLEM_BYTES])
{
	(void)cfg;
	(void)appliance;
	(void)problem;
	*ret_broker = &the_broker;
	return 0;
}

void broker_destroy(struct broker *b)
{
	(void)b;
}

int broker_connect(struct broker *b, char problem[BROKER_PROBLEM_BYTES])
{
	(void)problem;
	b->is_connected = 1;
	return 0;
}

void broker_disconnect(struct broker *b)
{
	b->is_connected = 0;
}

int broker_is_connected(const struct broker *b)
{
	return b->is_connected;
}

const char *broker_server(const struct broker *b)
{
	(void)b;
	return "nats://made";
}

size_t broker_payload_limit(const struct broker *b)
{
	(void)b;
	return 1 << 20;
}

/* "*" stands for the slave's name. */
static int matches(const char *subject, const char *pattern)
{
	const char *star = strchr(pattern, '*');
	size_t head = star == NULL ? 0 : (size_t)(star - pattern);

	if (star == NULL) {
		return strcmp(subject, pattern) == 0;
	}
	return strncmp(subject, pattern, head) == 0 && strstr(subject + head, star + 1) != NULL;
}

int broker_newest(struct broker *b, const char *subject, struct broker_newest *ret,
		  char problem[BROKER_PROBLEM_BYTES])
{
	(void)b;
	(void)problem;
	for (size_t i = stored_count; i > 0; i--) {
		const struct stored *s = &stored[i - 1];

		if (matches(s->subject, subject)) {
			*ret = (struct broker_newest){ .sequence = i, .mark = s->mark };
			memcpy(ret->id, s->id, sizeof(ret->id));
			return 1;
		}
	}
	return 0;
}

static int fail(struct broker *b, char *problem)
{
	snprintf(problem, BROKER_PROBLEM_BYTES, "made to fail");
	b->is_connected = 0;
	return -EIO;
}

int broker_store(struct broker *b, struct broker_message *message, size_t count,
		 char problem[BROKER_PROBLEM_BYTES])
{
	int is_failing = ++calls == fail_at;

	if (is_failing && how == FAIL_BEFORE) {
		return fail(b, problem);
	}
	for (size_t i = 0; i < count; i++) {
		struct broker_newest newest = { .sequence = 0 };
		struct stored *s = &stored[stored_count];

		if (is_failing && how == FAIL_HALFWAY && i >= (count + 1) / 2) {
			return fail(b, problem);
		}
		(void)broker_newest(b, message[i].subject, &newest, problem);
		if (message[i].after != BROKER_ANY && message[i].after != newest.sequence) {
			test_fail(__FILE__, __LINE__, "%s: would be doubled or out of order",
				  message[i].id);
		}
		snprintf(s->subject, sizeof(s->subject), "%s", message[i].subject);
		memcpy(s->id, message[i].id, sizeof(s->id));
		s->mark = message[i].mark;
		message[i].sequence = ++stored_count;
	}
	return is_failing ? fail(b, problem) : 0;
}

static void report(const char *line)
{
	(void)line;
	lines++;
}

static struct config cfg;
static struct streamer *streamer;
static struct ring *ring;

static void make(const char *name, unsigned failing_call, enum failing failing)
{
	const struct made_meta meta = made_meta();
	char path[CONFIG_PATH_BYTES];
	char error[256];

	config_defaults(&cfg);
	snprintf(cfg.run_dir, sizeof(cfg.run_dir), "%s", made_path(name));
	mkdir(cfg.run_dir, 0700);
	snprintf(cfg.record_dir, sizeof(cfg.record_dir), "/nonexistent");
	snprintf(cfg.stream_appliance, sizeof(cfg.stream_appliance), "rig");
	cfg.stream_block_cycles = BLOCK;
	CHECK_EQ(config_run_path(&cfg, CONFIG_RUN_SAMPLES, path, sizeof(path)), 0);
	ring = made_ring(path, &meta, 4096);
	stored_count = 0;
	calls = 0;
	lines = 0;
	fail_at = failing_call;
	how = failing;
	the_broker.is_connected = 0;
	CHECK_EQ(streamer_create(&cfg, report, &streamer, error, sizeof(error)), 0);
}

static void done(void)
{
	char path[CONFIG_PATH_BYTES];

	streamer_destroy(streamer);
	ring_destroy(ring);
	CHECK_EQ(config_run_path(&cfg, CONFIG_RUN_SAMPLES, path, sizeof(path)), 0);
	unlink(path);
	CHECK_EQ(config_run_path(&cfg, CONFIG_RUN_STREAM_STATUS, path, sizeof(path)), 0);
	unlink(path);
	*strrchr(path, '/') = '\0';
	rmdir(path);
	rmdir(cfg.run_dir);
}

/* One past the newest cycle of @slave, whose blocks must follow each other. */
static uint64_t cycles_of(const char *slave)
{
	char subject[BROKER_SUBJECT_BYTES];
	uint64_t next = 0;

	snprintf(subject, sizeof(subject), "ecdaq.rig.%s.block", slave);
	for (size_t i = 0; i < stored_count; i++) {
		const uint64_t *value = stored[i].mark.value;

		if (strcmp(stored[i].subject, subject) == 0) {
			CHECK_EQ(value[MARK_SESSION], MADE_SESSION);
			CHECK_EQ(value[MARK_FIRST_CYCLE], next);
			next = value[MARK_NEXT_CYCLE];
		}
	}
	return next;
}

static void run_until(uint64_t cycles)
{
	while (cycles_of("a") < cycles || cycles_of("b") < cycles) {
		int64_t wait_ns = streamer_step(streamer);

		(void)poll(NULL, 0, (int)(wait_ns / 1000000));
	}
}

static void push(uint64_t first, uint64_t count)
{
	for (uint64_t cycle = first; cycle < first + count; cycle++) {
		made_push(ring, cycle, 0, 0);
	}
}

TEST(stream_streamer, both_slaves_and_their_description_are_sent)
{
	make("stream-plain", NEVER, FAIL_BEFORE);
	push(0, CYCLES);
	run_until(CYCLES);
	CHECK_STR(stored[0].subject, "ecdaq.rig.channels");
	CHECK_EQ(cycles_of("a"), CYCLES);
	CHECK_EQ(cycles_of("b"), CYCLES);
	CHECK_EQ(lines, 0);
	done();
}

TEST(stream_streamer, whichever_exchange_fails_every_cycle_is_stored_once)
{
	for (unsigned call = 1; call <= 4; call++) {
		for (int failing = FAIL_BEFORE; failing <= FAIL_AFTER; failing++) {
			make("stream-fail", call, (enum failing)failing);
			for (uint64_t cycle = 0; cycle < CYCLES; cycle += BLOCK) {
				push(cycle, BLOCK);
				(void)streamer_step(streamer);
			}
			run_until(CYCLES);
			CHECK(calls > call);
			CHECK_EQ(cycles_of("a"), CYCLES);
			CHECK_EQ(cycles_of("b"), CYCLES);
			CHECK_EQ(lines, 2); /* the problem, and that it is over */
			done();
		}
	}
}

TEST(stream_streamer, a_jump_of_the_cycle_number_is_an_event)
{
	make("stream-gap", NEVER, FAIL_BEFORE);
	push(0, 150);
	push(170, 80);
	for (int n = 0; n < 1000 && stored_count < 6; n++) {
		(void)streamer_step(streamer);
		(void)poll(NULL, 0, 2);
	}
	CHECK_STR(stored[3].subject, "ecdaq.rig.event");
	CHECK_STR(stored[3].id, "4711-stream_gap-150");
	CHECK_EQ(stored[4].mark.value[MARK_FIRST_CYCLE], 170);
	CHECK_EQ(stored[4].mark.value[MARK_NEXT_CYCLE], 250);
	done();
}
