/* SPDX-License-Identifier: MIT */
#include "publish/sample_writer.h"

#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "harness/made_ring.h"
#include "harness/test.h"
#include "unit/services/publish_dds/fake_topics.h"

enum { MESSAGES = 4096 };

/* What was published of each sample. */
static struct {
	uint64_t cycle;
	uint32_t flags;
	uint16_t slave;
	int is_good;
	double adc;
	double value0;
} got[MESSAGES];
static size_t got_count;

static void on_write(dds_entity_t writer, const void *message, int64_t utc_ns)
{
	const ecdaq_SampleV1 *m = message;

	(void)writer;
	CHECK(utc_ns != 0);
	CHECK(got_count < MESSAGES);
	got[got_count].cycle = m->cycle;
	got[got_count].flags = m->flags;
	got[got_count].slave = m->slave;
	got[got_count].is_good = m->is_good;
	got[got_count].adc = m->adc;
	got[got_count++].value0 = m->values._buffer[0];
}

struct bench {
	char path[128];
	struct config cfg;
	struct topics topics;
	struct sample_counts counts;
	struct ring *ring;
	struct reader *reader;
	struct sample_writer *samples;
};

static void bench_open(struct bench *b, uint64_t slots)
{
	struct made_meta meta = made_meta();
	uint64_t lost;

	memset(b, 0, sizeof(*b));
	got_count = 0;
	snprintf(b->path, sizeof(b->path), "%s", made_path("publish"));
	config_defaults(&b->cfg);
	b->cfg.dds_block_cycles = 0;
	b->topics = fake_topics(on_write);
	b->topics.ros2_sample = 0;
	b->ring = made_ring(b->path, &meta, slots);
	CHECK_EQ(reader_create(b->path, READER_AT_OLDEST, &b->reader), 0);
	CHECK_EQ(reader_next(b->reader, &lost), READER_BEGUN);
	CHECK_EQ(sample_writer_create(b->reader, &b->cfg, &b->topics, &b->counts, &b->samples), 0);
}

static void bench_close(struct bench *b)
{
	sample_writer_destroy(b->samples);
	reader_destroy(b->reader);
	ring_destroy(b->ring);
	fake_topics(NULL);
	unlink(b->path);
}

/* bus.datagrams: per_slave with slave 1 lost: the flag is that of the cycle, not of each slave. */
TEST(publish_samples, a_low_working_counter_marks_the_lost_slaves_sample_only)
{
	struct bench b;

	bench_open(&b, 64);
	made_push(b.ring, 1, 2, SAMPLE_WKC_LOW);
	made_push(b.ring, 2, 3, SAMPLE_LOST);
	made_push(b.ring, 3, 0, SAMPLE_LATE);
	CHECK_EQ(sample_writer_step(b.samples, 10), SAMPLE_WRITER_EMPTY);
	CHECK_EQ(got_count, 6);
	CHECK_EQ(got[0].slave, 0);
	CHECK_EQ(got[0].flags, SAMPLE_WKC_LOW);
	CHECK(got[0].is_good);
	CHECK_EQ(got[1].slave, 1);
	CHECK(!got[1].is_good);
	CHECK(!got[2].is_good && !got[3].is_good);
	CHECK(got[4].is_good && got[5].is_good);
	CHECK_EQ(got[4].adc, 103);
	CHECK_EQ(got[5].adc, 203);
	CHECK_EQ(got[5].value0, 0); /* of b.led, the first channel of slave 1 */
	CHECK_EQ(b.counts.published, 3);
	bench_close(&b);
}

TEST(publish_samples, a_ring_truncated_while_it_is_published_ends_the_session)
{
	struct bench b;
	enum sample_writer_result result;

	bench_open(&b, 4096);
	for (uint64_t i = 0; i < 1500; i++) {
		made_push(b.ring, i, 0, 0);
	}
	CHECK_EQ(sample_writer_step(b.samples, 10), SAMPLE_WRITER_MORE);
	made_truncate(b.path, 4096);
	while ((result = sample_writer_step(b.samples, 64)) == SAMPLE_WRITER_MORE) {
	}
	CHECK_EQ(result, SAMPLE_WRITER_ENDED);
	CHECK(b.counts.published >= 10 && b.counts.published < 1500);
	made_truncate(b.path, 1 << 20);
	bench_close(&b);
}

TEST(publish_samples, sizes_raised_while_it_is_published_change_no_message)
{
	uint32_t large = 60000;
	struct bench b;

	bench_open(&b, 256);
	for (uint64_t i = 0; i < 200; i++) {
		made_push(b.ring, i, 0, 0);
	}
	made_overwrite(b.path, MADE_PAYLOAD_BYTES, &large, sizeof(large));
	CHECK_EQ(sample_writer_step(b.samples, 1000), SAMPLE_WRITER_EMPTY);
	CHECK_EQ(got_count, 400);
	for (size_t i = 0; i < got_count; i++) {
		CHECK_EQ(got[i].cycle, i / 2);
		CHECK_EQ(got[i].adc, (double)(i / 2 + (i % 2 == 0 ? 100 : 200)));
	}
	bench_close(&b);
}
