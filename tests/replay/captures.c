/* SPDX-License-Identifier: MIT */
/*
 * The truth of the simulated segment: a master's half of a capture goes in, what comes out must be
 * what the real slaves answered. Clock values may be apart by the capture's own jitter, and are
 * listed; every other byte and every WKC must agree.
 */
#include "bench.h"
#include "harness/test.h"

/* EEPROM word 0 where no master read it: a coupler or terminal behind SPI, without device
 * emulation. */
enum { PDI_SPI = 0x0005 };

static struct bench b;

TEST(replay, ek1100_el2828_el2889_answer_ethercrab_as_the_real_ones_did)
{
	static const struct bench_slave slaves[] = {
		{ .station = 0x1000, .sii = "ek1100.bin", .processing_ns = 140, .ppm = -26.0 },
		{ .station = 0x1001, .sii = "el2828.bin", .processing_ns = 150, .ppm = 4.0 },
		{ .station = 0x1002, .sii = "el2889.bin", .processing_ns = 150, .ppm = 11.0 },
	};

	bench_replay(&b, "ethercrab-ek1100-el2828-el2889.pcapng", slaves, 3, BENCH_FIRST_MASTER);
	bench_check_round_trip(&b, 0x1000, 1);
	bench_check_round_trip(&b, 0x1001, 1);
	bench_end(&b);
}

TEST(replay, ek1100_answers_soem_as_the_real_one_did)
{
	static const struct bench_slave slave = { .station = 0x1001,
						  .sii = "ek1100.bin",
						  .processing_ns = 140 };

	bench_replay(&b, "soem-ek1100.pcapng", &slave, 1, BENCH_LINK_SEEN);
	bench_end(&b);
}

/* There is no image of an EL1004: its EEPROM is what SOEM read; the rest of the capture tests. */
TEST(replay, ek1100_and_el1004_answer_soem_as_the_real_ones_did)
{
	static const struct bench_slave slaves[] = {
		{ .station = 0x1001, .sii = "ek1100.bin", .processing_ns = 140 },
		{ .station = 0x1002, .processing_ns = 150 },
	};

	bench_replay(&b, "soem-ek1100-el1004.pcapng", slaves, 2, BENCH_FIRST_MASTER);
	bench_check_round_trip(&b, 0x1001, 1);
	bench_end(&b);
}

/* From here on the slaves have firmware, which is played back: what is tested is the chip under it.
 */

TEST(replay, a_lan9252_answers_soem_as_the_real_one_did)
{
	static const struct bench_slave slave = { .station = 0x1001,
						  .has_application = 1,
						  .leftover_ports = 1 << 1,
						  .processing_ns = 150 };

	bench_replay(&b, "soem-single-lan9252.pcapng", &slave, 1, BENCH_EVENT_LET_THROUGH);
	bench_end(&b);
}

TEST(replay, ek1914_and_el3004_answer_ethercrab_as_the_real_ones_did)
{
	static const struct bench_slave slaves[] = {
		{ .station = 0x1000, .pdi = PDI_SPI, .has_application = 1, .processing_ns = 150 },
		{ .station = 0x1001, .pdi = PDI_SPI, .has_application = 1, .processing_ns = 150 },
	};

	bench_replay(&b, "ethercrab-ek1914-el3004-mailbox.pcapng", slaves, 2, BENCH_FIRST_MASTER);
	bench_check_round_trip(&b, 0x1000, 1);
	bench_end(&b);
}

TEST(replay, ek1914_and_el3004_without_complete_access_answer_as_the_real_ones_did)
{
	static const struct bench_slave slaves[] = {
		{ .station = 0x1000, .pdi = PDI_SPI, .has_application = 1, .processing_ns = 150 },
		{ .station = 0x1001, .pdi = PDI_SPI, .has_application = 1, .processing_ns = 150 },
	};

	bench_replay(&b, "ethercrab-ek1914-no-complete-access.pcapng", slaves, 2,
		     BENCH_FIRST_MASTER);
	bench_end(&b);
}

TEST(replay, ek1100_and_el6910_answer_ethercrab_as_the_real_ones_did)
{
	static const struct bench_slave slaves[] = {
		{ .station = 0x1000, .sii = "ek1100.bin", .processing_ns = 140 },
		{ .station = 0x1001, .pdi = PDI_SPI, .has_application = 1, .processing_ns = 150 },
	};

	bench_replay(&b, "ethercrab-el6910-mailbox.pcapng", slaves, 2, BENCH_FIRST_MASTER);
	bench_check_round_trip(&b, 0x1000, 1);
	bench_end(&b);
}

/* --- and that it can fail --- */

/* With a clock whatever the EEPROM says. */
static const struct esc_features *other_chip(void)
{
	static struct esc_features features;

	features = esc_et1100;
	features.is_dc_by_eeprom = 0;
	return &features;
}

TEST(replay, another_chip_in_a_slaves_place_is_found_out)
{
	const struct bench_slave slaves[] = {
		{ .station = 0x1000, .sii = "ek1100.bin", .processing_ns = 140 },
		{ .station = 0x1001,
		  .sii = "el2828.bin",
		  .features = other_chip(),
		  .processing_ns = 150 },
		{ .station = 0x1002, .sii = "el2889.bin", .processing_ns = 150 },
	};

	bench_run(&b, "ethercrab-ek1100-el2828-el2889.pcapng", slaves, 3, BENCH_FIRST_MASTER);
	CHECK(b.result.wkc_differ > 10);
	CHECK(b.result.bytes_unexplained > 0);
	bench_end(&b);
}

TEST(replay, another_eeprom_a_missing_slave_and_a_far_clock_are_found_out)
{
	const struct bench_slave wrong[] = {
		{ .station = 0x1001,
		  .sii = "el1008.bin",
		  .features = other_chip(),
		  .ppm = 900.0,
		  .processing_ns = 140 },
	};
	static const struct bench_slave one[] = {
		{ .station = 0x1001, .sii = "ek1100.bin", .processing_ns = 140 },
	};

	bench_run(&b, "soem-ek1100.pcapng", wrong, 1, BENCH_LINK_SEEN);
	CHECK_EQ(b.result.wkc_differ, 0);
	CHECK(b.result.bytes_unexplained > 20);
	bench_end(&b);
	bench_run(&b, "soem-ek1100-el1004.pcapng", one, 1, BENCH_FIRST_MASTER);
	CHECK(b.result.wkc_differ > 100);
	CHECK(b.result.header_differ > 0);
	bench_end(&b);
}
