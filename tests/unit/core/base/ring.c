/* SPDX-License-Identifier: MIT */
#include "base/ring.h"

#include <errno.h>
#include <fcntl.h>
#include <pthread.h>
#include <stdatomic.h>
#include <sys/stat.h>
#include <unistd.h>

#include "harness/test.h"

static char path[64];

static struct ring *make_ring(uint64_t slots, uint32_t payload_bytes)
{
	struct ring_spec spec = {
		.path = path,
		.kind = "test",
		.payload_bytes = payload_bytes,
		.slot_count = slots,
		.meta = "hello",
		.meta_bytes = 6,
		.period_ns = 1000000,
		.file_mode = 0640,
	};
	struct ring *ring = NULL;

	snprintf(path, sizeof(path), "/dev/shm/ecdaq-test-ring-%d", (int)getpid());
	CHECK_EQ(ring_create(&spec, &ring), 0);
	return ring;
}

static struct ring_reader *open_reader(void)
{
	struct ring_reader *reader = NULL;

	CHECK_EQ(ring_reader_open(path, &reader), 0);
	return reader;
}

TEST(ring, a_reader_gets_every_slot_in_order_and_knows_what_the_ring_is)
{
	struct ring *ring = make_ring(8, 20);
	struct ring_reader *reader = open_reader();
	size_t meta_bytes = 0;
	uint8_t payload[20];
	uint64_t lost = 0;

	CHECK_STR(ring_meta(reader, &meta_bytes), "hello");
	CHECK_EQ(meta_bytes, 6);
	CHECK_STR(ring_kind(reader), "test");
	CHECK_EQ(ring_payload_bytes(reader), 20);
	CHECK_EQ(ring_slot_count(reader), 8);
	CHECK_EQ(ring_read(reader, payload, sizeof(payload), &lost), RING_EMPTY);
	for (uint8_t i = 0; i < 5; i++) {
		uint8_t head[3] = { i, 1, 2 };
		uint8_t body[17];

		memset(body, i, sizeof(body));
		ring_push(ring, head, sizeof(head), body, i % 2 ? sizeof(body) : 4);
	}
	for (uint8_t i = 0; i < 5; i++) {
		CHECK_EQ(ring_read(reader, payload, sizeof(payload), &lost), RING_OK);
		CHECK_EQ(payload[0], i);
		CHECK_EQ(payload[2], 2);
		CHECK_EQ(payload[6], i);
		CHECK_EQ(payload[19], i % 2 ? i : 0);
	}
	CHECK_EQ(ring_read(reader, payload, sizeof(payload), &lost), RING_EMPTY);
	ring_destroy(ring);
	CHECK_EQ(ring_read(reader, payload, sizeof(payload), &lost), RING_CLOSED);
	ring_reader_destroy(reader);
	unlink(path);
}

TEST(ring, a_reader_that_was_lapped_gets_the_exact_number_of_missed_slots)
{
	struct ring *ring = make_ring(64, 8);
	struct ring_reader *reader = open_reader();
	uint64_t lost = 0;
	uint64_t value;

	for (uint64_t i = 0; i < 1000; i++) {
		ring_push(ring, &i, sizeof(i), NULL, 0);
	}
	CHECK_EQ(ring_read(reader, &value, sizeof(value), &lost), RING_LOST);
	CHECK_EQ(ring_read(reader, &value, sizeof(value), &lost), RING_OK);
	CHECK_EQ(value, lost);
	while (ring_read(reader, &value, sizeof(value), &lost) == RING_OK) {
	}
	CHECK_EQ(value, 999);
	ring_reader_destroy(reader);
	ring_destroy(ring);
	unlink(path);
}

TEST(ring, a_new_producer_replaces_the_ring_and_readers_notice)
{
	struct ring *ring = make_ring(8, 8);
	struct ring_reader *reader = open_reader();
	struct ring *second;

	CHECK(!ring_is_replaced(reader));
	CHECK(!ring_is_orphaned(reader));
	second = make_ring(8, 8);
	CHECK(ring_is_replaced(reader));
	ring_destroy(ring);
	ring_destroy(second);
	ring_reader_destroy(reader);
	unlink(path);
}

TEST(ring, a_file_that_is_not_a_ring_is_refused)
{
	struct ring_reader *reader = (struct ring_reader *)(uintptr_t)1;
	struct ring *ring = make_ring(8, 8);
	FILE *file;

	ring_destroy(ring);
	file = fopen(path, "r+b");
	CHECK(file != NULL);
	fputs("not a ring", file);
	fclose(file);
	CHECK_EQ(ring_reader_open(path, &reader), -EPROTO);
	CHECK_EQ(truncate(path, 100), 0);
	CHECK_EQ(ring_reader_open(path, &reader), -EPROTO);
	unlink(path);
	CHECK_EQ(ring_reader_open(path, &reader), -ENOENT);
	CHECK(reader == (struct ring_reader *)(uintptr_t)1);
}

TEST(ring, a_ring_that_was_removed_and_not_replaced_is_not_the_one_at_its_path)
{
	struct ring *ring = make_ring(8, 8);
	struct ring_reader *reader = open_reader();

	CHECK_EQ(unlink(path), 0);
	CHECK(ring_is_replaced(reader));
	ring_destroy(ring);
	ring_reader_destroy(reader);
}

/* Places in the header, which is part of the format. */
enum {
	AT_PAYLOAD_BYTES = 12,
	AT_SLOT_BYTES = 16,
	AT_SLOT_COUNT = 24,
	AT_META_OFFSET = 32,
	AT_META_BYTES = 40,
	AT_SLOTS_OFFSET = 48,
	AT_KIND = 72,
	AT_HEAD = 128,
	AT_FIRST_SLOT = 8192,
};

static void overwrite(off_t offset, const void *bytes, size_t count)
{
	int fd = open(path, O_RDWR | O_CLOEXEC);

	CHECK(fd >= 0);
	CHECK_EQ(pwrite(fd, bytes, count, offset), count);
	close(fd);
}

static void overwrite_u64(off_t offset, uint64_t value)
{
	overwrite(offset, &value, sizeof(value));
}

TEST(ring, a_header_that_is_not_consistent_is_refused)
{
	static const struct {
		off_t offset;
		uint64_t value;
	} wrong[] = {
		{ AT_PAYLOAD_BYTES - 4, UINT64_C(8000) << 32 | RING_VERSION },
		{ AT_PAYLOAD_BYTES - 4, UINT64_C(0xffffffff) << 32 | RING_VERSION },
		{ AT_SLOT_BYTES, 0 },
		{ AT_SLOT_BYTES, 24 },
		{ AT_SLOT_BYTES, UINT64_MAX - 7 },
		{ AT_SLOT_COUNT, 0 },
		{ AT_SLOT_COUNT, 6 },
		{ AT_SLOT_COUNT, UINT64_C(1) << 63 },
		{ AT_META_OFFSET, 0 },
		{ AT_META_BYTES, UINT64_MAX },
		{ AT_META_BYTES, 5000 },
		{ AT_SLOTS_OFFSET, 0 },
		{ AT_SLOTS_OFFSET, 4096 },
		{ AT_SLOTS_OFFSET, UINT64_C(1) << 62 },
		{ AT_KIND, UINT64_MAX },
		{ AT_HEAD, UINT64_MAX },
	};
	struct ring_reader *reader;

	for (size_t i = 0; i < sizeof(wrong) / sizeof(wrong[0]); i++) {
		struct ring *ring = make_ring(8, 8);

		overwrite_u64(wrong[i].offset, wrong[i].value);
		if (ring_reader_open(path, &reader) != -EPROTO) {
			test_fail(__FILE__, __LINE__, "case %zu was accepted", i);
		}
		ring_destroy(ring);
	}
	unlink(path);
}

TEST(ring, a_fifo_in_its_place_is_refused_at_once)
{
	struct ring_reader *reader;

	snprintf(path, sizeof(path), "/dev/shm/ecdaq-test-ring-%d", (int)getpid());
	CHECK_EQ(mkfifo(path, 0600), 0);
	CHECK_EQ(ring_reader_open(path, &reader), -EPROTO);
	unlink(path);
}

static struct ring *ring_with(uint64_t slots, uint64_t pushed)
{
	struct ring *ring = make_ring(slots, 8);

	for (uint64_t i = 0; i < pushed; i++) {
		ring_push(ring, &i, sizeof(i), NULL, 0);
	}
	return ring;
}

static void check_that_it_stays_damaged(struct ring_reader *reader)
{
	uint64_t value = 77;
	uint64_t lost = 0;

	for (int i = 0; i < 3; i++) {
		CHECK_EQ(ring_read(reader, &value, sizeof(value), &lost), RING_DAMAGED);
		CHECK_EQ(ring_peek_newest(reader, &value, sizeof(value)), RING_DAMAGED);
	}
	CHECK_EQ(value, 77);
	CHECK_EQ(lost, 0);
	CHECK(!ring_is_orphaned(reader));
}

TEST(ring, a_ring_truncated_while_it_is_read_is_damaged_and_raises_no_signal)
{
	static const off_t lengths[] = { 0, 4096, AT_FIRST_SLOT, AT_FIRST_SLOT + 20 };

	for (size_t i = 0; i < sizeof(lengths) / sizeof(lengths[0]); i++) {
		struct ring *ring = ring_with(8, 5);
		struct ring_reader *reader = open_reader();
		char kind[8];
		size_t bytes;

		ring_seek(reader, 0);
		/* Not ring_destroy() before this: the producer's map is part of the test. */
		CHECK_EQ(truncate(path, lengths[i]), 0);
		check_that_it_stays_damaged(reader);
		snprintf(kind, sizeof(kind), "%s", ring_kind(reader));
		CHECK_STR(kind, "test");
		CHECK_STR(ring_meta(reader, &bytes), "hello");
		CHECK_EQ(ring_newest(reader), 5);
		ring_reader_destroy(reader);
		/* Its pages are back, else closing it would raise SIGBUS here. */
		CHECK_EQ(truncate(path, 1 << 14), 0);
		ring_destroy(ring);
		unlink(path);
	}
}

TEST(ring, sizes_written_over_the_header_do_not_affect_open_readers)
{
	struct ring *ring = ring_with(8, 3);
	struct ring_reader *reader = open_reader();
	uint64_t guarded[3] = { 0, UINT64_MAX, UINT64_MAX };
	uint64_t lost;
	size_t bytes;

	overwrite_u64(AT_PAYLOAD_BYTES - 4, UINT64_C(8000) << 32 | RING_VERSION);
	overwrite_u64(AT_META_BYTES, UINT64_C(1) << 40);
	overwrite_u64(AT_SLOTS_OFFSET, UINT64_C(1) << 40);
	ring_seek(reader, 2);
	CHECK_EQ(ring_read(reader, guarded, sizeof(guarded), &lost), RING_OK);
	CHECK_EQ(guarded[0], 2);
	CHECK_EQ(guarded[1], UINT64_MAX);
	CHECK_EQ(ring_payload_bytes(reader), 8);
	ring_meta(reader, &bytes);
	CHECK_EQ(bytes, 6);
	ring_destroy(ring);
	ring_reader_destroy(reader);
	unlink(path);
}

TEST(ring, a_read_writes_no_more_than_the_callers_buffer_holds)
{
	struct ring *ring = ring_with(8, 1);
	struct ring_reader *reader = open_reader();
	uint32_t guarded[2] = { 7, 7 };
	uint64_t value = 0x1122334455667788;
	uint64_t lost;

	ring_push(ring, &value, sizeof(value), NULL, 0);
	CHECK_EQ(ring_peek_newest(reader, guarded, sizeof(guarded[0])), RING_OK);
	CHECK_EQ(guarded[0], 0x55667788);
	CHECK_EQ(guarded[1], 7);
	guarded[0] = 7;
	CHECK_EQ(ring_read(reader, guarded, sizeof(guarded[0]), &lost), RING_OK);
	CHECK_EQ(guarded[0], 0x55667788);
	CHECK_EQ(guarded[1], 7);
	ring_destroy(ring);
	ring_reader_destroy(reader);
	unlink(path);
}

TEST(ring, a_head_that_contradicts_the_slots_is_damage_and_no_endless_loop)
{
	/* Ahead of what was pushed by one, by much, by more than there can be; behind. */
	static const uint64_t heads[] = { 6, 1000, UINT64_MAX / 8, UINT64_MAX, 4 };

	for (size_t i = 0; i < sizeof(heads) / sizeof(heads[0]); i++) {
		struct ring *ring = ring_with(64, 5);
		struct ring_reader *reader = open_reader();
		uint64_t value;
		uint64_t lost;
		enum ring_result result;

		overwrite_u64(AT_HEAD, heads[i]);
		result = ring_read(reader, &value, sizeof(value), &lost);
		if (result == RING_LOST) {
			result = ring_read(reader, &value, sizeof(value), &lost);
		}
		CHECK_EQ(result, RING_DAMAGED);
		check_that_it_stays_damaged(reader);
		ring_destroy(ring);
		ring_reader_destroy(reader);
		unlink(path);
	}
}

TEST(ring, a_slot_that_was_overwritten_is_damage)
{
	struct ring *ring = ring_with(64, 20);
	struct ring_reader *reader = open_reader();
	uint64_t value;
	uint64_t lost;

	overwrite_u64(AT_FIRST_SLOT + 7 * 16, 3);
	ring_seek(reader, 8);
	for (uint64_t i = 8; i < 20; i++) {
		CHECK_EQ(ring_read(reader, &value, sizeof(value), &lost), RING_OK);
		CHECK_EQ(value, i);
	}
	ring_seek(reader, 7);
	CHECK_EQ(ring_read(reader, &value, sizeof(value), &lost), RING_DAMAGED);
	ring_destroy(ring);
	ring_reader_destroy(reader);
	unlink(path);
}

TEST(ring, a_reader_seeks_back_and_forth_within_the_ring)
{
	struct ring *ring = ring_with(4096, 6000);
	struct ring_reader *reader = open_reader();
	uint64_t oldest = ring_oldest(reader);
	uint64_t value;
	uint64_t lost;

	CHECK_EQ(ring_newest(reader), 6000);
	CHECK(oldest > 6000 - 4096 && oldest < 6000 - 3500);
	for (uint64_t at = oldest; at < 6000; at += 97) {
		ring_seek(reader, at);
		CHECK_EQ(ring_cursor(reader), at);
		CHECK_EQ(ring_read(reader, &value, sizeof(value), &lost), RING_OK);
		CHECK_EQ(value, at);
		ring_seek(reader, oldest + (6000 - at) / 2);
		CHECK_EQ(ring_read(reader, &value, sizeof(value), &lost), RING_OK);
		CHECK_EQ(value, oldest + (6000 - at) / 2);
	}
	ring_seek(reader, 6000);
	CHECK_EQ(ring_read(reader, &value, sizeof(value), &lost), RING_EMPTY);
	ring_seek(reader, 7000);
	CHECK_EQ(ring_read(reader, &value, sizeof(value), &lost), RING_EMPTY);
	ring_destroy(ring);
	CHECK_EQ(ring_read(reader, &value, sizeof(value), &lost), RING_CLOSED);
	ring_reader_destroy(reader);
	unlink(path);
}

struct hammer {
	_Atomic int stop;
	struct ring *ring;
};

static void *produce(void *arg)
{
	struct hammer *h = arg;
	uint64_t words[16];

	for (uint64_t i = 0; !atomic_load(&h->stop); i++) {
		for (unsigned k = 0; k < 16; k++) {
			words[k] = i * 16 + k;
		}
		ring_push(h->ring, words, 40, (const char *)words + 40, sizeof(words) - 40);
	}
	return NULL;
}

TEST(ring, readers_never_see_a_torn_slot_however_fast_the_producer_is)
{
	struct hammer h = { .stop = 0, .ring = make_ring(16, 128) };
	struct ring_reader *reader = open_reader();
	uint64_t got = 0;
	uint64_t missed = 0;
	uint64_t last = 0;
	pthread_t thread;

	CHECK_EQ(pthread_create(&thread, NULL, produce, &h), 0);
	while (got < 5000) {
		uint64_t words[16];
		uint64_t lost = 0;

		switch (ring_read(reader, words, sizeof(words), &lost)) {
		case RING_OK:
			for (unsigned k = 0; k < 16; k++) {
				CHECK_EQ(words[k], words[0] + k);
			}
			CHECK_EQ(words[0] / 16, got + missed);
			last = words[0] / 16;
			got++;
			break;
		case RING_LOST:
			missed += lost;
			break;
		case RING_EMPTY:
			break;
		case RING_CLOSED:
		case RING_DAMAGED:
			test_fail(__FILE__, __LINE__, "an honest ring was refused");
		}
	}
	atomic_store(&h.stop, 1);
	pthread_join(thread, NULL);
	CHECK_EQ(last + 1, got + missed);
	ring_reader_destroy(reader);
	ring_destroy(h.ring);
	unlink(path);
}
