/* SPDX-License-Identifier: MIT */
/*
 * The way of one slave back to OP, a step a call: found again, identified, INIT, PRE-OP, set up,
 * its clock set by those that run, SYNC0 into the common grid, SAFE-OP, OP (T18). Others are not
 * disturbed: every access goes to this slave's address.
 */
#include <errno.h>

#include "base/bytes.h"
#include "bus/bus_internal.h"
#include "bus/registers.h"

enum { SII_WORD_VENDOR = 0x08, SII_WORD_PRODUCT = 0x0a, EEPROM_TIMEOUT_US = 20000, GOOD_LOOKS = 4 };

#define STEP_TIMEOUT_NS (2 * NS_PER_S)
#define PAUSE_NS NS_PER_S

static void enter(struct bus *bus, size_t pos, enum recovery_step step)
{
	struct bus_slave *sl = &bus->slave[pos];
	int64_t timeout_ns =
		step == RECOVERY_SETTLE ? bus->cfg->dc_lock_timeout_ns : STEP_TIMEOUT_NS;

	sl->step = step;
	sl->step_deadline = mono_add(bus_now(bus), (span_t){ timeout_ns });
}

static void start_over(struct bus *bus, size_t pos)
{
	bus->slave[pos].retry_at = mono_add(bus_now(bus), (span_t){ PAUSE_NS });
	enter(bus, pos, RECOVERY_INIT);
}

static enum al_state state_of(const struct bus_slave *sl)
{
	return (enum al_state)(sl->al_status & AL_STATE_MASK);
}

static int has_error(const struct bus_slave *sl)
{
	return (sl->al_status & AL_ERROR) != 0;
}

static void ask(struct bus *bus, size_t pos, unsigned control)
{
	uint8_t word[2];

	put_le16(word, (uint16_t)control);
	register_write(bus, pos, ESC_REG_AL_CONTROL, word, sizeof(word));
}

/* --- finding --- */

/* Present position of the slave: lost ones before it do not count. */
static uint16_t auto_increment_address(const struct bus *bus, size_t pos)
{
	uint16_t before = 0;

	for (size_t i = 0; i < pos; i++) {
		before = (uint16_t)(before + (bus->slave[i].is_lost ? 0 : 1));
	}
	return (uint16_t)-before;
}

/* Behind a lost slave nothing can be identified; of two lost ones of a kind the first is restored
 * first. */
static int is_place_certain(const struct bus *bus, size_t pos)
{
	const struct slave_info *info = &bus->slave[pos].info;

	for (size_t i = 0; i < pos; i++) {
		const struct bus_slave *other = &bus->slave[i];

		if (other->is_lost && ((int)i == bus->slave[pos].clock.parent ||
				       (other->info.vendor == info->vendor &&
					other->info.product == info->product))) {
			return 0;
		}
	}
	return 1;
}

static void find(struct bus *bus, size_t pos)
{
	uint8_t address[2] = { 0 };
	struct access access = { .cmd = ECAT_CMD_APRD,
				 .adp = auto_increment_address(bus, pos),
				 .reg = ESC_REG_STATION_ADDRESS,
				 .len = sizeof(address),
				 .data = address };

	if (!is_place_certain(bus, pos) || registers_run(bus, &access, 1) < 0 || access.wkc == 0 ||
	    get_le16(address) != 0) {
		return;
	}
	/* It lost its address: power was off. */
	put_le16(address, bus->slave[pos].info.station_addr);
	access.cmd = ECAT_CMD_APWR;
	if (registers_run(bus, &access, 1) >= 0 && access.wkc > 0) {
		bus->soem_slave[soem_index(pos)].eep_pdi = 0;
		error_counters_restart(&bus->slave[pos].errors);
		enter(bus, pos, RECOVERY_IDENTIFY);
	}
}

static uint32_t read_sii_word(struct bus *bus, size_t pos, uint16_t word)
{
	return (uint32_t)ecx_readeepromFP(&bus->context, bus->slave[pos].info.station_addr, word,
					  EEPROM_TIMEOUT_US);
}

static void identify(struct bus *bus, size_t pos, const struct bus_emit *emit)
{
	struct bus_slave *sl = &bus->slave[pos];
	uint32_t vendor = read_sii_word(bus, pos, SII_WORD_VENDOR);
	uint32_t product = read_sii_word(bus, pos, SII_WORD_PRODUCT);
	const uint8_t none[2] = { 0, 0 };

	if (vendor == sl->info.vendor && product == sl->info.product) {
		sl->is_lost = 0;
		sl->misses = 0;
		sl->is_clock_set = 0;
		bus_emit_event(
			bus, emit,
			(struct event){ .id = EVENT_SLAVE_BACK, .slave_pos = (uint16_t)pos });
		enter(bus, pos, RECOVERY_INIT);
		return;
	}
	/* Its EEPROM may still be loading; at the deadline a slave that is not identified loses the
	 * address again. */
	if (bus_now(bus).ns >= sl->step_deadline.ns) {
		register_write(bus, pos, ESC_REG_STATION_ADDRESS, none, sizeof(none));
		enter(bus, pos, RECOVERY_FIND);
	}
}

/* --- states --- */

static void program_mailbox(struct bus *bus, size_t pos)
{
	const ec_slavet *soem = &bus->soem_slave[soem_index(pos)];

	if (soem->mbx_l > 0) {
		register_write(bus, pos, ESC_REG_SM, &soem->SM[0], 2 * ESC_SM_BYTES);
	}
	ecx_eeprom2pdi(&bus->context, soem_index(pos));
}

static void to_init(struct bus *bus, size_t pos)
{
	if (state_of(&bus->slave[pos]) != AL_INIT || has_error(&bus->slave[pos])) {
		ask(bus, pos, AL_INIT | AL_ERROR);
		return;
	}
	program_mailbox(bus, pos);
	ask(bus, pos, AL_PREOP);
	enter(bus, pos, RECOVERY_PREOP);
}

/* Request @state until the slave is in it, then continue with @next. */
static void to_state(struct bus *bus, size_t pos, enum al_state state, enum recovery_step next)
{
	const struct bus_slave *sl = &bus->slave[pos];

	if (has_error(sl)) {
		ask(bus, pos, (unsigned)state_of(sl) | AL_ERROR);
	} else if (state_of(sl) == state) {
		enter(bus, pos, next);
	} else {
		ask(bus, pos, state);
	}
}

static int has_clock(const struct bus *bus, size_t pos)
{
	return bus->plan.dc_reference != 0 && bus->slave[pos].clock.kind == CLOCK_SYSTEM_TIME;
}

static int needs_clock(const struct bus *bus, size_t pos)
{
	return has_clock(bus, pos) && !bus->slave[pos].is_clock_set;
}

static void set_up(struct bus *bus, size_t pos)
{
	if (bus_startup_sdos(bus, pos) < 0 || bus_restore_mapping(bus, pos) < 0) {
		start_over(bus, pos);
		return;
	}
	enter(bus, pos, needs_clock(bus, pos) ? RECOVERY_CLOCK : RECOVERY_SAFEOP);
}

/* --- clock --- */

/* A follower cannot be judged while the reference itself is not set. */
static int is_reference_set(const struct bus *bus)
{
	const struct bus_slave *reference = &bus->slave[bus->reference];

	return reference->is_clock_set && !reference->is_lost;
}

static int is_follower(const struct bus *bus, size_t pos)
{
	return has_clock(bus, pos) && (int)pos != bus->reference;
}

static int is_clock_near(struct bus *bus, size_t pos)
{
	int64_t diff_ns;

	if (!is_follower(bus, pos)) {
		return 1;
	}
	diff_ns = bus_clock_diff(bus, pos);
	return diff_ns >= 0 && diff_ns <= bus->cfg->dc_diff_limit_ns;
}

/* Near once may be in passing: clocks that settle swing. */
static void settle(struct bus *bus, size_t pos)
{
	struct bus_slave *sl = &bus->slave[pos];

	sl->good_looks = is_clock_near(bus, pos) ? sl->good_looks + 1 : 0;
	if (sl->good_looks < GOOD_LOOKS && is_follower(bus, pos)) {
		return;
	}
	if (bus_sync0_restore(bus, pos) >= 0) {
		enter(bus, pos, RECOVERY_SYNC0);
	}
}

static void wait_sync0(struct bus *bus, size_t pos)
{
	if (!bus_sync0_is_wanted(bus, pos) || bus_sync0_is_running(bus, pos) == 1) {
		enter(bus, pos, RECOVERY_SAFEOP);
	}
}

/* A slave that answers but is not in OP: where does its way begin? */
static void choose_way(struct bus *bus, size_t pos)
{
	struct bus_slave *sl = &bus->slave[pos];

	if (has_error(sl)) {
		ask(bus, pos, (unsigned)state_of(sl) | AL_ERROR);
		return;
	}
	switch (state_of(sl)) {
	case AL_OP:
	case AL_SAFEOP:
		if (is_follower(bus, pos) && !is_reference_set(bus)) {
			return;
		}
		if (needs_clock(bus, pos) || !is_clock_near(bus, pos)) {
			enter(bus, pos, RECOVERY_CLOCK);
		} else if (bus_sync0_is_wanted(bus, pos) && bus_sync0_is_running(bus, pos) == 0) {
			enter(bus, pos, RECOVERY_SETTLE);
		} else {
			enter(bus, pos, state_of(sl) == AL_OP ? RECOVERY_NONE : RECOVERY_OP);
		}
		return;
	case AL_PREOP:
		enter(bus, pos, RECOVERY_SETUP);
		return;
	case AL_NONE:
	case AL_INIT:
	case AL_BOOT:
		enter(bus, pos, RECOVERY_INIT);
		return;
	}
}

static void set_clock(struct bus *bus, size_t pos)
{
	if (is_follower(bus, pos) && !is_reference_set(bus)) {
		return;
	}
	if (bus_clock_restore(bus, pos) >= 0) {
		bus->slave[pos].good_looks = 0;
		enter(bus, pos, RECOVERY_SETTLE);
	}
}

static int is_overdue(const struct bus *bus, const struct bus_slave *sl)
{
	return sl->step != RECOVERY_NONE && sl->step != RECOVERY_BACK &&
	       sl->step != RECOVERY_FIND && sl->step != RECOVERY_IDENTIFY &&
	       bus_now(bus).ns >= sl->step_deadline.ns;
}

void bus_recover(struct bus *bus, size_t pos, const struct bus_emit *emit)
{
	struct bus_slave *sl = &bus->slave[pos];

	if (bus_now(bus).ns < sl->retry_at.ns) {
		return;
	}
	if (is_overdue(bus, sl)) {
		start_over(bus, pos);
		return;
	}
	switch (sl->step) {
	case RECOVERY_NONE:
	case RECOVERY_BACK:
		choose_way(bus, pos);
		return;
	case RECOVERY_FIND:
		find(bus, pos);
		return;
	case RECOVERY_IDENTIFY:
		identify(bus, pos, emit);
		return;
	case RECOVERY_INIT:
		to_init(bus, pos);
		return;
	case RECOVERY_PREOP:
		to_state(bus, pos, AL_PREOP, RECOVERY_SETUP);
		return;
	case RECOVERY_SETUP:
		set_up(bus, pos);
		return;
	case RECOVERY_CLOCK:
		set_clock(bus, pos);
		return;
	case RECOVERY_SETTLE:
		settle(bus, pos);
		return;
	case RECOVERY_SYNC0:
		wait_sync0(bus, pos);
		return;
	case RECOVERY_SAFEOP:
		to_state(bus, pos, AL_SAFEOP, RECOVERY_OP);
		return;
	case RECOVERY_OP:
		to_state(bus, pos, AL_OP, RECOVERY_NONE);
		return;
	}
}
