/* SPDX-License-Identifier: MIT */
#include "record/store.h"

#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/wait.h>
#include <unistd.h>

#include "base/clock.h"
#include "harness/test.h"

enum { PATH_BYTES = 256 };

static struct store *open_new(char dir[PATH_BYTES])
{
	struct store *s;
	int64_t pid = 0;

	snprintf(dir, PATH_BYTES, "%s/ecdaq-store-XXXXXX",
		 getenv("TMPDIR") != NULL ? getenv("TMPDIR") : "/tmp");
	CHECK(mkdtemp(dir) != NULL);
	CHECK_EQ(store_open(dir, &s, &pid), 0);
	return s;
}

static void make_file(const char *dir, const char *name, size_t bytes)
{
	char path[PATH_BYTES + STORE_NAME_BYTES];
	int fd;

	CHECK_EQ(store_path(dir, name, path, sizeof(path)), 0);
	fd = open(path, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
	CHECK(fd >= 0);
	CHECK_EQ(ftruncate(fd, (off_t)bytes), 0);
	close(fd);
}

static void close_all(struct store *s, const char *dir)
{
	static const char *const hidden[] = { ".ecdaq-record.lock", ".ecdaq-record.state" };
	char path[PATH_BYTES + STORE_NAME_BYTES];
	struct store_entry *entries;
	size_t count;

	CHECK_EQ(store_list(dir, &entries, &count), 0);
	for (size_t i = 0; i < count; i++) {
		CHECK_EQ(store_path(dir, entries[i].name, path, sizeof(path)), 0);
		unlink(path);
	}
	free(entries);
	store_close(s);
	for (size_t i = 0; i < 2; i++) {
		CHECK_EQ(store_path(dir, hidden[i], path, sizeof(path)), 0);
		unlink(path);
	}
	rmdir(dir);
}

TEST(store, names_hold_start_session_and_a_sequence_that_orders_them)
{
	char name[STORE_NAME_BYTES];
	char file[STORE_NAME_BYTES + 8];
	uint64_t sequence = 77;
	int is_part = 7;

	store_make_name(name, INT64_C(1766000000) * 1000000000, UINT64_C(0x123456789abcdef0), 42);
	CHECK_EQ(strncmp(name, "ecdaq-20251217T193320Z-", 23), 0);
	CHECK_STR(name + strlen(name) - 7, "-000042");
	snprintf(file, sizeof(file), "%s.mcap", name);
	CHECK_EQ(store_parse_name(file, &sequence, &is_part), 1);
	CHECK_EQ(sequence, 42);
	CHECK_EQ(is_part, 0);
	snprintf(file, sizeof(file), "%s.part", name);
	CHECK_EQ(store_parse_name(file, &sequence, &is_part), 1);
	CHECK_EQ(is_part, 1);
	store_make_name(name, -5, 0, UINT64_MAX);
	snprintf(file, sizeof(file), "%s.mcap", name);
	CHECK_EQ(store_parse_name(file, &sequence, &is_part), 1);
	CHECK_EQ(sequence == UINT64_MAX, 1);
}

TEST(store, foreign_names_are_left_alone)
{
	static const char *const names[] = { "",
					     "a.mcap",
					     "ecdaq-",
					     "ecdaq-1.mcap.bak",
					     "ecdaq-x.mcap",
					     "ecdaq-20250101T000000Z-1-2x.mcap",
					     "ecdaq-20250101T000000Z-1- 2.mcap",
					     "ecdaq-20250101T000000Z-1-99999999999999999999.mcap",
					     "ecdaq-20250101T000000Z-1-2.damaged",
					     ".ecdaq-record.lock" };
	uint64_t sequence = 77;
	int is_part = 7;

	for (size_t i = 0; i < sizeof(names) / sizeof(names[0]); i++) {
		CHECK_EQ(store_parse_name(names[i], &sequence, &is_part), 0);
	}
	CHECK_EQ(sequence, 77);
	CHECK_EQ(is_part, 7);
}

TEST(store, a_name_of_a_request_is_never_a_path)
{
	static const char *const names[] = {
		"ecdaq-/../x-1.mcap", "../ecdaq-x-1.mcap",  "ecdaq-..\\x-1.mcap",
		"ecdaq-x-1.mcap/",    "ecdaq-%2f-1.mcap",   "ecdaq-x-1.keep",
		"ecdaq-x-1.csv",      ".ecdaq-record.lock", ""
	};

	for (size_t i = 0; i < sizeof(names) / sizeof(names[0]); i++) {
		CHECK_EQ(store_is_name(names[i]), 0);
	}
	CHECK_EQ(store_is_name("ecdaq-20250101T000000Z-0a-000002.mcap"), 1);
	CHECK_EQ(store_is_name("ecdaq-20250101T000000Z-0a-000002.part"), 1);
	CHECK_EQ(store_is_name("ecdaq-20250101T000000Z-0a-000002.damaged"), 1);
}

TEST(store, a_name_has_the_time_at_which_the_file_was_begun)
{
	char name[STORE_NAME_BYTES];

	store_make_name(name, INT64_C(1766000000) * NS_PER_S + 999, 7, 1);
	CHECK_EQ(store_name_utc_s(name), 1766000000);
	CHECK_EQ(store_name_utc_s("ecdaq-unknown-00000000-000001.mcap"), 0);
	CHECK_EQ(store_name_utc_s("ecdaq-20250101T000000Z"), 0);
	CHECK_EQ(store_name_utc_s("other-20250101T000000Z-1-2.mcap"), 0);
}

TEST(store, list_is_in_order_of_sequence_whatever_the_clock_said)
{
	char dir[PATH_BYTES];
	struct store *s = open_new(dir);
	struct store_entry *entries;
	size_t count;

	make_file(dir, "ecdaq-20300101T000000Z-aa-000001.mcap", 10);
	make_file(dir, "ecdaq-19700101T000000Z-bb-000002.mcap", 20);
	make_file(dir, "ecdaq-20260101T000000Z-bb-000003.part", 30);
	make_file(dir, "holiday.mcap", 40);
	CHECK_EQ(store_list(dir, &entries, &count), 0);
	CHECK_EQ(count, 3);
	CHECK_EQ(entries[0].sequence, 1);
	CHECK_EQ(entries[1].bytes, 20);
	CHECK(entries[2].is_part && !entries[1].is_part);
	free(entries);
	CHECK_EQ(store_list("/nowhere/at/all", &entries, &count), -ENOENT);
	unlink("holiday.mcap");
	{
		char path[PATH_BYTES + STORE_NAME_BYTES];

		CHECK_EQ(store_path(dir, "holiday.mcap", path, sizeof(path)), 0);
		unlink(path);
	}
	close_all(s, dir);
}

TEST(store, state_is_read_back_and_damage_leaves_the_output_untouched)
{
	char dir[PATH_BYTES];
	char path[PATH_BYTES + STORE_NAME_BYTES];
	struct store *s = open_new(dir);
	const struct store_state state = { .session = UINT64_MAX,
					   .next_cycle = 5,
					   .event_next = 6,
					   .event_mono_ns = -7,
					   .sequence = 8 };
	struct store_state read = { .session = 1 };
	FILE *f;

	CHECK_EQ(store_load_state(s, &read), -ENOENT);
	CHECK_EQ(store_save_state(s, &state), 0);
	CHECK_EQ(store_load_state(s, &read), 0);
	CHECK(read.session == UINT64_MAX && read.next_cycle == 5 && read.event_next == 6 &&
	      read.event_mono_ns == -7 && read.sequence == 8);
	CHECK_EQ(store_path(dir, ".ecdaq-record.state", path, sizeof(path)), 0);
	f = fopen(path, "w");
	CHECK(f != NULL);
	fputs("ecdaq-record-state 1\nsession=5\nnext", f);
	fclose(f);
	CHECK_EQ(store_load_state(s, &read), -EBADMSG);
	CHECK_EQ(read.next_cycle, 5);
	close_all(s, dir);
}

TEST(store, only_one_recorder_holds_a_directory)
{
	char dir[PATH_BYTES];
	struct store *s = open_new(dir);
	struct store *other = NULL;
	int64_t pid = 0;

	CHECK(store_is_locked(dir));
	CHECK_EQ(store_open(dir, &other, &pid), -EBUSY);
	CHECK_EQ(pid, getpid());
	CHECK(other == NULL);
	store_close(s);
	CHECK(!store_is_locked(dir));
	CHECK_EQ(store_open(dir, &s, &pid), 0);
	close_all(s, dir);
	CHECK(!store_is_locked(dir));
}

TEST(store, who_looks_at_the_lock_does_not_keep_a_recorder_out)
{
	char dir[PATH_BYTES];
	char path[PATH_BYTES + STORE_NAME_BYTES];
	struct store *s = open_new(dir);
	int64_t pid = 0;
	int ready[2];
	char byte = 0;
	pid_t child;

	CHECK_EQ(store_path(dir, ".ecdaq-record.lock", path, sizeof(path)), 0);
	store_close(s);
	CHECK_EQ(pipe2(ready, O_CLOEXEC), 0);
	child = fork();
	if (child == 0) {
		int fd = open(path, O_RDONLY | O_CLOEXEC);
		int is_held = flock(fd, LOCK_SH | LOCK_NB) == 0;
		int is_told = write(ready[1], &byte, 1) == 1;

		poll(NULL, 0, 10);
		_exit(is_held && is_told ? 0 : 1);
	}
	CHECK_EQ(read(ready[0], &byte, 1), 1);
	CHECK_EQ(store_open(dir, &s, &pid), 0);
	CHECK_EQ(waitpid(child, &(int){ 0 }, 0), child);
	close(ready[0]);
	close(ready[1]);
	close_all(s, dir);
}

TEST(store, a_directory_that_cannot_be_made_is_an_error)
{
	struct store *s = NULL;
	int64_t pid;

	CHECK_EQ(store_open("/dev/null/records", &s, &pid), -ENOTDIR);
	CHECK(s == NULL);
}
