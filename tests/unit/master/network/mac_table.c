/* SPDX-License-Identifier: MIT */
#include "network/mac_table.h"

#include "harness/test.h"

static const mono_t start = { NS_PER_S };

static void make(uint8_t *mac, unsigned number)
{
	const uint8_t all[MAC_BYTES] = {
		2, 0, 0, (uint8_t)(number >> 16), (uint8_t)(number >> 8), (uint8_t)number
	};

	memcpy(mac, all, MAC_BYTES);
}

TEST(mac_table, an_address_is_found_at_the_port_it_was_last_seen_at)
{
	static struct mac_table table;
	uint8_t mac[MAC_BYTES];

	make(mac, 1);
	CHECK_EQ(mac_table_find(&table, mac, start), MAC_NO_PORT);
	mac_table_learn(&table, mac, 7, start);
	CHECK_EQ(mac_table_find(&table, mac, start), 7);
	mac_table_learn(&table, mac, 9, start);
	CHECK_EQ(mac_table_find(&table, mac, start), 9);
}

TEST(mac_table, an_address_not_seen_for_300_s_is_unknown)
{
	static struct mac_table table;
	uint8_t mac[MAC_BYTES];

	make(mac, 1);
	mac_table_learn(&table, mac, 7, start);
	CHECK_EQ(mac_table_find(&table, mac, mono_add(start, (span_t){ 299 * NS_PER_S })), 7);
	CHECK_EQ(mac_table_find(&table, mac, mono_add(start, (span_t){ 300 * NS_PER_S })),
		 MAC_NO_PORT);
}

TEST(mac_table, group_addresses_are_not_learned)
{
	static struct mac_table table;
	static const uint8_t broadcast[MAC_BYTES] = { 0xff, 0xff, 0xff, 0xff, 0xff, 0xff };
	static const uint8_t multicast[MAC_BYTES] = { 1, 0, 0x5e, 0, 0, 1 };

	mac_table_learn(&table, broadcast, 3, start);
	mac_table_learn(&table, multicast, 3, start);
	CHECK_EQ(mac_table_find(&table, broadcast, start), MAC_NO_PORT);
	CHECK_EQ(mac_table_find(&table, multicast, start), MAC_NO_PORT);
}

TEST(mac_table, a_flood_of_addresses_makes_old_ones_unknown_and_none_wrong)
{
	static struct mac_table table;
	uint8_t mac[MAC_BYTES];
	unsigned known = 0;

	for (unsigned i = 0; i < 100000; i++) {
		make(mac, i);
		mac_table_learn(&table, mac, (uint16_t)(i % 100),
				mono_add(start, (span_t){ (int64_t)i }));
	}
	for (unsigned i = 0; i < 100000; i++) {
		uint16_t port;

		make(mac, i);
		port = mac_table_find(&table, mac, mono_add(start, (span_t){ 100000 }));
		CHECK(port == MAC_NO_PORT || port == i % 100);
		known += port != MAC_NO_PORT;
	}
	CHECK_EQ(known, MAC_BUCKETS * MAC_WAYS);
}
