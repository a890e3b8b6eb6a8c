/* SPDX-License-Identifier: MIT */
#include "base/ring.h"

#include <errno.h>
#include <pthread.h>
#include <signal.h>
#include <stdatomic.h>
#include <sys/wait.h>
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
	CHECK_EQ(ring_read(reader, payload, &lost), RING_EMPTY);
	for (uint8_t i = 0; i < 5; i++) {
		uint8_t head[3] = { i, 1, 2 };
		uint8_t body[17];

		memset(body, i, sizeof(body));
		ring_push(ring, head, sizeof(head), body, i % 2 ? sizeof(body) : 4);
	}
	for (uint8_t i = 0; i < 5; i++) {
		CHECK_EQ(ring_read(reader, payload, &lost), RING_OK);
		CHECK_EQ(payload[0], i);
		CHECK_EQ(payload[2], 2);
		CHECK_EQ(payload[6], i);
		CHECK_EQ(payload[19], i % 2 ? i : 0);
	}
	CHECK_EQ(ring_read(reader, payload, &lost), RING_EMPTY);
	ring_destroy(ring);
	CHECK_EQ(ring_read(reader, payload, &lost), RING_CLOSED);
	ring_reader_destroy(reader);
	unlink(path);
}

TEST(ring, a_reader_that_was_lapped_learns_exactly_how_many_it_missed)
{
	struct ring *ring = make_ring(64, 8);
	struct ring_reader *reader = open_reader();
	uint64_t lost = 0;
	uint64_t value;

	for (uint64_t i = 0; i < 1000; i++) {
		ring_push(ring, &i, sizeof(i), NULL, 0);
	}
	CHECK_EQ(ring_read(reader, &value, &lost), RING_LOST);
	CHECK_EQ(ring_read(reader, &value, &lost), RING_OK);
	CHECK_EQ(value, lost);
	while (ring_read(reader, &value, &lost) == RING_OK) {
	}
	CHECK_EQ(value, 999);
	ring_reader_destroy(reader);
	ring_destroy(ring);
	unlink(path);
}

TEST(ring, a_write_through_a_readers_map_faults)
{
	struct ring *ring = make_ring(8, 8);
	struct ring_reader *reader = open_reader();
	size_t bytes;
	const char *meta = ring_meta(reader, &bytes);
	pid_t pid = fork();
	int status = 0;

	if (pid == 0) {
		signal(SIGSEGV, SIG_DFL);
		*(volatile char *)(uintptr_t)meta = 1;
		_exit(0);
	}
	CHECK_EQ(waitpid(pid, &status, 0), pid);
	/* A sanitizer turns the signal into an exit code of its own; only 0 would mean it was
	 * written. */
	CHECK(WIFSIGNALED(status) || WEXITSTATUS(status) != 0);
	CHECK_STR(ring_meta(reader, &bytes), "hello");
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
	while (got < 20000) {
		uint64_t words[16];
		uint64_t lost = 0;

		switch (ring_read(reader, words, &lost)) {
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
		case RING_CLOSED:
			break;
		}
	}
	atomic_store(&h.stop, 1);
	pthread_join(thread, NULL);
	CHECK_EQ(last + 1, got + missed);
	ring_reader_destroy(reader);
	ring_destroy(h.ring);
	unlink(path);
}
