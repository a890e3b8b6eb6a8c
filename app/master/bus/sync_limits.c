/* SPDX-License-Identifier: MIT */
/*
 * How a slave synchronises, and how fast it can (ETG.1020, objects 0x1C32 and 0x1C33): a cycle
 * below its minimum is refused at bring-up, not by AL status or silently counted misses in OP
 * (T11, T37).
 */
#include <errno.h>
#include <inttypes.h>

#include "bus/bus_internal.h"

enum {
	OBJECT_OUTPUT_SYNC = 0x1c32,
	OBJECT_INPUT_SYNC = 0x1c33,
	SUBINDEX_TYPE = 1,
	SUBINDEX_MINIMUM_CYCLE = 5,
	TYPE_FREE_RUN = 0,
	ACTIVATION_SYNC0 = 0x02,
};

/* A value, or 0 where the slave has no such object. 0 or -errno with a line. */
static int read_value(struct bus *bus, size_t pos, uint16_t index, uint8_t subindex,
		      uint64_t *ret_value)
{
	uint32_t abort;
	int r = bus_sdo_value(bus, pos, index, subindex, ret_value, &abort);

	if (r == -EREMOTEIO || r == -EMSGSIZE) {
		*ret_value = 0;
		return 0;
	}
	if (r < 0) {
		return bus_fail_slave(bus, pos, r, "no answer for 0x%04x:%02x", index, subindex);
	}
	return 0;
}

/* A free-running slave takes the newest data: the bus cannot be too fast for it. */
static int is_synchronised(const struct bus_slave *sl, uint64_t type)
{
	return type != TYPE_FREE_RUN || (sl->assign_activate >> 8 & ACTIVATION_SYNC0) != 0;
}

static int check_object(struct bus *bus, size_t pos, uint16_t index, struct sync_limits *limits)
{
	uint64_t type = 0;
	uint64_t minimum_ns = 0;
	int r = read_value(bus, pos, index, SUBINDEX_TYPE, &type);

	if (r >= 0) {
		r = read_value(bus, pos, index, SUBINDEX_MINIMUM_CYCLE, &minimum_ns);
	}
	if (r < 0) {
		return r;
	}
	*limits = (struct sync_limits){ .type = (uint16_t)type,
					.minimum_cycle_ns = (uint32_t)minimum_ns };
	if (is_synchronised(&bus->slave[pos], type) &&
	    (int64_t)limits->minimum_cycle_ns > bus->cfg->cycle_period_ns) {
		return bus_fail_slave(bus, pos, -EPROTO,
				      "cycle.period %" PRId64 " ns is below the slave's minimum of "
				      "%" PRIu32 " ns (0x%04x:05): set cycle.period to %" PRIu32
				      "us or more",
				      bus->cfg->cycle_period_ns, limits->minimum_cycle_ns, index,
				      (limits->minimum_cycle_ns + 999) / 1000);
	}
	return 0;
}

int bus_sync_limits(struct bus *bus, size_t pos)
{
	const ec_slavet *soem = &bus->soem_slave[soem_index(pos)];
	struct bus_slave *sl = &bus->slave[pos];
	int r = 0;

	if (!bus_has_coe(bus, pos)) {
		return 0;
	}
	if (soem->Obits > 0) {
		r = check_object(bus, pos, OBJECT_OUTPUT_SYNC, &sl->output_sync);
	}
	if (r >= 0 && soem->Ibits > 0) {
		r = check_object(bus, pos, OBJECT_INPUT_SYNC, &sl->input_sync);
	}
	return r;
}
