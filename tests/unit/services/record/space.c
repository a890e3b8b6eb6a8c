/* SPDX-License-Identifier: MIT */
#include "record/space.h"

#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/clock.h"
#include "harness/test.h"
#include "record/store.h"
#include "record/upload_mark.h"
#include "unit/services/record/bench.h"

enum { PATH_BYTES = 256, CYCLES = 60000 };

static const char *const files[] = {
	"ecdaq-20300101T000000Z-aa-000001.mcap",
	"ecdaq-19700101T000000Z-bb-000002.damaged",
	"ecdaq-20260101T000000Z-bb-000003.mcap",
	"ecdaq-20260101T000000Z-bb-000004.part",
	"ecdaq-20260101T000000Z-bb-000005.mcap",
	"ecdaq-20260101T000000Z-bb-000005.keep",
	"ecdaq-20260101T000000Z-bb-000006.mcap",
	"ecdaq-20260101T000000Z-bb-000006.mcap.keep",
	"holiday.mcap",
};

enum { FILES = sizeof(files) / sizeof(files[0]), EACH = 1000 };

static void path_of(const char *dir, const char *name, char path[PATH_BYTES])
{
	CHECK_EQ(store_path(dir, name, path, PATH_BYTES), 0);
}

/* A folder with all files, of EACH bytes. */
static void make_folder(char dir[PATH_BYTES])
{
	snprintf(dir, PATH_BYTES, "%s/ecdaq-space-XXXXXX",
		 getenv("TMPDIR") != NULL ? getenv("TMPDIR") : "/tmp");
	CHECK(mkdtemp(dir) != NULL);
	for (size_t i = 0; i < FILES; i++) {
		char path[PATH_BYTES];
		int fd;

		path_of(dir, files[i], path);
		fd = open(path, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
		CHECK(fd >= 0);
		CHECK_EQ(ftruncate(fd, EACH), 0);
		close(fd);
	}
}

/* A bit for each file that is there. */
static unsigned there(const char *dir)
{
	unsigned bits = 0;

	for (size_t i = 0; i < FILES; i++) {
		char path[PATH_BYTES];

		path_of(dir, files[i], path);
		bits |= access(path, F_OK) == 0 ? 1U << i : 0;
	}
	return bits;
}

static int given_free(void *ctx, const char *dir, uint64_t *ret_bytes)
{
	(void)dir;
	*ret_bytes = *(uint64_t *)ctx;
	return 0;
}

/* A disk of which each file that goes leaves its bytes. */
struct freed {
	const char *dir;
	uint64_t bytes; /* free while all are there */
};

static int free_by_files(void *ctx, const char *dir, uint64_t *ret_bytes)
{
	const struct freed *f = ctx;
	unsigned bits = there(dir);

	*ret_bytes = f->bytes + (uint64_t)EACH * (FILES - (unsigned)__builtin_popcount(bits));
	return 0;
}

static void remove_folder(const char *dir)
{
	for (size_t i = 0; i < FILES; i++) {
		char path[PATH_BYTES];

		path_of(dir, files[i], path);
		unlink(path);
	}
	CHECK_EQ(rmdir(dir), 0);
}

TEST(space, the_budget_takes_the_oldest_damaged_too_and_nothing_pinned_open_or_foreign)
{
	char dir[PATH_BYTES];
	struct recorder_options opt = { .dir = dir };
	struct space space = { .opt = &opt };

	make_folder(dir);
	opt.budget_bytes = 0; /* none: nothing is ever deleted */
	CHECK_EQ(space_make(&space, NULL, 0), 0);
	CHECK_EQ(space.bytes_kept, 6 * EACH);
	opt.budget_bytes = 6 * EACH;
	CHECK_EQ(space_make(&space, NULL, 0), 0);
	CHECK_EQ(there(dir), 0x1ff);
	opt.budget_bytes = 6 * EACH - 1;
	CHECK_EQ(space_make(&space, NULL, 0), 0);
	CHECK_EQ(there(dir), 0x1fe);
	opt.budget_bytes = 4 * EACH;
	CHECK_EQ(space_make(&space, NULL, 0), 0);
	CHECK_EQ(there(dir), 0x1fc);
	opt.budget_bytes = 3 * EACH - 1; /* one may go, and it would not be enough */
	CHECK_EQ(space_make(&space, NULL, 0), -ENOSPC);
	CHECK_EQ(there(dir), 0x1fc);
	opt.budget_bytes = 3 * EACH;
	opt.when_full = CONFIG_WHEN_FULL_STOP;
	CHECK_EQ(space_make(&space, NULL, 0), -ENOSPC);
	CHECK_EQ(there(dir), 0x1fc);
	remove_folder(dir);
}

static void mark(const char *dir, const char *name, uint64_t bytes)
{
	struct upload_mark mark = { .bytes = bytes, .key = "rig1/x.mcap" };

	memset(mark.sha256, 'a', UPLOAD_SHA256_CHARS);
	CHECK_EQ(upload_mark_save(dir, name, UPLOAD_MARK_DONE, &mark), 0);
}

static void unmark(const char *dir, const char *name)
{
	CHECK_EQ(upload_mark_remove(dir, name, UPLOAD_MARK_DONE), 0);
}

TEST(space, what_is_uploaded_goes_first_and_the_rest_may_be_beyond_the_budget)
{
	char dir[PATH_BYTES];
	uint64_t left = 1 << 20;
	struct record_seam seam = { .free_bytes = given_free, .ctx = &left };
	struct recorder_options opt = { .dir = dir, .marks_dir = dir, .seam = &seam };
	struct space space = { .opt = &opt };

	make_folder(dir);
	mark(dir, files[2], EACH);
	mark(dir, files[0], EACH + 1); /* another one of this name */
	opt.keep_until_uploaded = CONFIG_KEEP_UNTIL_FULL;
	opt.budget_bytes = 5 * EACH;
	CHECK_EQ(space_make(&space, NULL, 0), 0);
	CHECK_EQ(there(dir), 0x1fd); /* the damaged one is never uploaded */
	opt.budget_bytes = 2 * EACH;
	CHECK_EQ(space_make(&space, NULL, 0), -ENOSPC); /* pinned and open ones are too much */
	CHECK_EQ(there(dir), 0x1fd);
	opt.budget_bytes = 3 * EACH;
	CHECK_EQ(space_make(&space, NULL, 0), 0);
	CHECK_EQ(there(dir), 0x1f9);
	CHECK_EQ(space.bytes_kept_back, EACH);
	/* The disk is full. */
	opt.reserve_bytes = 2000;
	left = 1000;
	opt.keep_until_uploaded = CONFIG_KEEP_ALWAYS;
	CHECK_EQ(space_make(&space, NULL, 0), -ENOSPC);
	CHECK_EQ(there(dir), 0x1f9);
	opt.keep_until_uploaded = CONFIG_KEEP_UNTIL_FULL;
	left = 999; /* one may go, and it would not be enough */
	CHECK_EQ(space_make(&space, NULL, 0), -ENOSPC);
	CHECK_EQ(there(dir), 0x1f9);
	/* Without a service that uploads nothing waits for one. */
	left = 1 << 20;
	opt.marks_dir = "";
	CHECK_EQ(space_make(&space, NULL, 0), 0);
	CHECK_EQ(there(dir), 0x1f8);
	unmark(dir, files[0]);
	unmark(dir, files[2]);
	remove_folder(dir);
}

TEST(space, the_oldest_that_is_not_uploaded_goes_where_the_disk_is_full)
{
	char dir[PATH_BYTES];
	struct freed freed = { dir, 500 };
	struct record_seam seam = { .free_bytes = free_by_files, .ctx = &freed };
	struct recorder_options opt = { .dir = dir,
					.marks_dir = dir,
					.seam = &seam,
					.budget_bytes = 1 << 20,
					.reserve_bytes = 1000,
					.keep_until_uploaded = CONFIG_KEEP_UNTIL_FULL };
	struct space space = { .opt = &opt };

	make_folder(dir);
	mark(dir, files[2], EACH);
	CHECK_EQ(space_make(&space, NULL, 0), 0); /* the damaged one */
	CHECK_EQ(there(dir), 0x1fd);
	opt.reserve_bytes = 2000;
	CHECK_EQ(space_make(&space, NULL, 0), 0); /* what is uploaded, not the oldest */
	CHECK_EQ(there(dir), 0x1f9);
	opt.reserve_bytes = 3000;
	opt.keep_until_uploaded = CONFIG_KEEP_ALWAYS;
	CHECK_EQ(space_make(&space, NULL, 0), -ENOSPC);
	CHECK_EQ(there(dir), 0x1f9);
	opt.keep_until_uploaded = CONFIG_KEEP_UNTIL_FULL;
	CHECK_EQ(space_make(&space, NULL, 0), 0);
	CHECK_EQ(there(dir), 0x1f8);
	unmark(dir, files[2]);
	remove_folder(dir);
}

/* Much faster than real time, so that a check once a second would see nothing. */
static void record_much(struct bench *b)
{
	b->options.rotate_bytes = 10000000;
	b->options.zstd_level = 0;
	CHECK_EQ(bench_start(b), 0);
	for (uint64_t n = 0; n < CYCLES / 2000; n++) {
		bench_push(b, n * 2000, 2000);
		bench_wait(b, 50 * NS_PER_MS);
	}
	bench_wait(b, 3 * NS_PER_S);
}

TEST(space, a_disk_smaller_than_the_budget_keeps_the_newest_and_the_reserve)
{
	struct bench b = { .disk_bytes = 1500000 };
	unsigned finished;
	unsigned parts;
	struct track t;

	bench_init(&b, 100, 8192);
	b.options.budget_bytes = UINT64_C(8) << 30;
	b.options.reserve_bytes = 300000;
	record_much(&b);
	CHECK_EQ(recorder_status(b.recorder)->state, RECORD_RUNNING);
	CHECK_EQ(bench_stop(&b), 0);
	t = bench_read(&b, &finished, &parts);
	CHECK(bench_used(b.dir) <= 1200000);
	CHECK(b.most_bytes > 600000 && b.most_bytes <= 1200000);
	CHECK(finished >= 4);
	CHECK_EQ(parts, 0);
	CHECK_EQ(t.gaps, 0);
	CHECK(t.first_cycle > 0);
	CHECK_EQ(t.last_cycle, CYCLES - 1);
	CHECK(strstr(b.said, "disk full") == NULL);
	bench_done(&b);
}

TEST(space, the_budget_holds_at_any_rate)
{
	struct bench b = { .calls = 0 };
	unsigned finished;
	unsigned parts;

	bench_init(&b, 100, 8192);
	b.options.budget_bytes = 1000000;
	record_much(&b);
	CHECK_EQ(bench_stop(&b), 0);
	CHECK_EQ(bench_read(&b, &finished, &parts).last_cycle, CYCLES - 1);
	CHECK(b.most_bytes > 500000 && b.most_bytes <= 1000000);
	CHECK(bench_used(b.dir) <= 1000000);
	bench_done(&b);
}

TEST(space, when_full_stop_deletes_nothing_and_keeps_the_reserve)
{
	struct bench b = { .disk_bytes = 1500000 };
	unsigned finished;
	unsigned parts;
	struct track t;

	bench_init(&b, 100, 65536);
	b.options.budget_bytes = UINT64_C(8) << 30;
	b.options.reserve_bytes = 300000;
	b.options.when_full = CONFIG_WHEN_FULL_STOP;
	record_much(&b);
	CHECK_EQ(recorder_status(b.recorder)->state, RECORD_DISK_FULL);
	CHECK(b.most_bytes > 600000 && b.most_bytes <= 1200000);
	t = bench_read(&b, &finished, &parts);
	CHECK_EQ(t.first_cycle, 0);
	CHECK_EQ(parts, 0);
	b.disk_bytes = 60000000;
	bench_wait(&b, 3 * NS_PER_S);
	CHECK_EQ(recorder_status(b.recorder)->state, RECORD_RUNNING);
	CHECK_EQ(bench_stop(&b), 0);
	t = bench_read(&b, &finished, &parts);
	CHECK_EQ(t.cycles, CYCLES);
	CHECK_EQ(t.gaps, 0);
	bench_done(&b);
}

TEST(space, a_budget_that_is_used_up_is_named_in_the_alarm)
{
	struct bench b = { .calls = 0 };

	bench_init(&b, 100, 8192);
	b.options.budget_bytes = 600000;
	b.options.when_full = CONFIG_WHEN_FULL_STOP;
	record_much(&b);
	CHECK_EQ(recorder_status(b.recorder)->state, RECORD_DISK_FULL);
	CHECK(strstr(b.said, " bytes of recordings, budget 600000") != NULL);
	CHECK_EQ(bench_stop(&b), -ENOSPC);
	bench_done(&b);
}

TEST(space, stopped_without_room_it_says_that_not_all_is_recorded)
{
	struct bench b = { .calls = 0 };

	bench_init(&b, 100, 4096);
	b.options.reserve_bytes = 1000;
	b.bytes_free = 999;
	CHECK_EQ(bench_start(&b), 0);
	bench_push(&b, 0, 10);
	bench_wait(&b, NS_PER_S);
	CHECK_EQ(bench_stop(&b), -ENOSPC);
	bench_done(&b);
}
