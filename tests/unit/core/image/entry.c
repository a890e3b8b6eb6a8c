/* SPDX-License-Identifier: MIT */
#include "image/entry.h"

#include <stdio.h>

#include "harness/test.h"

static struct channel named(const char *name, uint16_t index, uint8_t subindex)
{
	struct channel ch = { .index = index, .subindex = subindex };

	snprintf(ch.name, sizeof(ch.name), "%s", name);
	return ch;
}

TEST(entry, that_of_a_piccolo_is_found_under_any_name)
{
	const struct slave_info slave = { .vendor = PICCOLO_VENDOR, .product = PICCOLO_PRODUCT };
	const struct channel adc = named("front.pressure", 0x6000, 1);
	const struct channel turns = named("front.adc", 0x6000, 2);
	const struct channel oneshot = named("front.fire", 0x7000, 2);

	CHECK(channel_is_entry(&slave, &adc, "adc"));
	CHECK(!channel_is_entry(&slave, &turns, "adc"));
	CHECK(channel_is_entry(&slave, &turns, "counter"));
	CHECK(channel_is_entry(&slave, &oneshot, "oneshot_time"));
	CHECK(channel_is_entry(&slave, &oneshot, "fire"));
}

TEST(entry, that_of_any_other_slave_is_found_by_name)
{
	const struct slave_info slave = { .vendor = PICCOLO_VENDOR, .product = 1 };
	const struct channel adc = named("front.adc", 0x3000, 9);
	const struct channel other = named("front.pressure", 0x6000, 1);

	CHECK(channel_is_entry(&slave, &adc, "adc"));
	CHECK(!channel_is_entry(&slave, &other, "adc"));
	CHECK(!channel_is_entry(&slave, &adc, "front"));
}
