/* SPDX-License-Identifier: MIT */
#include "cli/cable.h"

#include <stdio.h>

#include "cli/source.h"

struct slave_place cable_place(const struct status_page *page, uint32_t pos)
{
	return slave_place_unpack(
		atomic_load_explicit(&page->slave[pos].place, memory_order_relaxed), pos);
}

struct cable_end cable_far_end(const struct status_page *page, uint32_t pos, unsigned port)
{
	struct slave_place place = cable_place(page, pos);

	if (!place.is_known) {
		return (struct cable_end){ .kind = CABLE_END_UNKNOWN };
	}
	if (port == place.entry_port) {
		return place.parent < 0 ? (struct cable_end){ .kind = CABLE_END_MASTER }
					: (struct cable_end){ .kind = CABLE_END_SLAVE,
							      .pos = (uint32_t)place.parent,
							      .port = place.parent_port };
	}
	for (uint32_t i = pos + 1; i < source_slave_count(page); i++) {
		struct slave_place other = cable_place(page, i);

		if (other.is_known && other.parent == (int)pos && other.parent_port == port) {
			return (struct cable_end){ .kind = CABLE_END_SLAVE,
						   .pos = i,
						   .port = other.entry_port };
		}
	}
	return (struct cable_end){ .kind = CABLE_END_NONE };
}

const char *cable_describe(const struct status_page *page, uint32_t pos, unsigned port,
			   char buf[CABLE_TEXT_BYTES])
{
	struct cable_end end = cable_far_end(page, pos, port);
	struct slave_info here = source_slave(page, pos);
	struct slave_info there;

	switch (end.kind) {
	case CABLE_END_UNKNOWN:
	case CABLE_END_NONE:
		break;
	case CABLE_END_MASTER:
		snprintf(buf, CABLE_TEXT_BYTES, "between %.*s and %s: port %u",
			 (int)sizeof(page->interface), page->interface, here.name, port);
		return buf;
	case CABLE_END_SLAVE:
		there = source_slave(page, end.pos);
		if (end.pos < pos) {
			snprintf(buf, CABLE_TEXT_BYTES, "between %s: port %u and %s: port %u",
				 there.name, end.port, here.name, port);
		} else {
			snprintf(buf, CABLE_TEXT_BYTES, "between %s: port %u and %s: port %u",
				 here.name, port, there.name, end.port);
		}
		return buf;
	}
	snprintf(buf, CABLE_TEXT_BYTES, "at %s: port %u", here.name, port);
	return buf;
}
