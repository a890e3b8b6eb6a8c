/* SPDX-License-Identifier: MIT */
/*
 * One slave of a bus that is kept below OP, before it is asked for SAFE-OP or OP: its start-up
 * SDOs, and for SAFE-OP its SyncManagers and FMMUs. A bus that was led to SAFE-OP has them. In one
 * that was not, the SyncManagers of this slave are made from what it maps, without a place in a
 * process image; those of the others stay as they are, and no SYNC0 runs.
 */
#include "bus/bus_internal.h"
#include "wire/al.h"

/* bus_map() has run to its end. */
static int is_mapped(const struct bus *bus)
{
	return bus->plan.slave_count > 0;
}

int bus_slave_set_up(struct bus *bus, size_t pos, uint16_t state, char *error)
{
	enum config_transition transition =
		state == AL_SAFEOP ? CONFIG_TRANSITION_PS : CONFIG_TRANSITION_SO;
	const struct bus_startup *su = &bus->slave[pos].startup;
	int r = 0;

	bus->error = error;
	if (state == AL_SAFEOP && !is_mapped(bus) &&
	    (su->state == STARTUP_IDLE || su->transition != transition)) {
		r = bus_pdos_plan(bus, pos, pos + 1);
	}
	r = r < 0 ? r : bus_startup_poll(bus, pos, transition);
	if (r != 0 || state != AL_SAFEOP) {
		return r;
	}
	return is_mapped(bus) ? bus_restore_mapping(bus, pos) : bus_map_one(bus, pos);
}
