/* SPDX-License-Identifier: MIT */
/* Faults that need the whole way of a frame: held back, damaged, a slave reset. */
#include <errno.h>

#include "base/bytes.h"
#include "bench.h"
#include "harness/test.h"
#include "segment/fault.h"
#include "segment/in_process.h"
#include "wire/esc_reg.h"

enum { LOADED_NS = 10000000, MS = 1000000 };

struct line {
	struct bench *bench;
	struct fault_plan *plan;
	struct in_process *host;
	struct transport wire;
	struct platform clock;
};

static struct line open_line(void)
{
	const struct bench_slave slaves[3] = { { .pdi = 5 }, { .pdi = 5 }, { .pdi = 5 } };
	struct line l = { .bench = bench_create(slaves, 3), .plan = fault_plan_create(1, 0) };
	struct in_process_spec spec = { .segment = l.bench->segment, .faults = l.plan };

	CHECK(l.plan != NULL);
	CHECK_EQ(in_process_create(&spec, &l.host), 0);
	l.wire = in_process_transport(l.host);
	l.clock = in_process_platform(l.host);
	return l;
}

static void close_line(struct line *l)
{
	in_process_destroy(l->host);
	fault_plan_destroy(l->plan);
	bench_destroy(l->bench);
}

static void plan(struct line *l, const char *text)
{
	char error[128];

	CHECK_EQ(fault_plan_add(l->plan, text, 3, error, sizeof(error)), 0);
}

static void send_one(struct line *l, uint8_t idx)
{
	static const uint8_t source[6] = { 0x10 };
	uint8_t frame[ECAT_FRAME_MAX_BYTES];
	struct ecat_frame_builder fb;

	ecat_frame_begin(&fb, frame, source);
	CHECK(ecat_frame_add(&fb, ECAT_CMD_BRD, idx, 0, ESC_REG_TYPE, 1) != NULL);
	CHECK_EQ(l->wire.send(l->wire.ctx, frame, ecat_frame_end(&fb)), 0);
}

/* The index of the next frame that comes within 1 ms; -1: none. */
static int receive_one(struct line *l, uint16_t *ret_wkc)
{
	uint8_t frame[ECAT_FRAME_MAX_BYTES];
	struct ecat_datagram dg;
	size_t pos = 0;
	mono_t until = mono_add(l->clock.now(l->clock.ctx), (span_t){ MS });
	int len = l->wire.receive(l->wire.ctx, frame, sizeof(frame), until, NULL);

	if (len < 0) {
		CHECK_EQ(len, -EAGAIN);
		return -1;
	}
	CHECK_EQ(ecat_frame_next(frame, (size_t)len, &pos, &dg), 1);
	*ret_wkc = get_le16(dg.wkc);
	return dg.idx;
}

TEST(fault_actions, a_frame_held_back_comes_with_the_next_one)
{
	struct line l = open_line();
	uint16_t wkc = 0;

	plan(&l, "frame=2 hold");
	send_one(&l, 1);
	CHECK_EQ(receive_one(&l, &wkc), 1);
	send_one(&l, 2);
	CHECK_EQ(receive_one(&l, &wkc), -1);
	CHECK_EQ(receive_one(&l, &wkc), -1);
	send_one(&l, 3);
	CHECK_EQ(receive_one(&l, &wkc), 2);
	CHECK_EQ(wkc, 3);
	CHECK_EQ(receive_one(&l, &wkc), 3);
	CHECK_EQ(receive_one(&l, &wkc), -1);
	close_line(&l);
}

TEST(fault_actions, a_damaged_frame_is_lost_and_counted_from_its_place_on)
{
	struct line l = open_line();
	uint16_t wkc = 0;

	plan(&l, "frame=1 damage slave=1");
	send_one(&l, 1);
	CHECK_EQ(receive_one(&l, &wkc), -1);
	send_one(&l, 2);
	CHECK_EQ(receive_one(&l, &wkc), 2);
	CHECK_EQ(segment_esc(l.bench->segment, 0)->reg[ESC_REG_RX_ERROR_COUNTER], 0);
	CHECK_EQ(segment_esc(l.bench->segment, 1)->reg[ESC_REG_RX_ERROR_COUNTER], 1);
	CHECK_EQ(segment_esc(l.bench->segment, 2)->reg[ESC_REG_FORWARDED_RX_ERROR], 1);
	close_line(&l);
}

TEST(fault_actions, a_slave_that_was_reset_has_lost_its_address_and_no_link)
{
	struct line l = open_line();
	struct esc *esc = segment_esc(l.bench->segment, 1);
	uint16_t wkc = 0;

	CHECK_EQ(get_le16(esc->reg + ESC_REG_STATION_ADDRESS), BENCH_STATION + 1);
	plan(&l, "frame=2 reset slave=1");
	send_one(&l, 1);
	CHECK_EQ(receive_one(&l, &wkc), 1);
	send_one(&l, 2);
	CHECK_EQ(receive_one(&l, &wkc), 2);
	CHECK_EQ(wkc, 3);
	CHECK_EQ(get_le16(esc->reg + ESC_REG_STATION_ADDRESS), 0);
	CHECK_EQ(esc_eeprom_loaded(esc), 0);
	CHECK_EQ(segment_esc(l.bench->segment, 2)->reg[ESC_REG_LOST_LINK_COUNTER], 0);
	close_line(&l);
}

TEST(fault_actions, a_cable_cut_at_the_master_is_no_link)
{
	struct line l = open_line();
	uint16_t wkc = 0;

	CHECK_EQ(l.wire.is_up(l.wire.ctx), 1);
	plan(&l, "frame=1 cut slave=0");
	send_one(&l, 1);
	CHECK_EQ(receive_one(&l, &wkc), -1);
	CHECK_EQ(l.wire.is_up(l.wire.ctx), 0);
	close_line(&l);
}

TEST(fault_actions, what_has_happened_makes_room_in_a_full_plan)
{
	struct line l = open_line();
	char error[128];
	uint16_t wkc = 0;
	int added = 0;

	while (fault_plan_add(l.plan, "at=0s lose", 3, error, sizeof(error)) == 0) {
		added++;
	}
	CHECK(added > 100);
	CHECK(strstr(error, "FAULTS_MAX") != NULL);
	send_one(&l, 1); /* all of them */
	CHECK_EQ(receive_one(&l, &wkc), -1);
	CHECK_EQ(fault_plan_add(l.plan, "at=0s lose", 3, error, sizeof(error)), 0);
	send_one(&l, 2);
	CHECK_EQ(receive_one(&l, &wkc), -1);
	send_one(&l, 3);
	CHECK_EQ(receive_one(&l, &wkc), 3);
	close_line(&l);
}

/* --- devices that come and go, slow and unwilling ones --- */

/* Station address at each position of the line; how many there are. */
static unsigned read_line(struct bench *b, uint16_t *address)
{
	unsigned count = 0;

	while (count < 3) {
		uint8_t word[2] = { 0 };

		if (bench_send(b, ECAT_CMD_APRD, (uint16_t)-count, ESC_REG_STATION_ADDRESS, word,
			       2) == 0) {
			break;
		}
		address[count++] = get_le16(word);
	}
	return count;
}

static void apply(struct line *l, const char *text)
{
	fault_plan_restart(l->plan, l->bench->now_ns);
	plan(l, text);
	fault_plan_judge(l->plan, l->bench->segment, l->bench->now_ns, 60);
}

TEST(sim_fault, an_unplugged_slave_leaves_the_others_connected_and_returns_with_any_address)
{
	for (unsigned slave = 0; slave < 3; slave++) {
		struct line l = open_line();
		uint16_t address[3] = { 0 };
		char text[64];

		snprintf(text, sizeof(text), "at=0s unplug slave=%u", slave);
		apply(&l, text);
		CHECK_EQ(read_line(l.bench, address), 2);
		CHECK_EQ(address[0], BENCH_STATION + (slave == 0));
		CHECK_EQ(address[1], BENCH_STATION + 1 + (slave <= 1));
		snprintf(text, sizeof(text), "at=0s plug slave=%u address=0x1234", slave);
		apply(&l, text);
		CHECK_EQ(read_line(l.bench, address), 3);
		for (unsigned i = 0; i < 3; i++) {
			CHECK_EQ(address[i], i == slave ? 0x1234 : BENCH_STATION + i);
		}
		close_line(&l);
	}
}

TEST(sim_fault, the_only_slave_and_one_that_is_not_plugged_out_stay_as_they_are)
{
	struct line l = open_line();

	CHECK_EQ(segment_plug(l.bench->segment, 1, l.bench->now_ns), -EINVAL);
	CHECK_EQ(segment_unplug(l.bench->segment, 1, l.bench->now_ns), 0);
	CHECK_EQ(segment_unplug(l.bench->segment, 1, l.bench->now_ns), -EINVAL);
	CHECK_EQ(segment_plug(l.bench->segment, 1, l.bench->now_ns), 0);
	close_line(&l);
}

static uint8_t al_status(struct line *l)
{
	return bench_read8(l->bench, BENCH_STATION, ESC_REG_AL_STATUS);
}

static void write_al_status(struct line *l, uint8_t state)
{
	esc_pdi_write(segment_esc(l->bench->segment, 0), l->bench->now_ns, ESC_REG_AL_STATUS,
		      &state, 1);
}

TEST(sim_fault, a_slow_slave_shows_its_state_later_even_if_it_is_asked_again)
{
	struct line l = open_line();

	apply(&l, "at=0s slow slave=0 state=preop by=50ms");
	write_al_status(&l, 2);
	l.bench->now_ns += 30 * MS;
	CHECK_EQ(al_status(&l), 1);
	write_al_status(&l, 2);
	l.bench->now_ns += 19 * MS;
	CHECK_EQ(al_status(&l), 1);
	l.bench->now_ns += 2 * MS;
	CHECK_EQ(al_status(&l), 2);
	close_line(&l);
}

TEST(sim_fault, an_unwilling_slave_refuses_one_state_until_it_obeys)
{
	struct line l = open_line();
	const uint8_t code[2] = { 0 };

	apply(&l, "at=0s refuse slave=0 state=preop code=0x0018");
	write_al_status(&l, 2);
	esc_pdi_write(segment_esc(l.bench->segment, 0), l.bench->now_ns, ESC_REG_AL_STATUS_CODE,
		      code, 2);
	CHECK_EQ(al_status(&l), 0x11);
	CHECK_EQ(bench_read8(l.bench, BENCH_STATION, ESC_REG_AL_STATUS_CODE), 0x18);
	apply(&l, "at=0s obey slave=0");
	write_al_status(&l, 2);
	CHECK_EQ(al_status(&l), 2);
	close_line(&l);
}
