/* SPDX-License-Identifier: MIT */
/*
 * How a slave synchronises, and how fast it can (ETG.1020, objects 0x1C32 and 0x1C33): a cycle
 * below its minimum is refused at bring-up, not by AL status or silently counted misses in OP
 * (T11, T37). The type is written where the configuration says so, else shown.
 */
#include <errno.h>
#include <inttypes.h>

#include "base/bytes.h"
#include "bus/bus_internal.h"

enum {
	OBJECT_OUTPUT_SYNC = 0x1c32,
	OBJECT_INPUT_SYNC = 0x1c33,
	SUBINDEX_TYPE = 1,
	SUBINDEX_MINIMUM_CYCLE = 5,
	TYPE_FREE_RUN = 0,
	TYPE_SM_EVENT = 1,
	TYPE_SYNC0 = 2,
	TYPE_SYNC1 = 3,
	TYPE_OUTPUT_EVENT = 0x22, /* of inputs: with the event of the outputs' SM */
};

/* A value, or 0 where the slave has no such object. 0; -EAGAIN (bus_read_ahead()); other -errno
 * with a line. */
static int read_object(struct bus *bus, size_t pos, uint16_t index, uint8_t subindex,
		       uint64_t *ret_value, int *ret_has)
{
	uint32_t abort;
	int r = bus_sdo_value(bus, pos, index, subindex, ret_value, &abort);

	*ret_has = r == 0;
	if (r == -EREMOTEIO || r == -EMSGSIZE) {
		*ret_value = 0;
		return 0;
	}
	if (r == -EAGAIN) {
		return r;
	}
	if (r < 0) {
		return bus_fail_slave(bus, pos, r, "no answer for 0x%04x:%02x", index, subindex);
	}
	return 0;
}

static int read_value(struct bus *bus, size_t pos, uint16_t index, uint8_t subindex,
		      uint64_t *ret_value)
{
	int has_object;

	return read_object(bus, pos, index, subindex, ret_value, &has_object);
}

/* A free-running slave takes the newest data: the bus cannot be too fast for it. */
static int is_synchronised(const struct bus_slave *sl, uint64_t type)
{
	return type != TYPE_FREE_RUN || (sl->assign_activate >> 8 & SYNC_ACTIVATE_SYNC0) != 0;
}

/* The type that fits the SYNC signals that the slave will have. */
static uint16_t fitting_type(const struct bus *bus, size_t pos, uint16_t index)
{
	const struct bus_slave *sl = &bus->slave[pos];
	unsigned activation = sl->clock.kind == CLOCK_SYSTEM_TIME ? sl->assign_activate >> 8 : 0;

	if ((activation & SYNC_ACTIVATE_SYNC1) != 0) {
		return TYPE_SYNC1;
	}
	if ((activation & SYNC_ACTIVATE_SYNC0) != 0) {
		return TYPE_SYNC0;
	}
	return index == OBJECT_INPUT_SYNC && bus->soem_slave[soem_index(pos)].Obits > 0
		       ? TYPE_OUTPUT_EVENT
		       : TYPE_SM_EVENT;
}

/* Write the type and read it back into @type. 0 or -errno with a line. */
static int write_type(struct bus *bus, size_t pos, uint16_t index, uint64_t *type)
{
	uint16_t wanted = fitting_type(bus, pos, index);
	uint8_t data[2];
	uint32_t abort = 0;
	int r;

	if (*type == wanted) {
		return 0;
	}
	put_le16(data, wanted);
	r = bus_sdo_write(bus, (uint16_t)pos, index, SUBINDEX_TYPE, data, sizeof(data), &abort);
	if (r < 0) {
		return bus_fail_slave(bus, pos, r,
				      "0x%04x:01 cannot be set to synchronization type %u (abort "
				      "0x%08" PRIx32 "): set slaves[].sync_type to show",
				      index, wanted, abort);
	}
	r = read_value(bus, pos, index, SUBINDEX_TYPE, type);
	if (r < 0) {
		return r;
	}
	if (*type != wanted) {
		return bus_fail_slave(bus, pos, -EPROTO,
				      "0x%04x:01 reads synchronization type %" PRIu64
				      " after %u was written",
				      index, *type, wanted);
	}
	return 0;
}

static int is_type_written(const struct bus *bus, size_t pos)
{
	return pos < bus->cfg->slave_count &&
	       bus->cfg->slave[pos].sync_type == CONFIG_SYNC_TYPE_WRITE;
}

static int check_object(struct bus *bus, size_t pos, uint16_t index, struct sync_limits *limits)
{
	uint64_t type = 0;
	uint64_t minimum_ns = 0;
	int has_object = 0;
	int r = read_object(bus, pos, index, SUBINDEX_TYPE, &type, &has_object);

	if (r >= 0 && has_object && is_type_written(bus, pos)) {
		r = write_type(bus, pos, index, &type);
	}
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
