/* SPDX-License-Identifier: MIT */
#include "bus/guests.h"

#include <errno.h>
#include <stdio.h>

#include "base/bytes.h"
#include "bus/identity.h"

enum {
	PARKING_FIRST = 0x7e00, /* station addresses of guests, one a guest */
	FMMUS_CLEARED = 8,
	LOOP_CLOSED = 3,
};

/* An EEPROM may still be loading; after that it is unreadable, and tried again in this interval. */
#define LOADING_NS (2 * NS_PER_S)
#define REREAD_NS NS_PER_S

static int find_owner(const struct bus *bus, uint16_t address)
{
	for (size_t i = 0; i < bus->slave_count; i++) {
		if (address != 0 && bus->slave[i].info.station_addr == address) {
			return (int)i;
		}
	}
	return -1;
}

static uint16_t parking_of(const struct bus *bus, const struct bus_guest *guest)
{
	return (uint16_t)(PARKING_FIRST + (guest - bus->guest));
}

static struct bus_guest *guest_of(struct bus *bus, uint16_t address)
{
	size_t n = (size_t)address - PARKING_FIRST;

	return address >= PARKING_FIRST && n < GUESTS_MAX && bus->guest[n].kind != GUEST_NONE
		       ? &bus->guest[n]
		       : NULL;
}

static struct bus_guest *new_guest(struct bus *bus)
{
	for (size_t i = 0; i < GUESTS_MAX; i++) {
		if (bus->guest[i].kind == GUEST_NONE) {
			return &bus->guest[i];
		}
	}
	return NULL;
}

static void emit_guest(struct bus *bus, const struct bus_guest *guest, uint16_t id,
		       const struct bus_emit *emit)
{
	int pos = guest->expected >= 0 ? guest->expected : guest->owner;

	bus_emit_event(bus, emit,
		       (struct event){ .id = id,
				       .slave_pos = pos >= 0 ? (uint16_t)pos : EVENT_NO_SLAVE,
				       .arg = { guest->position, guest->came_with },
				       .value = (int64_t)((uint64_t)guest->identity.vendor << 32 |
							  guest->identity.product) });
}

/*
 * One frame: first the address, so that nothing that is meant for a slave of ours reaches it any
 * more; then its FMMUs, so that it neither takes nor gives process data; then INIT.
 */
static int isolate(struct bus *bus, struct bus_guest *guest)
{
	uint8_t address[2];
	uint8_t control[2];
	uint8_t fmmus[FMMUS_CLEARED * ESC_FMMU_BYTES] = { 0 };
	struct access access[] = {
		walk_access(ECAT_CMD_APWR, guest->position, ESC_REG_STATION_ADDRESS, address,
			    sizeof(address)),
		walk_access(ECAT_CMD_APWR, guest->position, ESC_REG_FMMU, fmmus, sizeof(fmmus)),
		walk_access(ECAT_CMD_APWR, guest->position, ESC_REG_AL_CONTROL, control,
			    sizeof(control)),
	};

	put_le16(address, parking_of(bus, guest));
	put_le16(control, AL_INIT | AL_ERROR);
	return registers_run(bus, access, sizeof(access) / sizeof(access[0]));
}

/* More guests than there is room for lose an address of ours, too. */
static void take_address(struct bus *bus, size_t position)
{
	uint8_t none[2] = { 0, 0 };
	struct access access =
		walk_access(ECAT_CMD_APWR, position, ESC_REG_STATION_ADDRESS, none, sizeof(none));

	registers_run(bus, &access, 1);
}

static struct bus_guest make_guest(const struct bus *bus, size_t position, uint16_t address)
{
	return (struct bus_guest){ .kind = GUEST_NEW,
				   .position = (uint16_t)position,
				   .came_with = address,
				   .owner = find_owner(bus, address),
				   .expected = -1,
				   .shut_by = -1,
				   .readable_by = mono_add(bus_now(bus), (span_t){ LOADING_NS }) };
}

/* The guest at position @i, isolated if it is new. NULL: not now. */
static struct bus_guest *take_guest(struct bus *bus, struct walk *walk, size_t i)
{
	uint16_t address = get_le16(walk->at[i].address);
	struct bus_guest *guest = guest_of(bus, address);

	if (guest != NULL && walk_claims(walk, address) == 1) {
		guest->position = (uint16_t)i;
		guest->shut_by = -1;
		return guest;
	}
	if (guest != NULL) {
		/* One was gone for so long that another guest was given its address: this one gets
		 * a new address, and both are identified again. */
		*guest = make_guest(bus, guest->position, address);
	}
	guest = new_guest(bus);
	if (guest == NULL) {
		if (find_owner(bus, address) >= 0) {
			take_address(bus, i);
		}
		return NULL;
	}
	*guest = make_guest(bus, i, address);
	if (isolate(bus, guest) < 0) {
		guest->kind = GUEST_NONE; /* the next walk meets it again */
		return NULL;
	}
	put_le16(walk->at[i].address, parking_of(bus, guest));
	return guest;
}

/* Those that the walk did not meet and that no closed port hides are gone. */
void guests_drop(struct bus *bus, const struct walk *walk, const struct bus_emit *emit)
{
	for (size_t g = 0; g < GUESTS_MAX; g++) {
		struct bus_guest *guest = &bus->guest[g];

		if (guest->kind != GUEST_NONE && guest->shut_by < 0 &&
		    walk_claims(walk, parking_of(bus, guest)) == 0) {
			if (guest->kind != GUEST_NEW && guest->kind != GUEST_WAITING) {
				emit_guest(bus, guest, EVENT_STRANGER_GONE, emit);
			}
			guest->kind = GUEST_NONE;
		}
	}
}

/* --- a guest is one of ours, or not --- */

/* Slaves before and behind @position that are bound: the lost ones between them may return there.
 */
static void find_gap(const struct walk *walk, size_t position, int *ret_before, int *ret_behind,
		     size_t slave_count)
{
	*ret_before = -1;
	*ret_behind = (int)slave_count;
	for (size_t i = 0; i < walk->count; i++) {
		int pos = walk->at[i].slave;

		if (pos >= 0 && i < position && pos > *ret_before) {
			*ret_before = pos;
		}
		if (pos >= 0 && i > position && pos < *ret_behind) {
			*ret_behind = pos;
		}
	}
}

/* Behind a slave that is lost, or behind a port without communication, nothing can be. */
static int is_reachable(const struct bus *bus, const struct walk *walk, size_t pos)
{
	const struct dc_node *node = &bus->slave[pos].clock;

	if (bus->plan.dc_reference == 0 || node->parent < 0) {
		return 1; /* the tree is not known, or it is at the master */
	}
	for (size_t i = 0; i < walk->count; i++) {
		if (walk->at[i].slave == node->parent) {
			return walk_open_ports(&walk->at[i]) >> node->parent_port & 1;
		}
	}
	return 0;
}

/*
 * The lost slave that @guest is: the first in its gap of this identity that can be reached. -1: no
 * slave there has this identity; -EAGAIN: some have, none can be reached.
 */
static int find_returned(const struct bus *bus, const struct walk *walk,
			 const struct bus_guest *guest, int *ret_expected)
{
	int result = -1;
	int before;
	int behind;

	*ret_expected = -1;
	find_gap(walk, guest->position, &before, &behind, bus->slave_count);
	for (int pos = before + 1; pos < behind; pos++) {
		const struct bus_slave *sl = &bus->slave[pos];

		if (!sl->is_lost) {
			continue;
		}
		if (*ret_expected < 0) {
			*ret_expected = pos;
		}
		if (!bus_is_same_device(sl, &guest->identity)) {
			continue;
		}
		if (is_reachable(bus, walk, (size_t)pos)) {
			return pos;
		}
		result = -EAGAIN;
	}
	return result;
}

static int give_address(struct bus *bus, struct bus_guest *guest, size_t pos)
{
	uint8_t address[2];
	struct access access = { .cmd = ECAT_CMD_FPWR,
				 .adp = parking_of(bus, guest),
				 .reg = ESC_REG_STATION_ADDRESS,
				 .len = sizeof(address),
				 .data = address };

	put_le16(address, bus->slave[pos].info.station_addr);
	if (registers_run(bus, &access, 1) < 0 || access.wkc != 1) {
		return -EAGAIN;
	}
	return 0;
}

static void return_slave(struct bus *bus, struct bus_guest *guest, size_t pos,
			 const struct bus_emit *emit)
{
	struct bus_slave *sl = &bus->slave[pos];

	if (give_address(bus, guest, pos) < 0) {
		return;
	}
	guest->kind = GUEST_NONE;
	bus->soem_slave[soem_index(pos)].eep_pdi = 0;
	error_counters_restart(&sl->errors);
	sl->is_clock_set = 0;
	bus_recover_begin(bus, pos, emit);
	bus_recover_restart(bus, pos);
}

static void set_kind(struct bus *bus, struct bus_guest *guest, enum guest_kind kind,
		     const struct bus_emit *emit)
{
	static const uint16_t id[] = { [GUEST_STRANGER] = EVENT_STRANGER,
				       [GUEST_WRONG] = EVENT_SLAVE_WRONG,
				       [GUEST_UNREADABLE] = EVENT_SLAVE_UNREADABLE,
				       [GUEST_WAITING] = 0 };

	if (guest->kind != kind && id[kind] != 0) {
		emit_guest(bus, guest, id[kind], emit);
	}
	guest->kind = kind;
}

static int is_identified(const struct bus_guest *guest)
{
	return guest->identity.vendor != 0;
}

static int is_reading_due(const struct bus *bus, const struct bus_guest *guest)
{
	return !is_identified(guest) &&
	       (guest->kind != GUEST_UNREADABLE || bus_now(bus).ns >= guest->readable_by.ns);
}

/* Of all that are on the wire, at the same time, by bus_guests_step(). */
static void begin_reading(struct bus *bus, const struct walk *walk)
{
	for (size_t g = 0; g < GUESTS_MAX; g++) {
		struct bus_guest *guest = &bus->guest[g];
		mono_t give_up = guest->readable_by;

		if (guest->kind == GUEST_NONE || !is_reading_due(bus, guest) ||
		    walk_claims(walk, parking_of(bus, guest)) != 1) {
			continue;
		}
		if (guest->kind == GUEST_UNREADABLE) {
			give_up = mono_add(bus_now(bus), (span_t){ REREAD_NS });
		}
		if (guest->reader.result != 1) {
			identity_begin(&guest->reader, parking_of(bus, guest), give_up);
		}
	}
}

static int is_being_read(const struct bus_guest *guest)
{
	return guest->kind != GUEST_NONE && guest->reader.result == 1;
}

int bus_guests_is_reading(const struct bus *bus)
{
	for (size_t g = 0; g < GUESTS_MAX; g++) {
		if (is_being_read(&bus->guest[g])) {
			return 1;
		}
	}
	return bus->reference_reader.result == 1;
}

static size_t list_readers(struct bus *bus, struct identity_reader **ret)
{
	size_t count = 0;

	for (size_t g = 0; g < GUESTS_MAX; g++) {
		if (is_being_read(&bus->guest[g])) {
			ret[count++] = &bus->guest[g].reader;
		}
	}
	if (bus->reference_reader.result == 1) {
		ret[count++] = &bus->reference_reader;
	}
	return count;
}

void bus_guests_step(struct bus *bus)
{
	struct identity_reader *reader[IDENTITY_READERS];
	size_t count = list_readers(bus, reader);

	if (count == 0) {
		return;
	}
	bus->error = NULL;
	bus->is_looking = 1;
	identity_step(bus, reader, count);
	bus->is_looking = 0;
	for (size_t g = 0; g < GUESTS_MAX; g++) {
		struct bus_guest *guest = &bus->guest[g];

		if (guest->kind != GUEST_NONE && guest->reader.result == 0) {
			guest->identity = guest->reader.identity;
		}
	}
}

/* Neither now nor until its time was over. */
static void note_unreadable(struct bus *bus, const struct walk *walk, struct bus_guest *guest,
			    const struct bus_emit *emit)
{
	if (guest->reader.result < 0 && bus_now(bus).ns >= guest->readable_by.ns) {
		find_returned(bus, walk, guest, &guest->expected);
		set_kind(bus, guest, GUEST_UNREADABLE, emit);
		guest->readable_by = mono_add(bus_now(bus), (span_t){ LOADING_NS });
	}
}

/* A device in front of @position in the same gap is still being identified: it may be the slave
 * that this one would be taken for. */
static int is_order_open(struct bus *bus, const struct walk *walk, size_t position)
{
	for (size_t i = position; i > 0 && walk->at[i - 1].slave < 0; i--) {
		const struct bus_guest *other = guest_of(bus, get_le16(walk->at[i - 1].address));

		if (other != NULL && other->kind == GUEST_NEW && !is_identified(other)) {
			return 1;
		}
	}
	return 0;
}

static void judge(struct bus *bus, struct walk *walk, struct bus_guest *guest,
		  const struct bus_emit *emit)
{
	int r;

	if (!is_identified(guest)) {
		note_unreadable(bus, walk, guest, emit);
		return;
	}
	r = find_returned(bus, walk, guest, &guest->expected);
	if (r >= 0 && is_order_open(bus, walk, guest->position)) {
		r = -EAGAIN;
	}
	if (r >= 0) {
		walk->at[guest->position].slave = r;
		return_slave(bus, guest, (size_t)r, emit);
	} else if (r == -EAGAIN) {
		set_kind(bus, guest, GUEST_WAITING, emit);
	} else {
		set_kind(bus, guest, guest->expected >= 0 ? GUEST_WRONG : GUEST_STRANGER, emit);
	}
}

/* --- the port towards a stranger --- */

static int write_loop_control(struct bus *bus, size_t pos, uint8_t closed_ports)
{
	uint8_t control = 0;

	for (unsigned port = 0; port < ESC_PORTS; port++) {
		if ((closed_ports >> port & 1) != 0) {
			control |= (uint8_t)(LOOP_CLOSED << (2 * port));
		}
	}
	return register_write(bus, pos, ESC_REG_DL_CONTROL + 1, &control, sizeof(control));
}

/* The slave right before a stranger has a port open that it did not have at the scan: only
 * strangers are behind it, so it can be closed. In the middle of the line there is no such port. */
static void shut_out(struct bus *bus, const struct walk *walk, size_t i)
{
	struct bus_slave *sl = &bus->slave[walk->at[i].slave];
	uint8_t news = walk_open_ports(&walk->at[i]) & (uint8_t)~sl->clock.ports;
	unsigned port = 0;

	if (news == 0 || (news & (news - 1)) != 0) {
		return;
	}
	while ((news >> port & 1) == 0) {
		port++;
	}
	for (size_t k = i + 1; k < walk->count && walk->at[k].slave < 0; k++) {
		struct bus_guest *guest = guest_of(bus, get_le16(walk->at[k].address));

		if (guest == NULL || guest->kind != GUEST_STRANGER) {
			return; /* not all of them are known yet */
		}
	}
	if (write_loop_control(bus, (size_t)walk->at[i].slave, sl->closed_ports | news) < 0) {
		return;
	}
	sl->closed_ports |= news;
	for (size_t k = i + 1; k < walk->count && walk->at[k].slave < 0; k++) {
		struct bus_guest *guest = guest_of(bus, get_le16(walk->at[k].address));

		guest->shut_by = walk->at[i].slave;
		guest->shut_port = (uint8_t)port;
	}
}

/* A closed port whose cable was pulled is opened again, and those behind it are gone. */
static void reopen(struct bus *bus, const struct walk *walk, size_t i, const struct bus_emit *emit)
{
	int pos = walk->at[i].slave;
	struct bus_slave *sl = &bus->slave[pos];
	uint8_t kept = sl->closed_ports & walk_linked_ports(&walk->at[i]);

	if (kept == sl->closed_ports || write_loop_control(bus, (size_t)pos, kept) < 0) {
		return;
	}
	for (size_t g = 0; g < GUESTS_MAX; g++) {
		struct bus_guest *guest = &bus->guest[g];

		if (guest->kind != GUEST_NONE && guest->shut_by == pos &&
		    (kept >> guest->shut_port & 1) == 0) {
			emit_guest(bus, guest, EVENT_STRANGER_GONE, emit);
			guest->kind = GUEST_NONE;
		}
	}
	sl->closed_ports = kept;
}

/* --- all of it --- */

void guests_follow(struct bus *bus, struct walk *walk, const struct bus_emit *emit)
{
	/* All of them first: what is addressed to a slave of ours must not reach them. */
	for (size_t i = 0; i < walk->count; i++) {
		if (walk->at[i].slave < 0) {
			take_guest(bus, walk, i);
		}
	}
	for (size_t i = 0; i < walk->count; i++) {
		struct bus_guest *guest = guest_of(bus, get_le16(walk->at[i].address));

		if (walk->at[i].slave < 0 && guest != NULL) {
			judge(bus, walk, guest, emit);
		}
	}
	begin_reading(bus, walk);
	for (size_t i = 0; i < walk->count; i++) {
		if (walk->at[i].slave >= 0) {
			reopen(bus, walk, i, emit);
			shut_out(bus, walk, i);
		}
	}
}

unsigned bus_guests_answering(const struct bus *bus)
{
	unsigned count = 0;

	for (size_t g = 0; g < GUESTS_MAX; g++) {
		count += bus->guest[g].kind != GUEST_NONE && bus->guest[g].shut_by < 0;
	}
	return count;
}

unsigned bus_guests_known(const struct bus *bus)
{
	unsigned count = 0;

	for (size_t g = 0; g < GUESTS_MAX; g++) {
		count += bus->guest[g].kind >= GUEST_STRANGER &&
			 bus->guest[g].kind <= GUEST_UNREADABLE;
	}
	return count;
}

void bus_guests_describe(const struct bus *bus, char *ret_text, size_t text_bytes)
{
	static const char *const kind[] = { [GUEST_STRANGER] = "a device that is not configured",
					    [GUEST_WRONG] = "wrong device",
					    [GUEST_UNREADABLE] = "EEPROM blank or unreadable" };

	ret_text[0] = '\0';
	for (size_t g = 0; g < GUESTS_MAX; g++) {
		const struct bus_guest *guest = &bus->guest[g];
		int pos = guest->expected >= 0 ? guest->expected : guest->owner;
		char what[96] = "";
		char whose[96] = "";

		if (guest->kind < GUEST_STRANGER || guest->kind > GUEST_UNREADABLE) {
			continue;
		}
		if (is_identified(guest)) {
			snprintf(what, sizeof(what),
				 ": vendor 0x%08x product 0x%08x revision 0x%08x serial %u",
				 guest->identity.vendor, guest->identity.product,
				 guest->identity.revision, guest->identity.serial);
		}
		if (pos >= 0) {
			snprintf(whose, sizeof(whose),
				 guest->expected >= 0 ? " in the place of slave %d (%s)"
						      : ", had the address of slave %d (%s)",
				 pos, bus->slave[pos].info.name);
		}
		snprintf(ret_text, text_bytes, "position %u: %s%s%s%s", guest->position,
			 kind[guest->kind], what, whose,
			 guest->shut_by >= 0 ? "; the port towards it is closed" : "");
		return;
	}
}
