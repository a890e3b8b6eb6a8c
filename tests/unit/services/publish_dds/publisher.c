/* SPDX-License-Identifier: MIT */
#include "publish/publisher.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/status.h"
#include "harness/made_ring.h"
#include "harness/test.h"
#include "publish/state.h"
#include "unit/services/publish_dds/fake_topics.h"

enum { STEPS = 50000000, MESSAGES = 1024 };

/* What was published: counters, and the contents that the tests look at. */
static struct {
	size_t channels;
	size_t status;
	size_t idl;
	size_t timemap;
	size_t samples;
	uint64_t cycle[MESSAGES];
	uint64_t session[MESSAGES];
	size_t blocks;
	uint32_t block_count[MESSAGES];
	uint64_t block_cycle[MESSAGES]; /* of its first sample */
	double block_adc[MESSAGES];     /* of its last sample */
	char state[32];
	char channel_name[MADE_CHANNELS][64];
	char owner[MADE_CHANNELS][16];
	double maximum[MADE_CHANNELS];
	int has_whole_idl;
	char quality[16];
} got;
static struct topics topics;

static void note_channels(const ecdaq_ChannelsV1 *m)
{
	CHECK_EQ(m->name._length, MADE_CHANNELS);
	for (uint32_t i = 0; i < m->name._length; i++) {
		snprintf(got.channel_name[i], sizeof(got.channel_name[i]), "%s",
			 m->name._buffer[i]);
		snprintf(got.owner[i], sizeof(got.owner[i]), "%s", m->owner._buffer[i]);
		got.maximum[i] = m->maximum._buffer[i];
	}
	got.channels++;
}

static void note_sample(const ecdaq_SampleV1 *m)
{
	CHECK(got.samples < MESSAGES);
	got.session[got.samples] = m->session;
	got.cycle[got.samples++] = m->cycle;
}

static void note_block(const ecdaq_BlockV1 *m)
{
	CHECK(got.blocks < MESSAGES);
	CHECK_EQ(m->values._length, m->count * m->channel_count);
	got.block_count[got.blocks] = m->count;
	got.block_cycle[got.blocks] = m->cycle._buffer[0];
	got.block_adc[got.blocks++] = m->adc._buffer[m->count - 1];
}

static void on_write(dds_entity_t writer, const void *message, int64_t utc_ns)
{
	if (writer == topics.channels) {
		note_channels(message);
	} else if (writer == topics.sample) {
		note_sample(message);
	} else if (writer == topics.block) {
		note_block(message);
	} else if (writer == topics.status) {
		const ecdaq_StatusV1 *m = message;

		snprintf(got.state, sizeof(got.state), "%s", m->state);
		got.status++;
	} else if (writer == topics.timemap) {
		const ecdaq_TimeMapV1 *m = message;

		CHECK_EQ(utc_ns, m->utc_ns);
		snprintf(got.quality, sizeof(got.quality), "%s", m->quality);
		got.timemap++;
	} else if (writer == topics.idl) {
		const char *text = ((const ecdaq_IdlV1 *)message)->text;

		got.has_whole_idl = strlen(text) > 3 &&
				    strcmp(text + strlen(text) - 3, "};\n") == 0 &&
				    strstr(text, "struct ReplyV1") != NULL;
		got.idl++;
	}
}

struct bench {
	char dir[64];
	char ring_path[96];
	struct config cfg;
	struct ring *ring;
	struct publisher *publisher;
};

static void bench_open(struct bench *b)
{
	char error[512];

	memset(b, 0, sizeof(*b));
	memset(&got, 0, sizeof(got));
	snprintf(b->dir, sizeof(b->dir), "/dev/shm/ecdaq-publisher-XXXXXX");
	CHECK(mkdtemp(b->dir) != NULL);
	snprintf(b->ring_path, sizeof(b->ring_path), "%s/samples", b->dir);
	config_defaults(&b->cfg);
	snprintf(b->cfg.run_dir, sizeof(b->cfg.run_dir), "%s", b->dir);
	snprintf(b->cfg.dds_interface, sizeof(b->cfg.dds_interface), "lo");
	b->cfg.dds_block_cycles = 4;
	topics = fake_topics(on_write);
	CHECK_EQ(publisher_create(&b->cfg, &b->publisher, error, sizeof(error)), 0);
}

static void step(struct bench *b)
{
	char error[512];

	CHECK_EQ(publisher_step(b->publisher, error, sizeof(error)), 0);
}

/* Steps until @counter has reached @count: sessions are looked for ten times a second. */
static void step_until(struct bench *b, const size_t *counter, size_t count)
{
	for (int n = 0; *counter < count; n++) {
		CHECK(n < STEPS);
		step(b);
	}
}

static void new_ring(struct bench *b, uint64_t session)
{
	struct made_meta meta = made_meta();

	meta.head.session = session;
	ring_destroy(b->ring);
	b->ring = made_ring(b->ring_path, &meta, 64);
}

static void bench_close(struct bench *b)
{
	static const char *const files[] = { "samples", "dds/status", "dds" };
	char path[128];

	publisher_destroy(b->publisher);
	ring_destroy(b->ring);
	fake_topics(NULL);
	for (size_t i = 0; i < sizeof(files) / sizeof(files[0]); i++) {
		snprintf(path, sizeof(path), "%s/%s", b->dir, files[i]);
		remove(path);
	}
	CHECK_EQ(rmdir(b->dir), 0);
}

TEST(publish_publisher, without_a_master_the_idl_and_the_status_are_published)
{
	struct bench b;

	bench_open(&b);
	CHECK_EQ(got.idl, 1);
	CHECK(got.has_whole_idl);
	step(&b);
	CHECK_EQ(got.status, 1);
	CHECK_STR(got.state, "NO MASTER");
	CHECK_EQ(got.channels, 0);
	CHECK_EQ(got.samples, 0);
	bench_close(&b);
}

TEST(publish_publisher, a_session_starts_with_its_channel_table_and_the_newest_sample)
{
	struct bench b;

	bench_open(&b);
	new_ring(&b, 7);
	made_push(b.ring, 0, 0, 0);
	step_until(&b, &got.channels, 1);
	CHECK_EQ(got.samples, 0); /* older samples are in the recording */
	made_push(b.ring, 1, 0, 0);
	made_push(b.ring, 2, 0, 0);
	step_until(&b, &got.samples, 4);
	CHECK_EQ(got.cycle[0], 1);
	CHECK_EQ(got.cycle[3], 2);
	CHECK_EQ(got.session[0], 7);
	CHECK(got.timemap >= 1);
	CHECK_EQ(got.channels, 1);
	bench_close(&b);
}

TEST(publish_publisher, a_later_session_is_published_from_its_first_sample)
{
	struct bench b;

	bench_open(&b);
	new_ring(&b, 7);
	step_until(&b, &got.channels, 1);
	ring_close(b.ring);
	step(&b);
	new_ring(&b, 8);
	made_push(b.ring, 0, 0, 0);
	made_push(b.ring, 1, 0, 0);
	step_until(&b, &got.samples, 4);
	CHECK_EQ(got.channels, 2);
	CHECK_EQ(got.cycle[0], 0);
	CHECK_EQ(got.session[0], 8);
	bench_close(&b);
}

TEST(publish_publisher, blocks_have_the_configured_length_and_the_last_one_is_not_lost)
{
	struct bench b;

	bench_open(&b);
	new_ring(&b, 7);
	step_until(&b, &got.channels, 1);
	for (uint64_t cycle = 0; cycle < 6; cycle++) {
		made_push(b.ring, cycle, 0, 0);
	}
	step_until(&b, &got.samples, 12);
	CHECK_EQ(got.blocks, 2); /* one per slave */
	CHECK_EQ(got.block_count[0], 4);
	CHECK_EQ(got.block_cycle[0], 0);
	CHECK_EQ(got.block_adc[0], 103);
	CHECK_EQ(got.block_adc[1], 203);
	ring_close(b.ring);
	step_until(&b, &got.blocks, 4);
	CHECK_EQ(got.block_count[2], 2);
	CHECK_EQ(got.block_cycle[2], 4);
	CHECK_EQ(got.block_adc[3], 205);
	bench_close(&b);
}

TEST(publish_publisher, the_interface_of_the_segment_is_refused)
{
	struct bench b;
	struct publisher *publisher;
	char error[512];

	bench_open(&b);
	snprintf(b.cfg.interface, sizeof(b.cfg.interface), "lo");
	CHECK_EQ(publisher_create(&b.cfg, &publisher, error, sizeof(error)), -EINVAL);
	CHECK_STR(error, "dds.interface: lo: in use for the EtherCAT segment");
	bench_close(&b);
}

TEST(publish_state, channels_are_listed_slave_by_slave_with_the_rules_of_outputs)
{
	struct made_meta meta = made_meta();
	struct channel_table *table = NULL;
	struct config cfg;

	memset(&got, 0, sizeof(got));
	topics = fake_topics(on_write);
	config_defaults(&cfg);
	cfg.output_count = 1;
	cfg.output[0] = (struct config_output){
		.channel = "b.led", .owner = CONFIG_OWNER_REMOTE, .min = 0, .max = 0.5
	};
	CHECK_EQ(channel_table_create(&meta, sizeof(meta), &table), 0);
	CHECK_EQ(state_put_channels(&topics, &cfg, table), 0);
	CHECK_STR(got.channel_name[0], "a.adc");
	CHECK_STR(got.channel_name[1], "a.counter");
	CHECK_STR(got.channel_name[2], "b.led");
	CHECK_STR(got.channel_name[3], "b.adc");
	CHECK_STR(got.owner[0], "");
	CHECK_STR(got.owner[2], "remote");
	CHECK_EQ(got.maximum[2], 0.5);
	cfg.output_count = 0;
	CHECK_EQ(state_put_channels(&topics, &cfg, table), 0);
	CHECK_STR(got.owner[2], "local");
	channel_table_destroy(table);
	fake_topics(NULL);
}

TEST(publish_state, the_state_is_that_of_the_bus_while_a_session_is_published)
{
	static struct status_page page;
	struct made_meta meta = made_meta();
	struct channel_table *table = NULL;
	struct state_view view = { .page = &page };

	memset(&got, 0, sizeof(got));
	topics = fake_topics(on_write);
	atomic_store(&page.bus_state, BUS_OP);
	state_put_status(&topics, &view);
	CHECK_STR(got.state, "NO MASTER"); /* the page of a master that has ended */
	CHECK_EQ(channel_table_create(&meta, sizeof(meta), &table), 0);
	view.table = table;
	state_put_status(&topics, &view);
	CHECK_STR(got.state, bus_state_to_str(BUS_OP));
	channel_table_destroy(table);
	fake_topics(NULL);
}
