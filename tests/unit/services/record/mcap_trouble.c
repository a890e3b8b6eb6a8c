/* SPDX-License-Identifier: MIT */
/* The n-th call to the file fails, for n = 1, 2, 3...: nothing is lost but by the caller's choice.
 */
#include <errno.h>

#include "harness/test.h"
#include "record/mcap_recover.h"
#include "unit/services/record/sample_file.h"

enum { MESSAGES = SAMPLE_CHUNKS * SAMPLE_CHUNK_MESSAGES, TRIES = 4 };

/* As a caller who tries again. Returns how often it had to. */
static unsigned write_stubbornly(struct memory_file *f)
{
	unsigned fail_call = f->fail_call;
	unsigned retries = 0;
	struct mcap_writer *w;
	int r;

	f->fail_call = 0;
	w = sample_file_begin(f, 1);
	f->calls = 0;
	f->fail_call = fail_call;
	for (unsigned n = 0; n < MESSAGES; n++) {
		CHECK_EQ(sample_file_message(w, n), 0);
		if (n % SAMPLE_CHUNK_MESSAGES != SAMPLE_CHUNK_MESSAGES - 1) {
			continue;
		}
		while (mcap_writer_close_chunk(w) < 0) {
			CHECK(++retries < TRIES);
		}
		while (mcap_writer_sync(w) < 0) {
			CHECK(++retries < TRIES);
		}
	}
	while ((r = mcap_writer_attachment(w, "note.txt", "text/plain", 7, "hello", 5)) < 0) {
		CHECK_EQ(r, f->error);
		CHECK(++retries < TRIES);
	}
	while (mcap_writer_finish(w) < 0) {
		CHECK(++retries < TRIES);
	}
	mcap_writer_destroy(w);
	return retries;
}

static void fail_each_call(unsigned more)
{
	unsigned all_calls;
	struct memory_file clean = { .error = -EIO };

	CHECK_EQ(write_stubbornly(&clean), 0);
	all_calls = clean.calls;
	for (unsigned n = 1; n <= all_calls; n++) {
		struct memory_file f = { .fail_call = n, .fail_count = more, .error = -EIO };

		CHECK(write_stubbornly(&f) >= 1);
		CHECK_EQ(f.len, clean.len);
		CHECK_MEM(f.data, clean.data, clean.len);
		memory_done(&f);
	}
	memory_done(&clean);
}

TEST(mcap_trouble, after_any_failed_call_a_second_try_writes_the_same_file)
{
	fail_each_call(0);
}

TEST(mcap_trouble, after_two_failed_calls_in_a_row_too)
{
	/* The second is often the one that should have cut off what the first left. */
	fail_each_call(1);
}

TEST(mcap_trouble, a_caller_who_gives_up_leaves_all_closed_chunks_readable)
{
	for (unsigned n = 1; n < 2 * SAMPLE_CHUNKS; n++) {
		struct memory_file f = { .error = -EIO };
		struct mcap_writer *w = sample_file_begin(&f, 0);
		unsigned closed = 0;
		int r = 0;

		f.calls = 0;
		f.fail_call = n;
		f.fail_count = 1000000;
		for (unsigned i = 0; i < MESSAGES && r == 0; i++) {
			CHECK_EQ(sample_file_message(w, i), 0);
			if (i % SAMPLE_CHUNK_MESSAGES == SAMPLE_CHUNK_MESSAGES - 1) {
				r = mcap_writer_close_chunk(w);
				closed += r == 0;
			}
		}
		mcap_writer_destroy(w);
		CHECK_EQ(closed, n - 1 < SAMPLE_CHUNKS ? n - 1 : SAMPLE_CHUNKS);
		f.fail_call = 0;
		CHECK_EQ(sample_file_read(&f, f.len).chunks, closed);
		memory_done(&f);
	}
}

TEST(mcap_trouble, a_full_disk_keeps_the_chunk_until_there_is_space)
{
	struct memory_file f = { .data = NULL };
	struct mcap_writer *w = sample_file_begin(&f, 0);
	uint64_t before = mcap_writer_bytes(w);

	CHECK_EQ(sample_file_message(w, 0), 0);
	f.quota = f.len + 20;
	CHECK_EQ(mcap_writer_close_chunk(w), -ENOSPC);
	CHECK_EQ(mcap_writer_bytes(w), before);
	CHECK_EQ(f.len, before);
	CHECK_EQ(mcap_writer_finish(w), -ENOSPC);
	f.quota = 0;
	CHECK_EQ(sample_file_message(w, 1), 0);
	CHECK_EQ(mcap_writer_finish(w), 0);
	mcap_writer_destroy(w);
	CHECK_EQ(sample_file_read(&f, f.len).messages, 2);
	memory_done(&f);
}

TEST(mcap_trouble, a_failing_read_is_an_error_and_not_an_end)
{
	struct memory_file f = { .error = -EIO };
	struct mcap_source source;
	struct mcap_scan *scan = NULL;
	unsigned calls;

	sample_file_make(&f, 1);
	source = memory_source(&f, f.len);
	f.calls = 0;
	CHECK_EQ(mcap_scan_create(&source, NULL, &scan), 0);
	mcap_scan_destroy(scan);
	calls = f.calls;
	for (unsigned n = 1; n <= calls; n++) {
		scan = NULL;
		f.calls = 0;
		f.fail_call = n;
		CHECK_EQ(mcap_scan_create(&source, NULL, &scan), -EIO);
		CHECK(scan == NULL);
	}
	memory_done(&f);
}
