/* SPDX-License-Identifier: MIT */
#include "bus/places.h"

#include <errno.h>
#include <string.h>

#include "base/bytes.h"
#include "bus/guests.h"
#include "bus/identity.h"

/* For the EEPROM of the reference clock to be read. */
#define REFERENCE_NS (2 * NS_PER_S)

/* --- binding by what was written --- */

/*
 * Does the device at @position hold what this session wrote to slave @pos: the offset of its clock,
 * which no other device has, or, without a clock, its FMMUs? 1, 0, -errno.
 */
static int has_marks_of(struct bus *bus, size_t position, size_t pos)
{
	const struct bus_slave *sl = &bus->slave[pos];
	const ec_slavet *soem = &bus->soem_slave[soem_index(pos)];
	uint8_t offset[8] = { 0 };
	uint8_t fmmu[EC_MAXFMMU][ESC_FMMU_BYTES] = { { 0 } };
	struct access access[1 + EC_MAXFMMU];
	size_t n = 0;
	int r;

	if (sl->is_clock_set) {
		access[n++] = walk_access(ECAT_CMD_APRD, position, ESC_REG_DC_SYSTEM_TIME_OFFSET,
					  offset, sl->is_clock_64bit ? 8 : 4);
	}
	for (unsigned i = 0; i < EC_MAXFMMU; i++) {
		if (soem->FMMU[i].FMMUactive) {
			access[n++] = walk_access(ECAT_CMD_APRD, position,
						  (uint16_t)(ESC_REG_FMMU + i * ESC_FMMU_BYTES),
						  fmmu[i], ESC_FMMU_BYTES);
		}
	}
	r = n == 0 ? 0 : registers_run(bus, access, n);
	if (r < 0 || n == 0) {
		return r;
	}
	for (unsigned i = 0; i < EC_MAXFMMU; i++) {
		if (soem->FMMU[i].FMMUactive &&
		    memcmp(fmmu[i], &soem->FMMU[i], ESC_FMMU_BYTES) != 0) {
			return 0;
		}
	}
	return !sl->is_clock_set ||
	       (sl->is_clock_64bit ? get_le64(offset) == (uint64_t)sl->clock_offset_ns
				   : get_le32(offset) == (uint32_t)(uint64_t)sl->clock_offset_ns);
}

/* A slave that was there and whose address answers once is itself. Returned from a loss, or with a
 * second one beside it, it must show the marks; if two do, none is believed. */
static int bind_slave(struct bus *bus, size_t pos, struct walk *walk)
{
	const struct bus_slave *sl = &bus->slave[pos];
	int is_sure = !sl->is_lost && walk_claims(walk, sl->info.station_addr) == 1;
	int bound = -1;

	for (size_t i = 0; i < walk->count; i++) {
		int r = 1;

		if (get_le16(walk->at[i].address) != sl->info.station_addr) {
			continue;
		}
		if (!is_sure) {
			r = has_marks_of(bus, i, pos);
		}
		if (r < 0) {
			return r;
		}
		if (r == 1 && bound >= 0) {
			walk->at[bound].slave = -1;
			return 0;
		}
		if (r == 1) {
			bound = (int)i;
			walk->at[i].slave = (int)pos;
		}
	}
	return 0;
}

/* --- all of it --- */

/* Something is on its way: the positions are walked in every poll. */
static int is_unsettled(const struct bus *bus)
{
	for (size_t g = 0; g < GUESTS_MAX; g++) {
		enum guest_kind kind = bus->guest[g].kind;

		if (kind != GUEST_NONE && kind != GUEST_STRANGER) {
			return 1;
		}
	}
	for (size_t i = 0; i < bus->slave_count; i++) {
		if (bus->slave[i].closed_ports != 0 || bus->slave[i].is_lost) {
			return 1;
		}
	}
	return 0;
}

static unsigned count_expected(const struct bus *bus)
{
	unsigned count = bus_guests_answering(bus);

	for (size_t i = 0; i < bus->slave_count; i++) {
		count += !bus->slave[i].is_lost && bus->slave[i].misses == 0;
	}
	return count;
}

int bus_places_follow(struct bus *bus, unsigned answering, int is_doubtful,
		      const struct bus_emit *emit)
{
	struct walk walk = { .count = answering };
	int r;

	if (!is_doubtful && answering == count_expected(bus) && !is_unsettled(bus)) {
		return 0;
	}
	if (answering > WALK_POSITIONS) {
		walk.count = WALK_POSITIONS;
	}
	r = walk_positions(bus, &walk);
	for (size_t i = 0; i < bus->slave_count && r >= 0; i++) {
		r = bind_slave(bus, i, &walk);
	}
	if (r < 0) {
		return r;
	}
	for (size_t i = 0; i < walk.count; i++) {
		if (walk.at[i].slave >= 0) {
			bus_recover_begin(bus, (size_t)walk.at[i].slave, emit);
		}
	}
	guests_drop(bus, &walk, emit);
	guests_follow(bus, &walk, emit);
	return 0;
}

void bus_places_release(struct bus *bus)
{
	const uint8_t by_itself = 0;

	for (size_t i = 0; i < bus->slave_count; i++) {
		if (bus->slave[i].closed_ports != 0) {
			register_write(bus, i, ESC_REG_DL_CONTROL + 1, &by_itself,
				       sizeof(by_itself));
			bus->slave[i].closed_ports = 0;
		}
	}
}

/* Does the reference clock hold the offset that this session wrote? 1, 0; -EAGAIN. */
static int has_offset(struct bus *bus, size_t pos)
{
	const struct bus_slave *sl = &bus->slave[pos];
	uint8_t offset[8] = { 0 };

	bus->error = NULL;
	if (register_read(bus, pos, ESC_REG_DC_SYSTEM_TIME_OFFSET, offset, sizeof(offset)) < 0) {
		return -EAGAIN;
	}
	return sl->is_clock_set && get_le64(offset) == (uint64_t)sl->clock_offset_ns;
}

int bus_reference_is_itself(struct bus *bus)
{
	const uint8_t to_pdi = 1;
	struct identity_reader *reader = &bus->reference_reader;
	const struct bus_slave *sl;
	size_t pos;
	int r;

	if (bus->plan.dc_reference == 0) {
		return 0;
	}
	pos = (size_t)bus->reference;
	sl = &bus->slave[pos];
	r = has_offset(bus, pos);
	if (r != 1) {
		*reader = (struct identity_reader){ 0 };
		return r;
	}
	if (reader->result == 0 && reader->identity.vendor == 0) {
		identity_begin(reader, sl->info.station_addr,
			       mono_add(bus_now(bus), (span_t){ REFERENCE_NS }));
	}
	if (reader->result == 1) {
		return -EAGAIN;
	}
	r = reader->result < 0 ? -EAGAIN : bus_is_same_device(sl, &reader->identity);
	*reader = (struct identity_reader){ 0 };
	register_write(bus, pos, ESC_REG_EEPROM_CONFIG, &to_pdi, sizeof(to_pdi));
	return r;
}
