/* SPDX-License-Identifier: MIT */
#include "reader/reader.h"

#include <errno.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

#include "harness/made_ring.h"
#include "harness/test.h"
#include "image/image.h"

struct bench {
	char path[128];
	struct ring *ring;
	struct reader *reader;
	uint64_t lost;
};

static void bench_open(struct bench *b, enum reader_start start)
{
	*b = (struct bench){ .ring = NULL };
	snprintf(b->path, sizeof(b->path), "%s", made_path("reader"));
	CHECK_EQ(reader_create(b->path, start, &b->reader), 0);
}

static void begin(struct bench *b, uint64_t session, uint64_t slots)
{
	struct made_meta meta = made_meta();

	meta.head.session = session;
	b->ring = made_ring(b->path, &meta, slots);
}

static void bench_close(struct bench *b)
{
	reader_destroy(b->reader);
	ring_destroy(b->ring);
	unlink(b->path);
}

static void expect(struct bench *b, enum reader_result wanted)
{
	CHECK_EQ(reader_next(b->reader, &b->lost), wanted);
}

static void expect_sample(struct bench *b, uint64_t cycle)
{
	expect(b, READER_SAMPLE);
	CHECK_EQ(reader_header(b->reader)->cycle, cycle);
	CHECK_EQ(image_get_raw(reader_image(b->reader), &reader_table(b->reader)->channels[1]),
		 (cycle + 100) & 0xffff);
}

TEST(reader, it_waits_for_a_ring_reads_it_and_continues_with_the_next)
{
	struct bench b;

	bench_open(&b, READER_AT_NEWEST);
	expect(&b, READER_WAITING);
	CHECK_EQ(reader_error(b.reader), -ENOENT);
	CHECK(reader_table(b.reader) == NULL);
	CHECK_EQ(reader_newest(b.reader), 0);
	begin(&b, 1, 16);
	made_push(b.ring, 0, 0, 0); /* before it came: not read */
	expect(&b, READER_BEGUN);
	CHECK_EQ(reader_table(b.reader)->meta.session, 1);
	expect(&b, READER_EMPTY);
	made_push(b.ring, 1, 0, 0);
	made_push(b.ring, 2, 0, 0);
	expect_sample(&b, 1);
	ring_close(b.ring);
	expect_sample(&b, 2);
	expect(&b, READER_ENDED);
	CHECK_EQ(reader_error(b.reader), 0);
	expect(&b, READER_WAITING);
	CHECK_EQ(reader_table(b.reader)->meta.session, 1);
	ring_destroy(b.ring);
	begin(&b, 2, 16);
	made_push(b.ring, 7, 0, 0); /* of a later session, all is read */
	expect(&b, READER_BEGUN);
	CHECK_EQ(reader_table(b.reader)->meta.session, 2);
	expect_sample(&b, 7);
	expect(&b, READER_EMPTY);
	bench_close(&b);
}

TEST(reader, a_ring_that_was_replaced_unclosed_is_read_to_its_end_first)
{
	struct bench b;
	struct ring *first;

	bench_open(&b, READER_AT_OLDEST);
	begin(&b, 1, 16);
	made_push(b.ring, 0, 0, 0);
	made_push(b.ring, 1, 0, 0);
	first = b.ring;
	expect(&b, READER_BEGUN);
	expect_sample(&b, 0);
	begin(&b, 2, 16);
	expect_sample(&b, 1);
	expect(&b, READER_EMPTY); /* its samples have just shown that the process lives */
	expect(&b, READER_ENDED);
	CHECK_EQ(reader_error(b.reader), -EPIPE);
	CHECK_STR(reader_error_to_str(-EPIPE), "its ecdaqd ended without closing it");
	expect(&b, READER_BEGUN);
	CHECK_EQ(reader_table(b.reader)->meta.session, 2);
	ring_destroy(first);
	bench_close(&b);
}

TEST(reader, a_session_ends_when_its_process_has_ended)
{
	struct bench b;
	pid_t pid;
	int status;

	bench_open(&b, READER_AT_OLDEST);
	pid = fork();
	if (pid == 0) {
		begin(&b, 1, 16);
		made_push(b.ring, 0, 0, 0);
		_exit(0); /* without closing it */
	}
	CHECK_EQ(waitpid(pid, &status, 0), pid);
	expect(&b, READER_BEGUN);
	expect_sample(&b, 0);
	expect(&b, READER_EMPTY);
	expect(&b, READER_ENDED);
	CHECK_EQ(reader_error(b.reader), -EPIPE);
	expect(&b, READER_WAITING);
	bench_close(&b);
}

TEST(reader, a_session_that_ended_can_be_read_again_until_it_is_replaced)
{
	struct bench b;

	bench_open(&b, READER_AT_OLDEST);
	begin(&b, 1, 16);
	made_push(b.ring, 0, 0, 0);
	ring_close(b.ring);
	expect(&b, READER_BEGUN);
	expect_sample(&b, 0);
	expect(&b, READER_ENDED);
	expect(&b, READER_WAITING);
	reader_seek(b.reader, 0);
	expect_sample(&b, 0);
	CHECK_EQ(reader_cursor(b.reader), 1);
	expect(&b, READER_ENDED);
	bench_close(&b);
}

TEST(reader, a_session_that_is_skipped_is_not_read_and_the_next_one_is)
{
	struct bench b;

	bench_open(&b, READER_AT_OLDEST);
	begin(&b, 1, 16);
	made_push(b.ring, 0, 0, 0);
	expect(&b, READER_BEGUN);
	reader_skip_session(b.reader);
	expect(&b, READER_WAITING);
	ring_destroy(b.ring);
	begin(&b, 2, 16);
	expect(&b, READER_BEGUN);
	bench_close(&b);
}

TEST(reader, a_slow_reader_gets_the_number_of_lost_samples)
{
	struct bench b;

	bench_open(&b, READER_AT_NEWEST);
	begin(&b, 1, 64);
	expect(&b, READER_BEGUN);
	for (uint64_t i = 0; i < 1000; i++) {
		made_push(b.ring, i, 0, 0);
	}
	expect(&b, READER_LOST);
	CHECK_EQ(b.lost, reader_oldest(b.reader));
	CHECK_EQ(reader_newest(b.reader), 1000);
	expect_sample(&b, b.lost);
	CHECK_EQ(reader_read_newest(b.reader), 1);
	CHECK_EQ(reader_header(b.reader)->cycle, 999);
	expect_sample(&b, b.lost + 1);
	bench_close(&b);
}

TEST(reader, a_ring_of_another_kind_or_inconsistent_is_not_opened)
{
	struct made_meta meta = made_meta();
	struct bench b;

	bench_open(&b, READER_AT_NEWEST);
	meta.channel[1].bit_offset = 8 * MADE_IMAGE_BYTES;
	b.ring = made_ring(b.path, &meta, 16);
	for (int i = 0; i < 3; i++) {
		expect(&b, READER_WAITING);
		CHECK_EQ(reader_error(b.reader), -EPROTO);
		reader_seek(b.reader, 0); /* there is nothing to read, and no table for it */
	}
	made_push(b.ring, 0, 0, 0);
	CHECK_EQ(reader_read_newest(b.reader), 0);
	CHECK_EQ(reader_newest(b.reader), 0);
	ring_destroy(b.ring);
	/* An image larger than the slots have room for. */
	meta = made_meta();
	meta.head.image_bytes = MADE_IMAGE_BYTES + 1;
	b.ring = made_ring(b.path, &meta, 16);
	expect(&b, READER_WAITING);
	CHECK_EQ(reader_error(b.reader), -EPROTO);
	ring_destroy(b.ring);
	begin(&b, 1, 16);
	made_overwrite(b.path, 72, "event\0\0", 8);
	expect(&b, READER_WAITING);
	CHECK_EQ(reader_error(b.reader), -EPROTO);
	CHECK_STR(reader_problem(b.reader), "not a sample ring, or damaged");
	ring_destroy(b.ring);
	begin(&b, 2, 16);
	expect(&b, READER_BEGUN);
	bench_close(&b);
}

TEST(reader, a_ring_of_another_version_is_named_by_both_versions)
{
	struct made_meta meta = made_meta();
	const uint32_t other = 77;
	char wanted[128];
	struct bench b;

	bench_open(&b, READER_AT_OLDEST);
	meta.head.version = 1;
	b.ring = made_ring(b.path, &meta, 16);
	expect(&b, READER_WAITING);
	CHECK_EQ(reader_error(b.reader), -EPROTONOSUPPORT);
	snprintf(
		wanted, sizeof(wanted),
		"ring version 1, this program reads version %u: restart ecdaqd of the same release",
		SAMPLE_VERSION);
	CHECK_STR(reader_problem(b.reader), wanted);
	ring_destroy(b.ring);
	begin(&b, 1, 16);
	made_overwrite(b.path, MADE_VERSION, &other, sizeof(other));
	expect(&b, READER_WAITING);
	CHECK_EQ(reader_error(b.reader), -EPROTONOSUPPORT);
	CHECK_STR(reader_problem(b.reader),
		  "ring of another version: restart ecdaqd of the same release");
	ring_destroy(b.ring);
	begin(&b, 2, 16);
	expect(&b, READER_BEGUN);
	bench_close(&b);
}

/* The two rings of the review: one is truncated after it was opened, in the other a size is raised.
 */
TEST(reader, a_ring_truncated_while_it_is_read_ends_the_session_with_an_error)
{
	struct bench b;

	bench_open(&b, READER_AT_OLDEST);
	begin(&b, 1, 4096);
	for (uint64_t i = 0; i < 2000; i++) {
		made_push(b.ring, i, 0, 0);
	}
	expect(&b, READER_BEGUN);
	expect_sample(&b, 0);
	made_truncate(b.path, 4096);
	while (reader_next(b.reader, &b.lost) == READER_SAMPLE) {
		CHECK(reader_header(b.reader)->cycle < 2000);
	}
	CHECK_EQ(reader_error(b.reader), -EIO);
	CHECK_STR(reader_error_to_str(-EIO), "truncated or overwritten while it was read");
	expect(&b, READER_WAITING);
	CHECK_EQ(reader_read_newest(b.reader), 0);
	made_truncate(b.path, 1 << 20); /* the producer's own pages, for ring_destroy() */
	bench_close(&b);
}

TEST(reader, sizes_raised_while_it_is_read_copy_no_byte_more)
{
	uint32_t large = 60000;
	struct bench b;
	uint8_t behind[64];

	bench_open(&b, READER_AT_OLDEST);
	begin(&b, 1, 256);
	for (uint64_t i = 0; i < 200; i++) {
		made_push(b.ring, i, 0, 0);
	}
	expect(&b, READER_BEGUN);
	made_overwrite(b.path, MADE_PAYLOAD_BYTES, &large, sizeof(large));
	memcpy(behind, reader_image(b.reader) + MADE_IMAGE_BYTES, sizeof(behind));
	for (uint64_t i = 0; i < 200; i++) {
		expect_sample(&b, i);
	}
	CHECK(memcmp(behind, reader_image(b.reader) + MADE_IMAGE_BYTES, sizeof(behind)) == 0);
	expect(&b, READER_EMPTY);
	bench_close(&b);
}
