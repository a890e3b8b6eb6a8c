/* SPDX-License-Identifier: MIT */
/* One clock: write its offset; read the reference; set a clock that was lost by one that runs. */
#include <errno.h>

#include "base/bytes.h"
#include "bus/bus_internal.h"
#include "bus/registers.h"

int bus_clock_write(struct bus *bus, size_t pos, int64_t offset_ns)
{
	struct bus_slave *sl = &bus->slave[pos];
	uint8_t offset[8];
	uint8_t delay[4];
	uint8_t start[2];
	const uint8_t filters[2] = { CLOCK_TIME_FILTER, CLOCK_SPEED_FILTER };
	int r;

	put_le64(offset, (uint64_t)offset_ns);
	put_le32(delay, (int)pos == bus->reference ? 0 : (uint32_t)sl->clock.delay_ns);
	put_le16(start, CLOCK_SPEED_COUNTER_START);
	r = register_write(bus, pos, ESC_REG_DC_SYSTEM_TIME_OFFSET, offset,
			   sl->is_clock_64bit ? 8 : 4);
	if (r >= 0) {
		r = register_write(bus, pos, ESC_REG_DC_SYSTEM_TIME_DELAY, delay, sizeof(delay));
	}
	if (r >= 0) {
		r = register_write(bus, pos, ESC_REG_DC_TIME_FILTER, filters, sizeof(filters));
	}
	if (r >= 0) {
		r = register_write(bus, pos, ESC_REG_DC_SPEED_COUNTER_START, start, sizeof(start));
	}
	sl->is_clock_set = r >= 0;
	sl->clock_offset_ns = offset_ns;
	return r;
}

int bus_reference_time(struct bus *bus, int64_t *ret_ns)
{
	uint8_t time[8];
	mono_t at = bus_now(bus);
	int r = register_read(bus, (size_t)bus->reference, ESC_REG_DC_SYSTEM_TIME, time,
			      sizeof(time));

	if (r < 0) {
		return r;
	}
	/* While riding, the frame left up to a cycle later; good enough to keep an outage of the
	 * reference. */
	bus->reference_at = at;
	bus->reference_ns = (int64_t)get_le64(time);
	*ret_ns = bus->reference_ns;
	return 0;
}

static int is_guide(const struct bus *bus, size_t pos)
{
	const struct bus_slave *sl = &bus->slave[pos];

	return sl->clock.kind == CLOCK_SYSTEM_TIME && sl->is_clock_64bit && sl->is_clock_set &&
	       !sl->is_lost && sl->misses == 0;
}

/* A living clock other than @pos to set it by: the reference, else any that kept its time. -1:
 * none. */
static int find_guide(const struct bus *bus, size_t pos)
{
	if ((size_t)bus->reference != pos && is_guide(bus, (size_t)bus->reference)) {
		return bus->reference;
	}
	for (size_t i = 0; i < bus->slave_count; i++) {
		if (i != pos && is_guide(bus, i)) {
			return (int)i;
		}
	}
	return -1;
}

/* One frame reads both clocks; the second is passed later by the difference of the delays. */
static int read_pair(struct bus *bus, size_t guide, size_t pos, int64_t *ret_guide_ns,
		     int64_t *ret_ns)
{
	uint8_t time[2][8] = { { 0 } };
	struct access access[2];

	for (int i = 0; i < 2; i++) {
		const struct bus_slave *sl = &bus->slave[i == 0 ? guide : pos];

		access[i] = (struct access){ .cmd = ECAT_CMD_FPRD,
					     .adp = sl->info.station_addr,
					     .reg = ESC_REG_DC_SYSTEM_TIME,
					     .len = sl->is_clock_64bit ? 8 : 4,
					     .data = time[i] };
	}
	if (registers_run(bus, access, 2) < 0 || access[0].wkc != 1 || access[1].wkc != 1) {
		return -EIO;
	}
	*ret_guide_ns = (int64_t)get_le64(time[0]) - bus->slave[guide].clock.delay_ns;
	*ret_ns = (int64_t)get_le64(time[1]);
	return 0;
}

int bus_clock_restore(struct bus *bus, size_t pos)
{
	struct bus_slave *sl = &bus->slave[pos];
	static const uint8_t zero[8];
	int guide = find_guide(bus, pos);
	int64_t guide_ns;
	int64_t local_ns;
	int r;

	if (sl->clock.kind != CLOCK_SYSTEM_TIME || bus->plan.dc_reference == 0) {
		return 0;
	}
	r = register_write(bus, pos, ESC_REG_DC_SYSTEM_TIME_OFFSET, zero,
			   sl->is_clock_64bit ? 8 : 4);
	if (r < 0) {
		return r;
	}
	if (guide >= 0) {
		r = read_pair(bus, (size_t)guide, pos, &guide_ns, &local_ns);
	} else {
		uint8_t time[8] = { 0 };

		guide_ns = bus->reference_ns + mono_sub(bus_now(bus), bus->reference_at).ns;
		r = register_read(bus, pos, ESC_REG_DC_SYSTEM_TIME, time,
				  sl->is_clock_64bit ? 8 : 4);
		local_ns = (int64_t)get_le64(time);
	}
	return r < 0 ? r : bus_clock_write(bus, pos, guide_ns + sl->clock.delay_ns - local_ns);
}
