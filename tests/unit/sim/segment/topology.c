/* SPDX-License-Identifier: MIT */
/* Lines and branches: the way of a frame, what the ports see of it, and what happens when it
 * breaks. */
#include <errno.h>

#include "base/bytes.h"
#include "harness/test.h"
#include "segment/segment.h"
#include "wire/datagram.h"
#include "wire/esc_reg.h"
#include "wire/sii.h"

enum { SII_BYTES = 128, IN = 150, BACK = 100, MS = 1000000, LOADED_NS = 10000000 };

/*
 *   master - 0 -port 1- 2 -port 1- 3
 *            '-port 3- 1 -port 2- 4
 * A frame visits port 3 before port 1: 0, 1, 4, 2, 3. Wires 10, 20, 30, 40, 50 ns towards slave 0
 * to 4.
 */
static struct segment *make_tree(void)
{
	static const int parent[] = { -1, 0, 0, 2, 1 };
	static const unsigned port[] = { 0, 3, 1, 1, 2 };
	static uint8_t sii[SII_BYTES] = { [0] = 5, [1] = 0x0c };
	struct segment_slave_spec spec[5] = { 0 };
	struct segment *segment = NULL;

	sii[14] = sii_checksum(sii);
	for (unsigned i = 0; i < 5; i++) {
		spec[i] = (struct segment_slave_spec){ .features = &esc_et1100,
						       .sii = sii,
						       .sii_bytes = SII_BYTES,
						       .parent = parent[i],
						       .parent_port = port[i],
						       .wire_ns = 10 * (i + 1),
						       .processing_ns = IN,
						       .forwarding_ns = BACK };
	}
	CHECK_EQ(segment_create(spec, 5, 0, &segment), 0);
	segment_advance(segment, LOADED_NS);
	return segment;
}

static uint8_t frame[ECAT_FRAME_MAX_BYTES];
static size_t frame_len;

static int send(struct segment *s, int64_t t_ns, enum ecat_cmd cmd, uint16_t adp, uint16_t ado,
		uint8_t *data, uint16_t len)
{
	static const uint8_t source[6] = { 0x10 };
	struct ecat_frame_builder fb;
	struct ecat_datagram dg;
	int64_t back_ns;
	size_t pos = 0;
	uint8_t *body;
	int r;

	ecat_frame_begin(&fb, frame, source);
	body = ecat_frame_add(&fb, cmd, 0, adp, ado, len);
	memcpy(body, data, len);
	frame_len = ecat_frame_end(&fb);
	r = segment_frame(s, t_ns, frame, frame_len, &back_ns);
	if (r < 0) {
		return r;
	}
	CHECK_EQ(ecat_frame_next(frame, frame_len, &pos, &dg), 1);
	memcpy(data, dg.data, len);
	return get_le16(dg.wkc);
}

static void latch(struct segment *s, int64_t t_ns, int wkc)
{
	uint8_t zeros[4] = { 0 };

	CHECK_EQ(send(s, t_ns, ECAT_CMD_BWR, 0, ESC_REG_DC_RECEIVE_TIME_PORT, zeros, 4), wkc);
}

/* Receive time of @port, from the time the frame left the master. Clocks run true and from 0. */
static int64_t seen(struct segment *s, unsigned slave, unsigned port, int64_t sent_ns)
{
	const uint8_t *r = segment_esc(s, slave)->reg + ESC_REG_DC_RECEIVE_TIME_PORT + 4 * port;

	return (int64_t)get_le32(r) - sent_ns;
}

TEST(topology, a_frame_goes_through_ports_0_3_1_2_and_positions_count_that_way)
{
	static const unsigned order[] = { 0, 1, 4, 2, 3 };
	struct segment *s = make_tree();

	for (unsigned n = 0; n < 5; n++) {
		uint8_t address[2] = { (uint8_t)(0x10 + n), 0x20 };

		CHECK_EQ(send(s, LOADED_NS, ECAT_CMD_APWR, (uint16_t)-n, ESC_REG_STATION_ADDRESS,
			      address, 2),
			 1);
		CHECK_EQ(segment_esc(s, order[n])->reg[ESC_REG_STATION_ADDRESS], 0x10 + n);
	}
	segment_destroy(s);
}

TEST(topology, receive_times_of_a_tree_are_those_of_its_wires)
{
	struct segment *s = make_tree();
	const int64_t t = LOADED_NS + 7 * MS;
	/* By hand: into 0 after 10; from there to 1 by IN and wire 20, to 4 by IN and wire 50, and
	 * back. */
	const int64_t at_1 = 10 + IN + 20;
	const int64_t at_4 = at_1 + IN + 50;
	const int64_t back_in_1 = at_4 + IN + 50;
	const int64_t back_in_0 = back_in_1 + BACK + 20;
	const int64_t at_2 = back_in_0 + BACK + 30;
	const int64_t at_3 = at_2 + IN + 40;
	const int64_t back_in_2 = at_3 + IN + 40;
	const int64_t again_in_0 = back_in_2 + BACK + 30;
	int64_t back_ns;

	latch(s, t, 5);
	/* The clock shows its tick of 10 ns; all of these are whole ticks. */
	CHECK_EQ(seen(s, 0, 0, t), 10);
	CHECK_EQ(seen(s, 1, 0, t), at_1);
	CHECK_EQ(seen(s, 4, 0, t), at_4);
	CHECK_EQ(seen(s, 1, 2, t), back_in_1);
	CHECK_EQ(seen(s, 0, 3, t), back_in_0);
	CHECK_EQ(seen(s, 2, 0, t), at_2);
	CHECK_EQ(seen(s, 3, 0, t), at_3);
	CHECK_EQ(seen(s, 2, 1, t), back_in_2);
	CHECK_EQ(seen(s, 0, 1, t), again_in_0);
	frame[6] = 0x10;
	CHECK_EQ(segment_frame(s, t + MS, frame, frame_len, &back_ns), 0);
	CHECK_EQ(back_ns - t - MS, again_in_0 + BACK + 10);
	segment_destroy(s);
}

TEST(topology, a_cut_branch_closes_the_port_and_the_rest_goes_on)
{
	struct segment *s = make_tree();
	uint8_t data[2] = { 0 };

	segment_cut(s, 1, LOADED_NS);
	CHECK_EQ(send(s, LOADED_NS, ECAT_CMD_BRD, 0, ESC_REG_TYPE, data, 1), 3);
	/* Port 0 and 1 have links; 2 and 3 have not, their loops are closed. */
	CHECK_EQ(get_le16(segment_esc(s, 0)->reg + ESC_REG_DL_STATUS) & 0xfff0, 0x5a30);
	CHECK_EQ(segment_esc(s, 0)->reg[ESC_REG_LOST_LINK_COUNTER + 3], 1);
	CHECK_EQ(segment_esc(s, 1)->reg[ESC_REG_LOST_LINK_COUNTER], 1);
	segment_heal(s, 1, LOADED_NS + MS);
	CHECK_EQ(send(s, LOADED_NS + MS, ECAT_CMD_BRD, 0, ESC_REG_TYPE, data, 1), 5);
	CHECK_EQ(get_le16(segment_esc(s, 0)->reg + ESC_REG_DL_STATUS) & 0xfff0, 0x9ab0);
	segment_destroy(s);
}

TEST(topology, a_port_that_the_master_closes_has_a_link_and_no_communication)
{
	struct segment *s = make_tree();
	uint8_t closed[1] = { 3 << 2 }; /* 0x0101: port 1 closed, the others automatic */
	uint8_t data[2] = { 0 };

	CHECK_EQ(send(s, LOADED_NS, ECAT_CMD_APWR, 0, ESC_REG_DL_CONTROL + 1, closed, 1), 1);
	CHECK_EQ(send(s, LOADED_NS, ECAT_CMD_BRD, 0, ESC_REG_TYPE, data, 1), 3);
	CHECK_EQ(get_le16(segment_esc(s, 0)->reg + ESC_REG_DL_STATUS) & 0xfff0, 0x96b0);
	closed[0] = 0;
	CHECK_EQ(send(s, LOADED_NS, ECAT_CMD_APWR, 0, ESC_REG_DL_CONTROL + 1, closed, 1), 1);
	CHECK_EQ(send(s, LOADED_NS, ECAT_CMD_BRD, 0, ESC_REG_TYPE, data, 1), 5);
	segment_destroy(s);
}

TEST(topology, nothing_comes_back_when_the_first_slave_is_gone)
{
	struct segment *s = make_tree();
	uint8_t data[2] = { 0 };

	segment_power_off(s, 0, LOADED_NS);
	CHECK_EQ(send(s, LOADED_NS, ECAT_CMD_BRD, 0, ESC_REG_TYPE, data, 1), -ENOLINK);
	segment_power_on(s, 0, LOADED_NS + MS);
	segment_cut(s, 0, LOADED_NS + MS);
	CHECK_EQ(send(s, LOADED_NS + MS, ECAT_CMD_BRD, 0, ESC_REG_TYPE, data, 1), -ENOLINK);
	segment_heal(s, 0, LOADED_NS + MS);
	CHECK_EQ(send(s, LOADED_NS + MS, ECAT_CMD_BRD, 0, ESC_REG_TYPE, data, 1), 5);
	segment_destroy(s);
}

TEST(topology, a_slave_that_was_without_power_starts_anew_with_its_clock_at_0)
{
	struct segment *s = make_tree();
	uint8_t address[2] = { 0x34, 0x12 };
	uint8_t time[8] = { 0 };

	CHECK_EQ(send(s, LOADED_NS, ECAT_CMD_BWR, 0, ESC_REG_STATION_ADDRESS, address, 2), 5);
	segment_power_off(s, 3, LOADED_NS + MS);
	segment_power_on(s, 3, LOADED_NS + 2 * MS);
	CHECK_EQ(get_le16(segment_esc(s, 3)->reg + ESC_REG_STATION_ADDRESS), 0);
	CHECK_EQ(get_le16(segment_esc(s, 2)->reg + ESC_REG_STATION_ADDRESS), 0x1234);
	CHECK_EQ(send(s, LOADED_NS + 5 * MS, ECAT_CMD_FPRD, 0, ESC_REG_DC_SYSTEM_TIME, time, 8), 1);
	CHECK(get_le64(time) < 3 * MS + 2000);
	segment_destroy(s);
}

TEST(topology, a_damaged_frame_is_counted_by_the_first_and_as_forwarded_by_the_others)
{
	struct segment *s = make_tree();
	uint8_t data[2] = { 0 };
	int64_t back_ns;

	CHECK_EQ(send(s, LOADED_NS, ECAT_CMD_BRD, 0, ESC_REG_TYPE, data, 1), 5);
	put_le16(frame + 14, (uint16_t)(1 << 12 | 0x7ff)); /* longer than the frame */
	CHECK_EQ(segment_frame(s, LOADED_NS, frame, frame_len, &back_ns), -EBADMSG);
	CHECK_EQ(segment_esc(s, 0)->reg[ESC_REG_ECAT_PU_ERROR], 1);
	CHECK_EQ(segment_esc(s, 0)->reg[ESC_REG_FORWARDED_RX_ERROR], 0);
	CHECK_EQ(segment_esc(s, 3)->reg[ESC_REG_ECAT_PU_ERROR], 0);
	CHECK_EQ(segment_esc(s, 3)->reg[ESC_REG_FORWARDED_RX_ERROR], 1);
	for (int n = 0; n < 300; n++) {
		CHECK_EQ(segment_frame(s, LOADED_NS, frame, frame_len, &back_ns), -EBADMSG);
	}
	CHECK_EQ(segment_esc(s, 0)->reg[ESC_REG_ECAT_PU_ERROR], 0xff);
	segment_destroy(s);
}

TEST(topology, what_is_no_ethercat_is_taken_off_the_wire_and_not_counted)
{
	struct segment *s = make_tree();
	uint8_t arp[60] = { [12] = 0x08, [13] = 0x06 };
	int64_t back_ns = 77;

	CHECK_EQ(segment_frame(s, LOADED_NS, arp, sizeof(arp), &back_ns), -EBADMSG);
	CHECK_EQ(segment_frame(s, LOADED_NS, arp, 5, &back_ns), -EBADMSG);
	CHECK_EQ(back_ns, 77);
	CHECK_EQ(segment_esc(s, 0)->reg[ESC_REG_ECAT_PU_ERROR], 0);
	segment_destroy(s);
}

TEST(topology, a_segment_that_cannot_be_is_refused)
{
	static const uint8_t sii[16];
	struct segment_slave_spec spec[LIMIT_SLAVES + 1] = {
		{ .features = &esc_et1100, .sii = sii, .sii_bytes = sizeof(sii), .parent = -1 },
		{ .features = &esc_et1100, .sii = sii, .sii_bytes = sizeof(sii), .parent_port = 1 },
	};
	struct segment *s = NULL;

	CHECK_EQ(segment_create(spec, 0, 0, &s), -EINVAL);
	CHECK_EQ(segment_create(spec, LIMIT_SLAVES + 1, 0, &s), -EINVAL);
	spec[1].parent_port = 0;
	CHECK_EQ(segment_create(spec, 2, 0, &s), -EINVAL);
	spec[1].parent_port = 4;
	CHECK_EQ(segment_create(spec, 2, 0, &s), -EINVAL);
	spec[1].parent_port = 1;
	spec[1].parent = 1; /* itself */
	CHECK_EQ(segment_create(spec, 2, 0, &s), -EINVAL);
	spec[1].parent = -1; /* two first slaves on one port of the master */
	CHECK_EQ(segment_create(spec, 2, 0, &s), -EINVAL);
	spec[1].parent = 0;
	spec[1].sii_bytes = SEGMENT_SII_BYTES + 1;
	CHECK_EQ(segment_create(spec, 2, 0, &s), -EINVAL);
	CHECK(s == NULL);
}

TEST(topology, a_line_of_as_many_slaves_as_allowed_answers_as_that_many)
{
	static struct segment_slave_spec spec[LIMIT_SLAVES];
	static const uint8_t sii[16];
	struct segment *s = NULL;
	uint8_t data[2] = { 0 };

	for (int i = 0; i < LIMIT_SLAVES; i++) {
		spec[i] = (struct segment_slave_spec){ .features = &esc_et1100,
						       .sii = sii,
						       .sii_bytes = sizeof(sii),
						       .parent = i - 1,
						       .parent_port = 1 };
	}
	CHECK_EQ(segment_create(spec, LIMIT_SLAVES, 0, &s), 0);
	CHECK_EQ(send(s, MS, ECAT_CMD_BRD, 0, ESC_REG_TYPE, data, 1), LIMIT_SLAVES);
	CHECK_EQ(send(s, MS, ECAT_CMD_APRD, (uint16_t)(1 - LIMIT_SLAVES), ESC_REG_TYPE, data, 1),
		 1);
	CHECK_EQ(send(s, MS, ECAT_CMD_APRD, (uint16_t)-LIMIT_SLAVES, ESC_REG_TYPE, data, 1), 0);
	segment_destroy(s);
}
