/* SPDX-License-Identifier: MIT */
#include "record/overview.h"

#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "harness/test.h"
#include "record/store.h"
#include "unit/services/record/bench.h"
#include "unit/services/record/memory_file.h"

enum { FILE_BYTES = 1 << 20, PATH_BYTES = 512 };

/* One file: cycles 0 to 99 and 150 to 199. */
static void record(struct bench *b)
{
	bench_init(b, 100, 8192);
	CHECK_EQ(bench_start(b), 0);
	bench_push(b, 0, 100);
	bench_push(b, 150, 50);
	bench_wait(b, 100000000);
	CHECK_EQ(bench_stop(b), 0);
}

/* The recording in memory. */
static void load(const struct bench *b, struct memory_file *f)
{
	struct store_entry *entries;
	char path[PATH_BYTES];
	size_t count;
	ssize_t n;
	int fd;

	CHECK_EQ(store_list(b->dir, &entries, &count), 0);
	CHECK_EQ(count, 1);
	CHECK_EQ(store_path(b->dir, entries[0].name, path, sizeof(path)), 0);
	free(entries);
	f->data = malloc(FILE_BYTES);
	fd = open(path, O_RDONLY | O_CLOEXEC);
	CHECK(f->data != NULL && fd >= 0);
	n = read(fd, f->data, FILE_BYTES);
	CHECK(n > 0 && n < FILE_BYTES);
	f->len = (size_t)n;
	close(fd);
}

TEST(overview, the_end_of_a_recording_has_its_times_and_counts)
{
	struct bench b = { .calls = 0 };
	struct memory_file f = { .data = NULL };
	struct overview overview;
	struct mcap_source source;

	record(&b);
	load(&b, &f);
	source = memory_source(&f, f.len);
	CHECK_EQ(overview_read(&source, &overview), 0);
	CHECK_EQ(overview.has_counts, 1);
	CHECK_EQ(overview.cycles, 150);
	CHECK_EQ(overview.missing, 50);
	CHECK_EQ((overview.end_ns - overview.start_ns + 500000) / 1000000, 199);
	memory_done(&f);
	bench_done(&b);
}

TEST(overview, a_file_that_was_cut_off_anywhere_has_no_end)
{
	struct bench b = { .calls = 0 };
	struct memory_file f = { .data = NULL };
	struct overview overview = { .cycles = 77 };

	record(&b);
	load(&b, &f);
	for (size_t len = 0; len < f.len; len++) {
		struct mcap_source source = memory_source(&f, len);

		CHECK_EQ(overview_read(&source, &overview), -ENODATA);
	}
	CHECK_EQ(overview.cycles, 77);
	memory_done(&f);
	bench_done(&b);
}

/* Reading outside of the source fails a CHECK of memory_source(). */
TEST(overview, whatever_the_bytes_of_the_end_are_only_the_file_is_read)
{
	static const uint8_t values[] = { 0x00, 0x01, 0x7f, 0x80, 0xff };
	struct bench b = { .calls = 0 };
	struct memory_file f = { .data = NULL };
	struct overview overview;
	struct mcap_source source;
	unsigned failed = 0;

	record(&b);
	load(&b, &f);
	source = memory_source(&f, f.len);
	for (size_t at = f.len > 8192 ? f.len - 8192 : 0; at < f.len; at++) {
		uint8_t was = f.data[at];

		for (size_t i = 0; i < sizeof(values); i++) {
			f.data[at] = values[i];
			failed += overview_read(&source, &overview) < 0;
		}
		f.data[at] = was;
	}
	CHECK(failed > 100);
	CHECK_EQ(overview_read(&source, &overview), 0);
	memory_done(&f);
	bench_done(&b);
}

TEST(overview, an_error_of_the_disk_is_reported)
{
	struct bench b = { .calls = 0 };
	struct memory_file f = { .data = NULL, .error = -EIO };
	struct overview overview;

	record(&b);
	load(&b, &f);
	for (unsigned n = 1; n <= 5; n++) {
		struct mcap_source source = memory_source(&f, f.len);

		f.calls = 0;
		f.fail_call = n;
		f.fail_count = 1;
		CHECK_EQ(overview_read(&source, &overview), -EIO);
	}
	memory_done(&f);
	bench_done(&b);
}
