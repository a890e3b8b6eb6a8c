/* SPDX-License-Identifier: MIT */
#include "bench.h"

#include "base/bytes.h"
#include "devices/catalogue.h"
#include "harness/test.h"
#include "player.h"
#include "wire/datagram.h"
#include "wire/esc_reg.h"
#include "wire/sii.h"

/* The slaves were long in power when the master came. */
enum { POWERED_NS = 1000000000 };

static void load_sii(struct bench *b, unsigned i, const struct bench_slave *s)
{
	char path[64];

	if (s->sii != NULL) {
		snprintf(path, sizeof(path), "sii/%s", s->sii);
		b->sii[i] = capture_load(path);
		return;
	}
	b->sii[i] = capture_learn_sii(&b->capture, s->station, (uint16_t)i);
	if (s->pdi != 0) {
		put_le16(b->sii[i].at, s->pdi);
		b->sii[i].at[14] = sii_checksum(b->sii[i].at);
	}
}

static void add_slave(struct bench *b, const struct bench_slave *s)
{
	unsigned i = b->count++;
	const uint8_t *sii;

	load_sii(b, i, s);
	sii = b->sii[i].at;
	b->spec[i] = (struct segment_slave_spec){
		.features = s->features != NULL ? s->features
						: catalogue_features(get_le32(sii + 0x10),
								     get_le32(sii + 0x14)),
		.sii = sii,
		.sii_bytes = b->sii[i].len,
		.device = s->has_application ? player_create(&b->pairs, s->station, POWERED_NS)
					     : NULL,
		.ppm = s->ppm,
		.clock_start_ns = capture_learn_clock(&b->pairs, s->station, POWERED_NS),
		.parent = (int)i - 1,
		.parent_port = 1,
		.wire_ns = 5,
		.processing_ns = s->processing_ns,
		.forwarding_ns = 140,
	};
}

static void make_history(struct segment *segment, enum bench_history history)
{
	static const uint8_t source[6] = { 2 };
	uint8_t frame[ECAT_FRAME_MAX_BYTES];
	struct ecat_frame_builder fb;
	int64_t back_ns;
	uint8_t *data;

	if (history == BENCH_FIRST_MASTER) {
		return;
	}
	ecat_frame_begin(&fb, frame, source);
	if (history == BENCH_LINK_SEEN) {
		CHECK(ecat_frame_add(&fb, ECAT_CMD_BRD, 0, 0, ESC_REG_DL_STATUS, 2) != NULL);
	} else {
		data = ecat_frame_add(&fb, ECAT_CMD_BWR, 0, 0, ESC_REG_ECAT_EVENT_MASK, 2);
		CHECK(data != NULL);
		put_le16(data, ESC_ECAT_EVENT_DL_STATUS);
	}
	CHECK_EQ(segment_frame(segment, POWERED_NS / 2, frame, ecat_frame_end(&fb), &back_ns), 0);
}

void bench_run(struct bench *b, const char *name, const struct bench_slave *slaves, unsigned count,
	       enum bench_history history)
{
	struct segment *segment = NULL;
	char path[96];

	memset(b, 0, sizeof(*b));
	CHECK(count <= BENCH_SLAVES);
	snprintf(path, sizeof(path), "captures/%s", name);
	b->capture = capture_load(path);
	b->pairs = capture_pair_up(&b->capture);
	for (unsigned i = 0; i < count; i++) {
		add_slave(b, &slaves[i]);
		if (slaves[i].leftover_ports != 0) {
			b->result.leftover_station = slaves[i].station;
			b->result.leftover_ports = slaves[i].leftover_ports;
		}
	}
	CHECK_EQ(segment_create(b->spec, b->count, 0, &segment), 0);
	make_history(segment, history);
	compare_run(&b->pairs, segment, POWERED_NS, &b->result);
	compare_print(name, &b->result);
	CHECK(b->result.frames > 0);
	segment_destroy(segment);
}

void bench_replay(struct bench *b, const char *name, const struct bench_slave *slaves,
		  unsigned count, enum bench_history history)
{
	bench_run(b, name, slaves, count, history);
	CHECK_EQ(b->result.unanswered, 0);
	CHECK_EQ(b->result.wkc_differ, 0);
	CHECK_EQ(b->result.header_differ, 0);
	CHECK_EQ(b->result.bytes_unexplained, 0);
}

void bench_check_round_trip(const struct bench *b, uint16_t station, unsigned port)
{
	const struct compare *c = &b->result;
	const struct compare_latch *l = NULL;
	int32_t real;
	int32_t simulated;

	for (unsigned i = 0; i < c->latch_count; i++) {
		l = c->latch[i].station == station ? &c->latch[i] : l;
	}
	if (l == NULL) {
		test_fail(__FILE__, __LINE__, "receive times of station %04x were not read",
			  station);
	}
	real = (int32_t)(l->real[port] - l->real[0]);
	simulated = (int32_t)(l->simulated[port] - l->simulated[0]);
	printf("  station %04x: frame back at port %u after %d ns, simulated %d ns\n", station,
	       port, real, simulated);
	CHECK(abs(real - simulated) <= 20);
}

void bench_end(struct bench *b)
{
	capture_free(&b->capture);
	free(b->pairs.at);
	for (unsigned i = 0; i < b->count; i++) {
		capture_free(&b->sii[i]);
	}
}
