/* SPDX-License-Identifier: MIT */
/* Slaves that go and come back while the bus is in OP. */
#include <errno.h>

#include "base/bytes.h"
#include "harness/test.h"
#include "sim/bus/bus_bench.h"
#include "wire/al.h"
#include "wire/esc_reg.h"

/* At most so many cycles back to OP: two to three times what was measured. */
enum { POWER_CYCLES = 2500, CABLE_CYCLES = 400, STATE_CYCLES = 200 };

/* System times of two slaves at one true time. */
static int64_t apart_ns(const struct bus_bench *b, size_t a, size_t c)
{
	int64_t t_ns = bench_now_ns(b);

	return llabs((int64_t)(esc_system_time(segment_esc(b->segment, a), t_ns) -
			       esc_system_time(segment_esc(b->segment, c), t_ns)));
}

static void check_counts_again(struct bus_bench *b, unsigned slave)
{
	uint64_t before;
	char name[64];

	snprintf(name, sizeof(name), "piccolo%u.counter", slave);
	bench_run(b, 10);
	before = bench_value(b, name);
	bench_run(b, 100);
	CHECK_EQ((uint16_t)(bench_value(b, name) - before), 100);
}

static void watch_for(struct bus_bench *b, unsigned looks)
{
	for (unsigned i = 0; i < looks; i++) {
		bench_run(b, 50);
		bench_watch(b);
	}
}

static void power_cycle(unsigned slaves, unsigned victim, uint64_t seed)
{
	struct bus_bench *b = bench_create(
		&(struct bench_spec){ .piccolos = slaves, .ppm = { 80, -60, 40 }, .seed = seed });
	unsigned cycles;

	bench_bring_up(b);
	bench_run(b, 100);
	segment_power_off(b->segment, victim, bench_now_ns(b));
	watch_for(b, 10);
	CHECK(b->events[EVENT_SLAVE_LOST] >= slaves - victim);
	CHECK_EQ(atomic_load(&b->page->slave[victim].is_lost), 1);
	CHECK_EQ(bench_watch(b).slaves_lost, slaves - victim);
	segment_power_on(b->segment, victim, bench_now_ns(b));
	cycles = bench_recover(b, POWER_CYCLES);
	printf("slave %u of %u: in OP again after %u cycles\n", victim, slaves, cycles);
	CHECK_EQ(atomic_load(&b->page->slave[victim].is_lost), 0);
	bench_run(b, 200);
	CHECK_EQ(b->last.status, EXCHANGE_OK);
	CHECK(b->last.dc_time_ns > 0);
	for (unsigned i = 0; i < slaves; i++) {
		check_counts_again(b, i);
		CHECK(apart_ns(b, i, 0) < 100);
	}
	bench_destroy(b);
}

/* T18 */
TEST(recovery, last_slave_is_power_cycled)
{
	power_cycle(2, 1, 70);
}

TEST(recovery, slave_in_the_middle_is_power_cycled)
{
	power_cycle(3, 1, 71);
}

/* T17, T18: everything behind is lost with it; the clocks run on freely. */
TEST(recovery, reference_clock_is_power_cycled)
{
	power_cycle(3, 0, 72);
}

TEST(recovery, only_slave_is_power_cycled)
{
	power_cycle(1, 0, 73);
}

/* T33 */
static void cut_and_heal(unsigned slaves, unsigned at, unsigned away_looks, uint64_t seed)
{
	struct bus_bench *b = bench_create(
		&(struct bench_spec){ .piccolos = slaves, .ppm = { 80, -60, 40 }, .seed = seed });

	bench_bring_up(b);
	bench_run(b, 100);
	segment_cut(b->segment, at, bench_now_ns(b));
	watch_for(b, away_looks);
	CHECK(b->events[EVENT_SLAVE_LOST] > 0);
	segment_heal(b->segment, at, bench_now_ns(b));
	printf("cut at %u: in OP again after %u cycles\n", at, bench_recover(b, CABLE_CYCLES));
	bench_run(b, 200);
	CHECK_EQ(b->last.status, EXCHANGE_OK);
	for (unsigned i = 0; i < slaves; i++) {
		check_counts_again(b, i);
		CHECK(apart_ns(b, i, 0) < 100);
	}
	bench_destroy(b);
}

TEST(recovery, cable_is_pulled_and_put_back_at_every_position)
{
	for (unsigned at = 0; at < 3; at++) {
		for (unsigned looks = 3; looks <= 43; looks += 10) {
			cut_and_heal(3, at, looks, 80 + at * 10 + looks);
		}
	}
}

/* T17: what is cut off keeps its time; the master does not write it. */
TEST(recovery, clocks_behind_a_lost_reference_do_not_jump)
{
	struct bus_bench *b = bench_create(
		&(struct bench_spec){ .piccolos = 3, .ppm = { 50, -50, 20 }, .seed = 90 });
	int64_t rate_ns;
	int64_t before_ns;
	int64_t t_ns;

	bench_bring_up(b);
	bench_run(b, 500);
	t_ns = bench_now_ns(b);
	before_ns = (int64_t)esc_system_time(segment_esc(b->segment, 2), t_ns);
	/* The reference's processing unit stops, its ports still forward: only 0x0910 is dead. */
	bench_mute_reference(b, 1);
	bench_run(b, 1000);
	CHECK_EQ(b->last.dc_time_ns, 0);
	rate_ns = (int64_t)esc_system_time(segment_esc(b->segment, 2), bench_now_ns(b)) -
		  before_ns - (bench_now_ns(b) - t_ns);
	CHECK(llabs(rate_ns) < 120000);
	bench_mute_reference(b, 0);
	bench_run(b, 2000);
	CHECK(b->last.dc_time_ns > 0);
	CHECK(apart_ns(b, 2, 0) < 100);
	bench_destroy(b);
}

TEST(recovery, slave_that_falls_to_safe_op_returns_to_op_and_is_reported)
{
	struct bus_bench *b = bench_create(&(struct bench_spec){ .piccolos = 2, .seed = 91 });

	bench_bring_up(b);
	bench_run(b, 100);
	bench_watch(b);
	bench_fault(b, "at=1ms al-error slave=1 code=0x001a");
	bench_run(b, 20);
	CHECK_EQ(bench_watch(b).is_all_op, 0);
	CHECK(b->events[EVENT_SLAVE_STATE] > 0);
	CHECK_EQ(b->last_event[EVENT_SLAVE_STATE].slave_pos, 1);
	bench_recover(b, STATE_CYCLES);
	check_counts_again(b, 1);
	CHECK_EQ(b->events[EVENT_SLAVE_LOST], 0);
	bench_destroy(b);
}

TEST(recovery, slave_whose_watchdog_tripped_returns_to_op)
{
	struct bus_bench *b = bench_create(&(struct bench_spec){ .piccolos = 2, .seed = 92 });

	bench_bring_up(b);
	bench_run(b, 100);
	in_process_stall(b->host, 300 * NS_PER_MS);
	b->deadline.ns += 300 * NS_PER_MS;
	bench_run(b, 20);
	CHECK(bench_watch(b).slaves_op < 2);
	bench_recover(b, STATE_CYCLES);
	check_counts_again(b, 0);
	check_counts_again(b, 1);
	bench_destroy(b);
}

TEST(recovery, another_slave_in_the_place_is_not_taken)
{
	struct bus_bench *b = bench_create(&(struct bench_spec){ .piccolos = 2, .seed = 93 });
	struct esc *esc;

	bench_bring_up(b);
	segment_power_off(b->segment, 1, bench_now_ns(b));
	watch_for(b, 5);
	esc = segment_esc(b->segment, 1);
	put_le32(esc->sii + 0x14, 0x12345678);
	segment_power_on(b->segment, 1, bench_now_ns(b));
	watch_for(b, 80);
	CHECK_EQ(bench_watch(b).slaves_lost, 1);
	CHECK_EQ(bench_watch(b).slaves_op, 1);
	bench_destroy(b);
}

/* Passes of the service thread for @cycles, without a poll. Each frame that it waits for takes a
 * cycle: how many of the passes had one; none has more. */
static unsigned passes_with_a_frame(struct bus_bench *b, unsigned cycles)
{
	unsigned count = 0;

	for (uint64_t end = b->cycles + cycles; b->cycles < end;) {
		uint64_t begun = b->cycles;

		bench_run(b, 1);
		CHECK(b->cycles - begun <= 2);
		count += b->cycles - begun == 2;
	}
	return count;
}

/* Its EEPROM is read by time, and the rest of the bus is supervised meanwhile. */
TEST(recovery, a_returned_slave_with_a_slow_eeprom_is_identified_by_one_frame_a_call)
{
	enum {
		LOOK_CYCLES = 6, /* states, walk, address, counters, reference clock, recovery */
		READ_FRAMES = 7, /* owner of the EEPROM; three commands and their answers */
	};
	struct bus_bench *b = bench_create(&(struct bench_spec){ .piccolos = 2, .seed = 99 });
	struct bus_watch_report report = { 0 };
	uint64_t longest = 0;
	unsigned frames = 0;

	bench_bring_up(b);
	segment_power_off(b->segment, 1, bench_now_ns(b));
	watch_for(b, 5);
	CHECK_EQ(bench_watch(b).slaves_lost, 1);
	segment_esc(b->segment, 1)->eeprom_slow_ns = 40 * NS_PER_MS;
	segment_power_on(b->segment, 1, bench_now_ns(b));
	for (unsigned look = 0; look < 40 && b->events[EVENT_SLAVE_BACK] == 0; look++) {
		uint64_t begun;

		frames += passes_with_a_frame(b, 50);
		begun = b->cycles;
		report = bench_watch(b);
		longest = b->cycles - begun > longest ? b->cycles - begun : longest;
		CHECK_EQ(report.slaves_op, 1);
	}
	printf("longest poll: %u frames; EEPROM: %u frames, one a call\n", (unsigned)longest,
	       frames);
	CHECK_EQ(b->events[EVENT_SLAVE_BACK], 1);
	CHECK_EQ(b->events[EVENT_SLAVE_UNREADABLE], 0);
	CHECK(longest > 0);
	CHECK(longest <= LOOK_CYCLES);
	CHECK(frames >= READ_FRAMES);
	bench_destroy(b);
}

/* Two slaves of one type without power: whichever comes back first is the first of them. */
TEST(recovery, two_lost_slaves_of_one_type_are_not_exchanged)
{
	for (unsigned looks = 5; looks < 9; looks++) {
		struct bus_bench *b =
			bench_create(&(struct bench_spec){ .piccolos = 3, .seed = 110 + looks });
		const struct slave_info *first;
		size_t count;

		bench_bring_up(b);
		bench_run(b, 100);
		segment_power_off(b->segment, 1, bench_now_ns(b));
		segment_power_off(b->segment, 2, bench_now_ns(b));
		watch_for(b, looks);
		CHECK_EQ(bench_watch(b).slaves_lost, 2);
		first = bus_slaves(b->bus, &count);
		segment_power_on(b->segment, 1, bench_now_ns(b));
		for (unsigned look = 0; look < 40; look++) {
			uint16_t address;

			watch_for(b, 1);
			address =
				get_le16(segment_esc(b->segment, 1)->reg + ESC_REG_STATION_ADDRESS);
			CHECK(address != first[0].station_addr);
			CHECK(address != first[2].station_addr);
		}
		CHECK_EQ(bench_watch(b).slaves_lost, 1);
		CHECK_EQ(atomic_load(&b->page->slave[2].is_lost), 1);
		segment_power_on(b->segment, 2, bench_now_ns(b));
		bench_recover(b, POWER_CYCLES);
		check_counts_again(b, 1);
		check_counts_again(b, 2);
		bench_destroy(b);
	}
}

/* Half of an answer is none: a clock set by a time of 0 would be off by decades. */
TEST(recovery, no_offset_is_written_while_the_guiding_clock_does_not_answer)
{
	struct bus_bench *b = bench_create(
		&(struct bench_spec){ .piccolos = 3, .ppm = { 50, -50, 20 }, .seed = 120 });
	struct esc *esc;

	bench_bring_up(b);
	bench_run(b, 100);
	segment_power_off(b->segment, 2, bench_now_ns(b));
	watch_for(b, 10);
	bench_mute_reference(b, 1);
	segment_power_on(b->segment, 2, bench_now_ns(b));
	esc = segment_esc(b->segment, 2);
	for (unsigned look = 0; look < 40; look++) {
		watch_for(b, 1);
		CHECK_EQ(get_le64(esc->reg + ESC_REG_DC_SYSTEM_TIME_OFFSET), 0);
	}
	/* It was led as far as its clock. */
	CHECK_EQ(get_le16(esc->reg + ESC_REG_AL_STATUS) & 0x0f, AL_PREOP);
	bench_mute_reference(b, 0);
	bench_recover(b, POWER_CYCLES);
	CHECK(apart_ns(b, 2, 0) < 100);
	bench_destroy(b);
}

TEST(recovery, error_counters_reach_the_status_page)
{
	struct bus_bench *b = bench_create(&(struct bench_spec){ .piccolos = 2, .seed = 94 });

	bench_bring_up(b);
	for (unsigned i = 0; i < 3; i++) {
		bench_fault(b, "at=1ms port-error slave=1 port=0");
		bench_run(b, 5);
	}
	bench_watch(b);
	CHECK_EQ(atomic_load(&b->page->slave[1].rx_errors[0]), 3);
	CHECK_EQ(atomic_load(&b->page->slave[0].rx_errors[0]), 0);
	CHECK_EQ(atomic_load(&b->page->slave[1].al_state), AL_OP);
	CHECK(atomic_load(&b->page->slave[1].dc_diff_ns) < 100);
	bench_destroy(b);
}

static void count(struct bus_bench *b, enum esc_error error, unsigned port, unsigned times)
{
	for (unsigned i = 0; i < times; i++) {
		esc_count_error(segment_esc(b->segment, 1), port, error);
	}
	bench_watch(b);
}

TEST(recovery, error_counters_are_summed_beyond_what_the_chip_can_count)
{
	struct bus_bench *b = bench_create(&(struct bench_spec){ .piccolos = 2, .seed = 98 });
	const struct slave_status *page = &b->page->slave[1];
	uint64_t ok;

	bench_bring_up(b);
	bench_watch(b);
	ok = b->cycles - b->ok;
	for (unsigned i = 0; i < 10; i++) {
		count(b, ESC_ERROR_RX, 0, 100);
		count(b, ESC_ERROR_INVALID_FRAME, 0, 20);
		count(b, ESC_ERROR_FORWARDED, 1, 90);
		count(b, ESC_ERROR_UNIT, 0, 50);
		count(b, ESC_ERROR_LOST_LINK, 3, 127);
	}
	CHECK_EQ(atomic_load(&page->rx_errors[0]), 1200);
	CHECK_EQ(atomic_load(&page->forwarded_errors[1]), 900);
	CHECK_EQ(atomic_load(&page->processing_errors), 500);
	CHECK_EQ(atomic_load(&page->lost_links[3]), 1270);
	CHECK_EQ(atomic_load(&page->are_errors_short), 0);
	CHECK_EQ(atomic_load(&b->page->slave[0].rx_errors[0]), 0);
	count(b, ESC_ERROR_RX, 0, 1000);
	CHECK_EQ(atomic_load(&page->rx_errors[0]), 1200 + 255);
	CHECK_EQ(atomic_load(&page->are_errors_short), 1);
	count(b, ESC_ERROR_RX, 0, 7);
	CHECK_EQ(atomic_load(&page->rx_errors[0]), 1200 + 255 + 7);
	CHECK_EQ(b->cycles - b->ok, ok);
	bench_destroy(b);
}

TEST(recovery, error_sums_outlive_a_power_cycle_of_their_slave)
{
	struct bus_bench *b = bench_create(&(struct bench_spec){ .piccolos = 2, .seed = 99 });
	const struct slave_status *page = &b->page->slave[1];

	bench_bring_up(b);
	count(b, ESC_ERROR_RX, 0, 5);
	segment_power_off(b->segment, 1, bench_now_ns(b));
	watch_for(b, 5);
	segment_power_on(b->segment, 1, bench_now_ns(b));
	bench_recover(b, POWER_CYCLES);
	CHECK_EQ(atomic_load(&page->rx_errors[0]), 5);
	count(b, ESC_ERROR_RX, 0, 6);
	CHECK_EQ(atomic_load(&page->rx_errors[0]), 11);
	bench_destroy(b);
}

TEST(recovery, watching_costs_no_cycle)
{
	struct bus_bench *b = bench_create(&(struct bench_spec){ .piccolos = 8, .seed = 95 });
	uint64_t cycles;
	uint64_t ok;

	bench_bring_up(b);
	bench_run(b, 100);
	cycles = b->cycles;
	ok = b->ok;
	watch_for(b, 50);
	CHECK_EQ(b->ok - ok, b->cycles - cycles);
	bench_destroy(b);
}

/* AL states, counters of some, the reference's time: one frame each, however many slaves. */
TEST(recovery, one_poll_of_sixty_four_slaves_takes_three_frames)
{
	struct bus_bench *b = bench_create(&(struct bench_spec){ .piccolos = 64, .seed = 96 });

	bench_bring_up(b);
	bench_run(b, 100);
	bench_watch(b);
	for (unsigned poll = 0; poll < 10; poll++) {
		uint64_t cycles = b->cycles;
		unsigned frames = bench_frames_sent(b);
		unsigned service;

		CHECK_EQ(bench_watch(b).slaves_op, 64);
		service = bench_frames_sent(b) - frames - (unsigned)(b->cycles - cycles);
		CHECK_EQ(service, 3);
	}
	bench_destroy(b);
}

TEST(recovery, slave_that_missed_one_poll_is_neither_lost_nor_in_op)
{
	struct bus_bench *b = bench_create(&(struct bench_spec){ .piccolos = 2, .seed = 96 });
	struct bus_watch_report report;

	bench_bring_up(b);
	segment_cut(b->segment, 1, bench_now_ns(b));
	report = bench_watch(b);
	CHECK_EQ(report.slaves_op, 1);
	CHECK_EQ(report.slaves_lost, 0);
	CHECK_EQ(report.is_all_op, 0);
	bench_destroy(b);
}

TEST(recovery, stop_on_a_dead_line_ends_soon_with_an_error)
{
	struct bus_bench *b = bench_create(&(struct bench_spec){ .piccolos = 8, .seed = 97 });
	int64_t begun_ns;

	bench_bring_up(b);
	segment_cut(b->segment, 0, bench_now_ns(b));
	bench_run(b, 10);
	begun_ns = bench_now_ns(b);
	CHECK_EQ(bench_stop(b), -EIO);
	CHECK(strstr(b->error, "no frame returns") != NULL);
	CHECK(bench_now_ns(b) - begun_ns < NS_PER_S);
	bench_destroy(b);
}
