/* SPDX-License-Identifier: MIT */
#include "record/recorder.h"

#include <errno.h>
#include <string.h>

#include "base/clock.h"
#include "harness/test.h"
#include "record/log.h"
#include "record/store.h"
#include "unit/services/record/bench.h"

static void check_cycles(struct bench *b, uint64_t first, uint64_t count, unsigned files)
{
	unsigned finished;
	unsigned parts;
	struct track t = bench_read(b, &finished, &parts);

	CHECK_EQ(t.gaps, 0);
	CHECK_EQ(t.backward, 0);
	CHECK_EQ(t.cycles, count);
	CHECK_EQ(t.first_cycle, first);
	CHECK_EQ(t.last_cycle, first + count - 1);
	CHECK_EQ(finished, files);
	CHECK_EQ(parts, 0);
}

/* One run of the recorder, from start to stop, over the cycles that come meanwhile. */
static void record(struct bench *b, uint64_t first, uint64_t count)
{
	CHECK_EQ(bench_start(b), 0);
	bench_push(b, first, count);
	bench_wait(b, NS_PER_S);
	CHECK_EQ(bench_stop(b), 0);
}

static int check_log(struct bench *b)
{
	const char *paths[] = { b->dir };
	FILE *nowhere = fopen("/dev/null", "w");
	int r;

	CHECK(nowhere != NULL);
	r = log_check(paths, 1, LOG_TEXT, nowhere, nowhere);
	fclose(nowhere);
	return r;
}

TEST(recorder, records_from_the_oldest_slot_of_a_session_it_does_not_know)
{
	struct bench b = { .calls = 0 };

	bench_init(&b, 100, 4096);
	bench_push(&b, 0, 1000);
	CHECK_EQ(bench_start(&b), 0);
	bench_run(&b);
	bench_push(&b, 1000, 500);
	bench_wait(&b, NS_PER_S);
	CHECK_EQ(recorder_status(b.recorder)->state, RECORD_RUNNING);
	CHECK_EQ(recorder_status(b.recorder)->recorded_cycles, 1500);
	CHECK_EQ(recorder_status(b.recorder)->synced_cycle, 1499);
	CHECK_EQ(bench_stop(&b), 0);
	check_cycles(&b, 0, 1500, 1);
	CHECK_EQ(check_log(&b), EXIT_CODE_OK);
	bench_done(&b);
}

TEST(recorder, stop_drains_what_is_in_the_ring)
{
	struct bench b = { .calls = 0 };

	bench_init(&b, 100, 8192);
	CHECK_EQ(bench_start(&b), 0);
	bench_run(&b);
	bench_push(&b, 0, 7000);
	bench_wait(&b, NS_PER_S / 5);
	bench_push(&b, 7000, 500);
	CHECK_EQ(bench_stop(&b), 0);
	check_cycles(&b, 0, 7500, 1);
	bench_done(&b);
}

TEST(recorder, closed_ring_ends_the_session_and_the_next_run_of_the_master_is_another)
{
	struct bench b = { .calls = 0 };

	bench_init(&b, 100, 4096);
	CHECK_EQ(bench_start(&b), 0);
	bench_push(&b, 0, 300);
	bench_run(&b);
	ring_close(b.ring);
	CHECK_EQ(bench_run(&b), 1);
	check_cycles(&b, 0, 300, 1);
	bench_wait(&b, NS_PER_S);
	CHECK_EQ(recorder_status(b.recorder)->state, RECORD_WAITING);
	bench_restart_master(&b, 200, 1);
	bench_push(&b, 0, 50);
	bench_wait(&b, NS_PER_S);
	CHECK_EQ(recorder_status(b.recorder)->session, 200);
	CHECK_EQ(recorder_status(b.recorder)->recorded_cycles, 50);
	CHECK_EQ(bench_stop(&b), 0);
	CHECK_EQ(check_log(&b), EXIT_CODE_OK);
	bench_done(&b);
}

TEST(recorder, a_replaced_ring_is_drained_before_the_next_is_opened)
{
	struct bench b = { .calls = 0 };
	unsigned finished;
	unsigned parts;

	bench_init(&b, 100, 4096);
	CHECK_EQ(bench_start(&b), 0);
	bench_push(&b, 0, 10);
	bench_run(&b);
	bench_push(&b, 10, 3000);
	bench_restart_master(&b, 200, 0);
	bench_push(&b, 0, 20);
	bench_wait(&b, NS_PER_S);
	CHECK_EQ(bench_stop(&b), 0);
	/* The second session starts at 0 again: once back, and all cycles of both are there. */
	CHECK_EQ(bench_read(&b, &finished, &parts).cycles, 3010 + 20);
	CHECK_EQ(finished, 2);
	CHECK_EQ(check_log(&b), EXIT_CODE_OK);
	bench_done(&b);
}

TEST(recorder, killed_and_started_again_no_cycle_is_missing_or_doubled)
{
	struct bench b = { .has_even_times = 1 };

	bench_init(&b, 100, 32768);
	CHECK_EQ(bench_start(&b), 0);
	for (uint64_t n = 0; n < 10; n++) {
		bench_push(&b, n * 1777, 1777);
		bench_wait(&b, 130 * NS_PER_MS);
		bench_kill(&b);
		bench_push_event(&b, n);
		CHECK_EQ(bench_start(&b), 0);
	}
	bench_wait(&b, NS_PER_S);
	/* The figures are of the session, not of the process. */
	CHECK_EQ(recorder_status(b.recorder)->recorded_cycles, 17770);
	CHECK_EQ(recorder_status(b.recorder)->first_cycle, 0);
	CHECK_EQ(recorder_status(b.recorder)->recorded_gaps, 0);
	CHECK_EQ(bench_stop(&b), 0);
	{
		unsigned finished;
		unsigned parts;
		struct track t = bench_read(&b, &finished, &parts);

		CHECK_EQ(t.cycles, 17770);
		CHECK_EQ(t.gaps + t.backward, 0);
		CHECK_EQ(parts, 0);
		CHECK_EQ(t.event_next, 10);
	}
	CHECK_EQ(check_log(&b), EXIT_CODE_OK);
	bench_done(&b);
}

TEST(recorder, goes_on_by_the_state_file_when_the_recordings_were_taken_away)
{
	struct bench b = { .calls = 0 };
	unsigned finished;
	unsigned parts;

	bench_init(&b, 100, 4096);
	record(&b, 0, 1000);
	{
		char command[512];
		struct store_entry *entries;
		size_t count;

		CHECK_EQ(store_list(b.dir, &entries, &count), 0);
		CHECK_EQ(count, 1);
		CHECK_EQ(store_path(b.dir, entries[0].name, command, sizeof(command)), 0);
		CHECK_EQ(remove(command), 0);
		free(entries);
	}
	record(&b, 1000, 10);
	CHECK_EQ(bench_read(&b, &finished, &parts).first_cycle, 1000);
	bench_done(&b);
}

TEST(recorder, goes_on_by_the_newest_recording_when_the_state_file_is_lost)
{
	struct bench b = { .calls = 0 };
	char state[512];

	bench_init(&b, 100, 4096);
	record(&b, 0, 1000);
	CHECK_EQ(store_path(b.dir, ".ecdaq-record.state", state, sizeof(state)), 0);
	CHECK_EQ(remove(state), 0);
	record(&b, 1000, 10);
	check_cycles(&b, 0, 1010, 2);
	bench_done(&b);
}

TEST(recorder, away_for_longer_than_the_ring_is_deep_is_one_exact_gap)
{
	struct bench b = { .calls = 0 };
	unsigned finished;
	unsigned parts;
	struct track t;

	bench_init(&b, 100, 1024);
	CHECK_EQ(bench_start(&b), 0);
	bench_push(&b, 0, 500);
	bench_wait(&b, NS_PER_S);
	bench_kill(&b);
	bench_push(&b, 500, 5000);
	CHECK_EQ(bench_start(&b), 0);
	bench_wait(&b, NS_PER_S);
	CHECK_EQ(recorder_status(b.recorder)->recorded_gaps, 1);
	t = bench_read(&b, &finished, &parts);
	CHECK_EQ(t.gaps, 1);
	CHECK_EQ(t.last_cycle, 5499);
	CHECK_EQ(t.cycles + t.missing, 5500);
	CHECK_EQ(recorder_status(b.recorder)->cycles_missing, t.missing);
	bench_kill(&b);
	CHECK_EQ(bench_start(&b), 0);
	bench_push(&b, 5500, 1);
	bench_wait(&b, NS_PER_S);
	CHECK_EQ(recorder_status(b.recorder)->recorded_gaps, 1);
	CHECK_EQ(recorder_status(b.recorder)->cycles_missing, t.missing);
	CHECK_EQ(recorder_status(b.recorder)->recorded_cycles, t.cycles + 1);
	CHECK_EQ(bench_stop(&b), 0);
	CHECK_EQ(check_log(&b), EXIT_CODE_FAILED);
	bench_done(&b);
}

TEST(recorder, rotates_by_size_and_by_time_without_a_gap)
{
	struct bench b = { .has_even_times = 1 };
	unsigned finished;
	unsigned parts;
	struct track t;

	bench_init(&b, 100, 4096);
	b.options.rotate_bytes = 40000;
	b.options.rotate_period_ns = 3 * NS_PER_S;
	CHECK_EQ(bench_start(&b), 0);
	for (uint64_t n = 0; n < 100; n++) {
		bench_push(&b, n * 50, 50);
		bench_wait(&b, 50 * NS_PER_MS);
	}
	b.options.rotate_bytes = 0;
	CHECK_EQ(bench_stop(&b), 0);
	t = bench_read(&b, &finished, &parts);
	CHECK(finished > 4);
	CHECK_EQ(parts, 0);
	CHECK_EQ(t.gaps + t.backward, 0);
	CHECK_EQ(t.cycles, 5000);
	CHECK_EQ(check_log(&b), EXIT_CODE_OK);
	bench_done(&b);
}

TEST(recorder, the_oldest_recordings_go_to_hold_the_budget)
{
	struct bench b = { .calls = 0 };
	unsigned finished;
	unsigned parts;
	struct track t;

	bench_init(&b, 100, 4096);
	b.options.rotate_bytes = 30000;
	b.options.budget_bytes = 150000;
	CHECK_EQ(bench_start(&b), 0);
	for (uint64_t n = 0; n < 200; n++) {
		bench_push(&b, n * 100, 100);
		bench_wait(&b, 100 * NS_PER_MS);
	}
	CHECK_EQ(bench_stop(&b), 0);
	t = bench_read(&b, &finished, &parts);
	CHECK(finished >= 3 && finished <= 6);
	CHECK(t.first_cycle > 1000);
	CHECK_EQ(t.last_cycle, 19999);
	CHECK_EQ(t.gaps + t.backward, 0);
	bench_done(&b);
}

TEST(recorder, skipped_cycle_numbers_are_a_gap_with_its_reason)
{
	struct bench b = { .calls = 0 };
	unsigned finished;
	unsigned parts;
	struct track t;

	bench_init(&b, 100, 4096);
	CHECK_EQ(bench_start(&b), 0);
	bench_push(&b, 0, 100);
	bench_push(&b, 107, 100);
	bench_wait(&b, NS_PER_S);
	CHECK_EQ(recorder_status(b.recorder)->recorded_gaps, 1);
	CHECK_EQ(recorder_status(b.recorder)->cycles_missing, 7);
	CHECK_EQ(bench_stop(&b), 0);
	t = bench_read(&b, &finished, &parts);
	CHECK_EQ(t.gaps, 1);
	CHECK_EQ(t.missing, 7);
	CHECK(t.events >= 2); /* started, gap */
	bench_done(&b);
}

TEST(recorder, a_second_one_in_the_same_directory_is_refused)
{
	struct bench b = { .calls = 0 };
	struct recorder *second = NULL;
	char error[256];

	bench_init(&b, 100, 64);
	CHECK_EQ(bench_start(&b), 0);
	CHECK_EQ(recorder_create(&b.options, &second, error, sizeof(error)), -EBUSY);
	CHECK(strstr(error, "another ecdaq-record (process ") != NULL);
	CHECK(second == NULL);
	bench_kill(&b);
	CHECK_EQ(bench_start(&b), 0);
	bench_done(&b);
}

TEST(recorder, waits_for_a_ring_and_says_what_is_wrong_with_a_foreign_one)
{
	struct bench b = { .calls = 0 };
	FILE *f;

	bench_init(&b, 100, 64);
	CHECK_EQ(remove(b.ring_path), 0);
	CHECK_EQ(bench_start(&b), 0);
	bench_wait(&b, NS_PER_S);
	CHECK_EQ(recorder_status(b.recorder)->state, RECORD_WAITING);
	CHECK(strstr(b.said, "waiting for ") != NULL);
	CHECK_EQ(recorder_ring_error(b.recorder), 0); /* it may come */
	f = fopen(b.ring_path, "w");
	CHECK(f != NULL);
	for (int i = 0; i < 10000; i++) {
		fputc(i % 256, f);
	}
	fclose(f);
	bench_wait(&b, NS_PER_S);
	CHECK(strstr(b.said, "not a sample ring") != NULL);
	CHECK_EQ(recorder_ring_error(b.recorder), -EPROTO); /* --once ends here */
	bench_restart_master(&b, 300, 1);
	bench_push(&b, 5, 5);
	bench_wait(&b, NS_PER_S);
	CHECK_EQ(bench_stop(&b), 0);
	check_cycles(&b, 5, 5, 1);
	bench_done(&b);
}

TEST(recorder, a_step_of_the_clock_begins_a_new_file_so_that_times_go_up_in_each)
{
	struct bench b = { .calls = 0 };
	unsigned finished;
	unsigned parts;
	struct track t;

	bench_init(&b, 100, 16384);
	CHECK_EQ(bench_start(&b), 0);
	bench_push(&b, 0, 3000);
	bench_run(&b);
	b.tai_step_ns = -3600 * NS_PER_S;
	bench_push(&b, 3000, 3000);
	bench_run(&b);
	CHECK_EQ(bench_stop(&b), 0);
	t = bench_read(&b, &finished, &parts);
	CHECK_EQ(finished, 2);
	CHECK_EQ(t.cycles, 6000);
	CHECK_EQ(t.gaps, 0);
	CHECK(strstr(b.said, "took a step of -3600") != NULL);
	bench_done(&b);
}

TEST(recorder, a_clock_that_does_not_stop_stepping_makes_a_file_in_10_s_and_loses_nothing)
{
	struct bench b = { .calls = 0 };
	unsigned finished;
	unsigned parts;
	struct track t;

	bench_init(&b, 100, 65536);
	CHECK_EQ(bench_start(&b), 0);
	for (uint64_t n = 0; n < 30; n++) {
		b.tai_step_ns = n % 2 == 0 ? 0 : 3600 * NS_PER_S;
		bench_push(&b, n * 1000, 1000);
		bench_wait(&b, NS_PER_S);
	}
	CHECK_EQ(bench_stop(&b), 0);
	t = bench_read(&b, &finished, &parts);
	CHECK(finished >= 3 && finished <= 5);
	CHECK_EQ(parts, 0);
	CHECK_EQ(t.cycles, 30000);
	CHECK_EQ(t.gaps, 0);
	CHECK(strstr(b.said, "steps: new file") != NULL);
	bench_done(&b);
}

TEST(recorder, no_sample_no_file)
{
	struct bench b = { .calls = 0 };
	unsigned finished;
	unsigned parts;

	bench_init(&b, 100, 64);
	CHECK_EQ(bench_start(&b), 0);
	bench_wait(&b, 3 * NS_PER_S);
	CHECK_EQ(bench_stop(&b), 0);
	bench_read(&b, &finished, &parts);
	CHECK_EQ(finished + parts, 0);
	bench_done(&b);
}
