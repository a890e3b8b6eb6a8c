/* SPDX-License-Identifier: MIT */
/*
 * The truth of the simulated segment: a master's half of a capture goes in, what comes out must be
 * what the real slaves answered. Clock values differ and are listed; every other byte and every WKC
 * must agree.
 */
#include "base/bytes.h"
#include "capture.h"
#include "compare.h"
#include "harness/test.h"
#include "sim/catalogue.h"
#include "wire/datagram.h"
#include "wire/esc_reg.h"

/* The slaves were long in power when the master came. */
enum { POWERED_NS = 1000000000 };

struct bench {
	struct segment_slave_spec spec[8];
	unsigned count;
	struct segment *segment;
};

static void add_slave(struct bench *b, const struct bytes *sii, int64_t processing_ns, double ppm)
{
	uint32_t vendor = get_le32(sii->at + 0x10);
	uint32_t product = get_le32(sii->at + 0x14);

	b->spec[b->count] = (struct segment_slave_spec){
		.features = catalogue_features(vendor, product),
		.sii = sii->at,
		.sii_bytes = sii->len,
		.ppm = ppm,
		.parent = (int)b->count - 1,
		.parent_port = 1,
		.wire_ns = 5,
		.processing_ns = processing_ns,
		.forwarding_ns = 140,
	};
	b->count++;
}

/* Was the link's coming up seen by a master before this one? Then its event is pending no more. */
enum history { LINK_UNSEEN, LINK_SEEN };

static void see_link(struct segment *segment)
{
	static const uint8_t source[6] = { 2 };
	uint8_t frame[ECAT_FRAME_MAX_BYTES];
	struct ecat_frame_builder fb;
	int64_t back_ns;

	ecat_frame_begin(&fb, frame, source);
	CHECK(ecat_frame_add(&fb, ECAT_CMD_BRD, 0, 0, ESC_REG_DL_STATUS, 2) != NULL);
	CHECK_EQ(segment_frame(segment, POWERED_NS / 2, frame, ecat_frame_end(&fb), &back_ns), 0);
}

static void replay(struct bench *b, enum history history, const char *title,
		   const struct bytes *capture, struct compare *c)
{
	CHECK_EQ(segment_create(b->spec, b->count, 0, &b->segment), 0);
	if (history == LINK_SEEN) {
		see_link(b->segment);
	}
	compare_run(capture, b->segment, POWERED_NS, c);
	compare_print(title, c);
	CHECK(c->frames > 0);
	CHECK_EQ(c->unanswered, 0);
	CHECK_EQ(c->wkc_differ, 0);
	CHECK_EQ(c->header_differ, 0);
	CHECK_EQ(c->bytes_unexplained, 0);
	segment_destroy(b->segment);
}

static const struct compare_latch *latch_of(const struct compare *c, uint16_t station)
{
	for (unsigned i = 0; i < c->latch_count; i++) {
		if (c->latch[i].station == station) {
			return &c->latch[i];
		}
	}
	test_fail(__FILE__, __LINE__, "receive times of station %04x were not read", station);
}

/* Receive time of @port after that of port 0, within two ticks. */
static void check_round_trip(const struct compare *c, uint16_t station, unsigned port)
{
	const struct compare_latch *l = latch_of(c, station);
	int32_t real = (int32_t)(l->real[port] - l->real[0]);
	int32_t simulated = (int32_t)(l->simulated[port] - l->simulated[0]);

	printf("  station %04x: frame back at port %u after %d ns, simulated %d ns\n", station,
	       port, real, simulated);
	CHECK(abs(real - simulated) <= 20);
}

TEST(replay, ek1100_el2828_el2889_answer_ethercrab_as_the_real_ones_did)
{
	struct bytes capture = capture_load("captures/ethercrab-ek1100-el2828-el2889.pcapng");
	struct bytes ek1100 = capture_load("sii/ek1100.bin");
	struct bytes el2828 = capture_load("sii/el2828.bin");
	struct bytes el2889 = capture_load("sii/el2889.bin");
	struct bench b = { .count = 0 };
	static struct compare c;

	add_slave(&b, &ek1100, 140, -26.0);
	add_slave(&b, &el2828, 150, 4.0);
	add_slave(&b, &el2889, 150, 11.0);
	replay(&b, LINK_UNSEEN, "EtherCrab, EK1100 + EL2828 + EL2889", &capture, &c);
	check_round_trip(&c, 0x1000, 1);
	check_round_trip(&c, 0x1001, 1);
	capture_free(&capture);
	capture_free(&ek1100);
	capture_free(&el2828);
	capture_free(&el2889);
}

TEST(replay, ek1100_answers_soem_as_the_real_one_did)
{
	struct bytes capture = capture_load("captures/soem-ek1100.pcapng");
	struct bytes ek1100 = capture_load("sii/ek1100.bin");
	struct bench b = { .count = 0 };
	static struct compare c;

	add_slave(&b, &ek1100, 140, 0);
	replay(&b, LINK_SEEN, "SOEM, EK1100", &capture, &c);
	capture_free(&capture);
	capture_free(&ek1100);
}

/* There is no image of an EL1004, so its EEPROM is what SOEM read; the rest of the capture tests.
 */
TEST(replay, ek1100_and_el1004_answer_soem_as_the_real_ones_did)
{
	struct bytes capture = capture_load("captures/soem-ek1100-el1004.pcapng");
	struct bytes ek1100 = capture_load("sii/ek1100.bin");
	struct bytes el1004 = capture_learn_sii(&capture, 0x1002, 1);
	struct bench b = { .count = 0 };
	static struct compare c;

	add_slave(&b, &ek1100, 140, 0);
	add_slave(&b, &el1004, 150, 0);
	replay(&b, LINK_UNSEEN, "SOEM, EK1100 + EL1004", &capture, &c);
	check_round_trip(&c, 0x1001, 1);
	capture_free(&capture);
	capture_free(&ek1100);
	capture_free(&el1004);
}
