/* SPDX-License-Identifier: MIT */
#include "base/slave_place.h"

#include "harness/test.h"

TEST(slave_place, what_is_packed_is_unpacked)
{
	for (int parent = -1; parent < 511; parent += 64) {
		for (unsigned port = 0; port < SLAVE_PORTS; port++) {
			const struct slave_place place = {
				.is_known = 1,
				.parent = parent,
				.parent_port = port,
				.entry_port = 3 - port,
				.open_ports = 0xf & ~(1u << port),
			};
			struct slave_place found =
				slave_place_unpack(slave_place_pack(&place), 511);

			CHECK_EQ(found.is_known, 1);
			CHECK_EQ(found.parent, parent);
			CHECK_EQ(found.parent_port, port);
			CHECK_EQ(found.entry_port, 3 - port);
			CHECK_EQ(found.open_ports, place.open_ports);
		}
	}
}

TEST(slave_place, zero_is_not_known)
{
	const struct slave_place none = { .is_known = 0, .parent = 3 };

	CHECK_EQ(slave_place_pack(&none), 0);
	CHECK_EQ(slave_place_unpack(0, 5).is_known, 0);
	CHECK_EQ(slave_place_unpack(0, 5).parent, -1);
}

/* Foreign bytes: a loop would never end in a reader. */
TEST(slave_place, a_parent_that_does_not_come_before_is_not_believed)
{
	const struct slave_place place = { .is_known = 1, .parent = 7 };

	CHECK_EQ(slave_place_unpack(slave_place_pack(&place), 8).is_known, 1);
	CHECK_EQ(slave_place_unpack(slave_place_pack(&place), 7).is_known, 0);
	CHECK_EQ(slave_place_unpack(UINT32_MAX, 511).is_known, 0);
	CHECK_EQ(slave_place_unpack(UINT32_MAX, 511).parent, -1);
}
