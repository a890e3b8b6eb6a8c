/* SPDX-License-Identifier: MIT */
/* Full and failing disks under a recorder. */
#include <errno.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <unistd.h>

#include "base/bytes.h"
#include "base/clock.h"
#include "harness/test.h"
#include "record/recover_file.h"
#include "record/store.h"
#include "unit/services/record/bench.h"

/* Found nowhere else in a recording. */
#define FIRST_EVENT UINT64_C(0x5eed0123456789ab)

static struct track read_all(struct bench *b)
{
	unsigned finished;
	unsigned parts;
	struct track t = bench_read(b, &finished, &parts);

	CHECK_EQ(parts, 0);
	CHECK_EQ(t.backward, 0);
	return t;
}

TEST(recorder_trouble, below_the_reserve_it_stops_with_an_alarm_until_there_is_space)
{
	struct bench b = { .calls = 0 };
	struct track t;

	bench_init(&b, 100, 8192);
	b.options.reserve_bytes = 1000000;
	CHECK_EQ(bench_start(&b), 0);
	bench_push(&b, 0, 500);
	bench_wait(&b, 2 * NS_PER_S);
	b.bytes_free = 999999;
	bench_push(&b, 500, 500);
	bench_wait(&b, 2 * NS_PER_S);
	CHECK_EQ(recorder_status(b.recorder)->state, RECORD_DISK_FULL);
	CHECK(strstr(recorder_status(b.recorder)->message, "disk full") != NULL);
	bench_push(&b, 1000, 2000);
	bench_wait(&b, 3 * NS_PER_S);
	CHECK(recorder_status(b.recorder)->recorded_cycles < 1500);
	CHECK_EQ(read_all(&b).gaps, 0); /* what was written is a whole file */
	b.bytes_free = 1000001;         /* not yet: an eighth above the reserve is wanted */
	bench_wait(&b, 3 * NS_PER_S);
	CHECK_EQ(recorder_status(b.recorder)->state, RECORD_DISK_FULL);
	b.bytes_free = 2000000;
	bench_wait(&b, 3 * NS_PER_S);
	CHECK_EQ(recorder_status(b.recorder)->state, RECORD_RUNNING);
	CHECK_STR(recorder_status(b.recorder)->message, "");
	CHECK_EQ(bench_stop(&b), 0);
	t = read_all(&b);
	CHECK_EQ(t.cycles, 3000);
	CHECK_EQ(t.gaps, 0);  /* the ring held them */
	CHECK(t.events >= 4); /* started, started, disk full, resumed */
	bench_done(&b);
}

TEST(recorder_trouble, a_disk_that_stays_full_costs_exactly_what_left_the_ring)
{
	struct bench b = { .calls = 0 };
	struct track t;

	bench_init(&b, 100, 1024);
	b.options.reserve_bytes = 1000000;
	CHECK_EQ(bench_start(&b), 0);
	bench_push(&b, 0, 500);
	bench_wait(&b, 2 * NS_PER_S);
	b.bytes_free = 0;
	bench_wait(&b, 2 * NS_PER_S);
	for (uint64_t n = 0; n < 10; n++) {
		bench_push(&b, 500 + n * 500, 500);
		bench_wait(&b, NS_PER_S / 2);
	}
	b.bytes_free = UINT64_C(1) << 40;
	bench_wait(&b, 3 * NS_PER_S);
	CHECK_EQ(bench_stop(&b), 0);
	t = read_all(&b);
	CHECK_EQ(t.gaps, 1);
	CHECK_EQ(t.last_cycle, 5499);
	CHECK_EQ(t.cycles + t.missing, 5500);
	CHECK(t.missing > 4000);
	bench_done(&b);
}

/* How often the 8 bytes of @number stand in all recordings, which are not compressed. */
static unsigned occurrences(struct bench *b, uint64_t number)
{
	struct store_entry *entries;
	unsigned found = 0;
	size_t count;

	CHECK_EQ(store_list(b->dir, &entries, &count), 0);
	for (size_t i = 0; i < count; i++) {
		static uint8_t bytes[1 << 20];
		uint8_t wanted[8];
		char path[512];
		size_t len;
		FILE *f;

		put_le64(wanted, number);
		CHECK_EQ(store_path(b->dir, entries[i].name, path, sizeof(path)), 0);
		f = fopen(path, "re");
		CHECK(f != NULL);
		len = fread(bytes, 1, sizeof(bytes), f);
		CHECK(len < sizeof(bytes));
		fclose(f);
		for (uint8_t *at = bytes;
		     (at = memmem(at, len - (size_t)(at - bytes), wanted, 8)) != NULL; at++) {
			found++;
		}
	}
	free(entries);
	return found;
}

/* Whatever call fails how: in the end all cycles and events are there, each once. */
static void fail_from(unsigned n, unsigned count, int error)
{
	struct bench b = { .fail_call = n, .fail_count = count, .error = error };
	struct track t;

	bench_init(&b, 100, 8192);
	b.options.rotate_bytes = 60000;
	b.options.zstd_level = 0;
	CHECK_EQ(bench_start(&b), 0);
	for (uint64_t i = 0; i < 20; i++) {
		bench_push(&b, i * 100, 100);
		bench_push_event(&b, FIRST_EVENT + i);
		bench_wait(&b, 100 * NS_PER_MS);
	}
	bench_wait(&b, 8 * NS_PER_S);
	CHECK_EQ(recorder_status(b.recorder)->state, RECORD_RUNNING);
	CHECK_EQ(recorder_status(b.recorder)->recorded_cycles, 2000);
	CHECK_EQ(bench_stop(&b), 0);
	t = read_all(&b);
	CHECK_EQ(t.cycles, 2000);
	CHECK_EQ(t.gaps, 0);
	CHECK_EQ(t.event_next, 20);
	for (uint64_t i = 0; i < 20; i++) {
		CHECK_EQ(occurrences(&b, FIRST_EVENT + i), 1);
	}
	CHECK(b.calls >= n);
	bench_done(&b);
}

TEST(recorder_trouble, each_single_call_that_finds_the_disk_full_costs_nothing)
{
	for (unsigned n = 1; n < 60; n++) {
		fail_from(n, 1, -ENOSPC);
	}
}

TEST(recorder_trouble, each_single_call_that_fails_costs_nothing)
{
	for (unsigned n = 1; n < 60; n++) {
		fail_from(n, 1, -EIO);
	}
}

TEST(recorder_trouble, three_failing_calls_in_a_row_cost_nothing)
{
	for (unsigned n = 1; n < 60; n += 3) {
		fail_from(n, 3, -EIO);
		fail_from(n, 3, -ENOSPC);
	}
}

TEST(recorder_trouble, stopped_on_a_full_disk_the_part_stays_and_the_next_start_repairs_it)
{
	struct bench b = { .error = -ENOSPC };
	unsigned finished;
	unsigned parts;
	struct track t;

	bench_init(&b, 100, 4096);
	CHECK_EQ(bench_start(&b), 0);
	bench_push(&b, 0, 1000);
	bench_wait(&b, 2 * NS_PER_S);
	b.fail_call = b.calls + 1;
	b.fail_count = 1000000;
	bench_push(&b, 1000, 500);
	CHECK_EQ(bench_stop(&b), -ENOSPC);
	t = bench_read(&b, &finished, &parts);
	CHECK_EQ(parts, 1);
	CHECK(t.cycles >= 1000 && t.cycles < 1500);
	b.fail_call = 0;
	CHECK_EQ(bench_start(&b), 0);
	bench_wait(&b, NS_PER_S);
	CHECK_EQ(bench_stop(&b), 0);
	t = read_all(&b);
	CHECK_EQ(t.cycles, 1500);
	CHECK_EQ(t.gaps, 0);
	bench_done(&b);
}

/* Damage the content of the chunk with this number (from 0 on). */
static void scratch_chunk(const char *path, unsigned number)
{
	uint8_t head[MCAP_HEAD_BYTES];
	long at = MCAP_MAGIC_BYTES;
	FILE *f = fopen(path, "r+");

	CHECK(f != NULL);
	for (unsigned chunks = 0; chunks <= number;) {
		CHECK_EQ(fseek(f, at, SEEK_SET), 0);
		CHECK_EQ(fread(head, sizeof(head), 1, f), 1);
		if (head[0] == MCAP_OP_CHUNK && chunks++ == number) {
			CHECK_EQ(fseek(f, at + 70, SEEK_SET), 0);
			fputs("a scratch on the disk", f);
		}
		at += (long)(MCAP_HEAD_BYTES + get_le64(head + 1));
	}
	CHECK_EQ(fclose(f), 0);
}

TEST(recorder_trouble, a_damaged_part_is_copied_and_kept_aside)
{
	struct bench b = { .calls = 0 };
	struct store_entry *entries;
	size_t count;
	char path[512];
	struct track t;

	bench_init(&b, 100, 4096);
	CHECK_EQ(bench_start(&b), 0);
	bench_push(&b, 0, 1000);
	bench_wait(&b, 2 * NS_PER_S);
	bench_kill(&b);
	CHECK_EQ(store_list(b.dir, &entries, &count), 0);
	CHECK_EQ(count, 1);
	CHECK_EQ(store_path(b.dir, entries[0].name, path, sizeof(path)), 0);
	scratch_chunk(path, 4);
	CHECK_EQ(bench_start(&b), 0);
	CHECK(strstr(b.said, ".damaged") != NULL);
	bench_push(&b, 1000, 100);
	bench_wait(&b, NS_PER_S);
	CHECK_EQ(bench_stop(&b), 0);
	t = read_all(&b);
	CHECK_EQ(t.gaps, 1);
	CHECK_EQ(t.last_cycle, 1099);
	CHECK_EQ(t.missing, 100);
	memcpy(path + strlen(path) - 5, ".dama", 5);
	snprintf(path + strlen(path), sizeof(path) - strlen(path), "ged");
	CHECK_EQ(unlink(path), 0);
	free(entries);
	bench_done(&b);
}

TEST(recorder_trouble, an_unfinished_file_without_a_sample_is_removed)
{
	struct bench b = { .calls = 0 };
	unsigned finished;
	unsigned parts;
	char path[512];
	FILE *f;

	bench_init(&b, 100, 64);
	CHECK_EQ(bench_start(&b), 0);
	bench_kill(&b);
	CHECK_EQ(store_path(b.dir, "ecdaq-20260101T000000Z-00000000-000007.part", path,
			    sizeof(path)),
		 0);
	f = fopen(path, "w"); /* as after a power cut: the name is there, the bytes are not */
	CHECK(f != NULL);
	fclose(f);
	CHECK_EQ(bench_start(&b), 0);
	bench_read(&b, &finished, &parts);
	CHECK_EQ(finished + parts, 0);
	CHECK(strstr(b.said, "removed") != NULL);
	bench_done(&b);
}

TEST(recorder_trouble, below_the_reserve_no_file_is_begun)
{
	struct bench b = { .calls = 0 };
	unsigned finished;
	unsigned parts;
	struct track t;

	bench_init(&b, 100, 8192);
	b.options.reserve_bytes = 1000000;
	b.bytes_free = 999999;
	CHECK_EQ(bench_start(&b), 0);
	bench_push(&b, 0, 500);
	bench_wait(&b, NS_PER_S / 2);
	CHECK_EQ(recorder_status(b.recorder)->state, RECORD_DISK_FULL);
	bench_read(&b, &finished, &parts);
	CHECK_EQ(finished + parts, 0);
	b.bytes_free = 2000000;
	bench_wait(&b, 3 * NS_PER_S);
	CHECK_EQ(recorder_status(b.recorder)->state, RECORD_RUNNING);
	CHECK_EQ(bench_stop(&b), 0);
	t = read_all(&b);
	CHECK_EQ(t.cycles, 500);
	CHECK_EQ(t.gaps, 0);
	bench_done(&b);
}

TEST(recorder_trouble, a_copy_that_fails_leaves_no_file)
{
	const struct rlimit small = { .rlim_cur = 2000, .rlim_max = RLIM_INFINITY };
	const struct sigaction ignore = { .sa_handler = SIG_IGN };
	struct bench b = { .calls = 0 };
	struct recover_outcome outcome;
	struct store_entry *entries;
	struct sigaction before;
	struct rlimit usual;
	char output[600];
	char path[512];
	size_t count;

	bench_init(&b, 100, 4096);
	CHECK_EQ(bench_start(&b), 0);
	bench_push(&b, 0, 1000);
	bench_wait(&b, 2 * NS_PER_S);
	bench_kill(&b);
	CHECK_EQ(store_list(b.dir, &entries, &count), 0);
	CHECK_EQ(count, 1);
	CHECK_EQ(store_path(b.dir, entries[0].name, path, sizeof(path)), 0);
	snprintf(output, sizeof(output), "%s/copy", b.root);
	/* The copy grows beyond what this process may write. */
	CHECK_EQ(sigaction(SIGXFSZ, &ignore, &before), 0);
	CHECK_EQ(getrlimit(RLIMIT_FSIZE, &usual), 0);
	CHECK_EQ(setrlimit(RLIMIT_FSIZE, &small), 0);
	CHECK_EQ(recover_copy(path, output, NULL, &outcome), -EFBIG);
	CHECK_EQ(setrlimit(RLIMIT_FSIZE, &usual), 0);
	CHECK_EQ(sigaction(SIGXFSZ, &before, NULL), 0);
	CHECK(access(output, F_OK) < 0);
	CHECK_EQ(recover_copy(path, output, NULL, &outcome), 0);
	CHECK_EQ(outcome.result, RECOVER_COPIED);
	CHECK_EQ(recover_copy(path, output, NULL, &outcome), -EEXIST);
	CHECK_EQ(unlink(output), 0);
	free(entries);
	bench_done(&b);
}
