/* SPDX-License-Identifier: MIT */
#include "bus/error_counters.h"

#include "harness/test.h"

TEST(error_counters, deltas_are_summed_and_a_counter_that_went_down_was_cleared)
{
	struct error_counters ec = { 0 };
	const uint8_t values[] = { 3, 3, 10, 2, 2, 127 };

	for (size_t i = 0; i < sizeof(values); i++) {
		CHECK_EQ(error_counters_take(&ec, ERROR_PDI, &values[i], 1), 0);
	}
	CHECK_EQ(ec.sum[ERROR_PDI], 10 + 127);
	CHECK_EQ(ec.sum[ERROR_PROCESSING], 0);
	CHECK_EQ(ec.sum[ERROR_LINKS], 0);
	CHECK_EQ(ec.is_short, 0);
}

TEST(error_counters, a_counter_at_half_range_is_to_be_cleared)
{
	struct error_counters ec = { 0 };
	const uint8_t raw[ERROR_LINK_BYTES] = { 0, 0, 128, 0 };

	CHECK_EQ(error_counters_take(&ec, ERROR_LINKS, raw, sizeof(raw)), 1);
	CHECK_EQ(ec.sum[ERROR_LINKS + 2], 128);
	CHECK_EQ(ec.is_short, 0);
}

TEST(error_counters, a_saturated_counter_is_marked_incomplete)
{
	struct error_counters ec = { 0 };
	struct slave_status page = { 0 };
	uint8_t raw = 255;

	CHECK_EQ(error_counters_take(&ec, 1, &raw, 1), 1);
	raw = 4;
	CHECK_EQ(error_counters_take(&ec, 1, &raw, 1), 0);
	error_counters_show(&ec, &page);
	CHECK_EQ(atomic_load(&page.rx_errors[0]), 259);
	CHECK_EQ(atomic_load(&page.rx_errors[1]), 0);
	CHECK_EQ(atomic_load(&page.are_errors_short), 1);
}

TEST(error_counters, a_slave_without_power_starts_at_zero_and_keeps_its_sum)
{
	struct error_counters ec = { 0 };
	uint8_t raw = 2;

	error_counters_take(&ec, ERROR_FORWARDED, &raw, 1);
	error_counters_restart(&ec);
	raw = 3;
	error_counters_take(&ec, ERROR_FORWARDED, &raw, 1);
	CHECK_EQ(ec.sum[ERROR_FORWARDED], 5);
}
