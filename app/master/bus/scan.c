/* SPDX-License-Identifier: MIT */
/*
 * Finds the slaves: stops what an earlier master left running (T09), reads every slave's own
 * description, notices blank and unreadable EEPROMs before anything is built on them (T31), names
 * them, brings all to PRE-OP.
 */
#include <errno.h>
#include <stdio.h>
#include <string.h>

#include "base/bytes.h"
#include "base/utf8.h"
#include "bus/bus_internal.h"
#include "bus/compare.h"
#include "bus/eeprom.h"
#include "bus/identity.h"
#include "bus/names.h"
#include "bus/registers.h"
#include "config/version.h"
#include "image/entry.h"

/* SYNC pulses of a master that was killed; a slave whose SYNC unit its PDI owns is freed in
 * free_sync(). */
static void silence(struct bus *bus)
{
	uint8_t off = 0;

	register_broadcast(bus, ESC_REG_DC_ACTIVATION, &off, sizeof(off));
}

/* 0x0980 is written where it is set, and nowhere else: some drives fail on it (T12). */
static void free_sync(struct bus *bus, size_t pos)
{
	const uint8_t off = 0;
	uint8_t owner;

	if (register_read(bus, pos, ESC_REG_DC_CYCLIC_CONTROL, &owner, sizeof(owner)) >= 0 &&
	    owner != 0) {
		register_write(bus, pos, ESC_REG_DC_CYCLIC_CONTROL, &off, sizeof(off));
		register_write(bus, pos, ESC_REG_DC_ACTIVATION, &off, sizeof(off));
	}
}

static const char *why_none(const struct line *line, int has_loop)
{
	const struct transport *tp = line_transport(line);

	if (has_loop) {
		return LINE_UNCHANGED_TEXT;
	}
	if (tp->is_up != NULL && tp->is_up(tp->ctx) == 0) {
		return "the link is down (cable, power of the first slave)";
	}
	return "the link is up; is this the EtherCAT port, is the IN side connected?";
}

static int find_slaves(struct bus *bus)
{
	mono_t give_up = mono_add(bus_now(bus), (span_t){ bus->cfg->bus_scan_timeout_ns });
	uint64_t unchanged = line_unchanged(bus->line);
	int found;

	for (;;) {
		silence(bus);
		found = bus_enumerate(bus);
		if (found > 0 || found == -E2BIG || bus_now(bus).ns >= give_up.ns) {
			break;
		}
		if (line_sleep(bus->line, (span_t){ 100 * NS_PER_MS }) < 0) {
			return bus_fail(bus, -ECANCELED, "cancelled during the scan");
		}
	}
	if (found == -E2BIG) {
		return bus_fail(bus, -E2BIG, "more slaves on the bus than LIMIT_SLAVES (%d)",
				LIMIT_SLAVES);
	}
	if (found == -EIO) {
		return found;
	}
	if (found <= 0) {
		return bus_fail(bus, -ENODEV, "no slave answers on %s: %s",
				bus->cfg->interface[0] != '\0' ? bus->cfg->interface : "the line",
				why_none(bus->line, line_unchanged(bus->line) > unchanged));
	}
	return 0;
}

static int check_eeprom(struct bus *bus, size_t pos)
{
	const struct bus_slave *sl = &bus->slave[pos];
	const uint8_t *sii = sl->sii;
	uint32_t vendor = get_le32(sii + SII_VENDOR_BYTE);
	int is_refused = (sl->eeprom_status & (EEPROM_CHECKSUM_ERROR | EEPROM_NOT_LOADED)) != 0;

	if (vendor == 0 || vendor == UINT32_MAX) {
		return bus_fail_slave(
			bus, pos, -EPROTO,
			"its EEPROM is blank or unreadable (vendor 0x%08x, 0x0502 is 0x%04x): "
			"write its SII first",
			vendor, sl->eeprom_status);
	}
	/* A controller that emulates its EEPROM need not keep a checksum. */
	if (is_refused ||
	    (!sii_is_checksum_right(sii) && (sl->eeprom_status & EEPROM_EMULATED) == 0)) {
		return bus_fail_slave(
			bus, pos, -EPROTO,
			"its EEPROM is damaged: checksum of words 0 to 7 (0x%02x, expected 0x%02x, "
			"0x0502 is 0x%04x): write its SII again",
			sii[SII_CHECKSUM_BYTE], sii_checksum(sii), sl->eeprom_status);
	}
	return 0;
}

static void name_device(struct bus *bus, size_t pos)
{
	struct bus_slave *sl = &bus->slave[pos];

	sii_text(sl->sii, sl->sii_len, bus->parsed.device_name, sl->info.device);
	if (sl->info.device[0] == '\0') {
		sii_text(sl->sii, sl->sii_len, bus->parsed.order_name, sl->info.device);
	}
	if (sl->info.device[0] == '\0') {
		utf8_copy(bus_esi_device_name(bus, pos), sl->info.device, sizeof(sl->info.device));
	}
}

static void take_identity(struct bus *bus, size_t pos)
{
	struct slave_info *info = &bus->slave[pos].info;
	const uint8_t *sii = bus->slave[pos].sii;
	uint8_t alias[2] = { 0 };

	/* The chip takes it from the EEPROM when it loads that. */
	register_read(bus, pos, ESC_REG_STATION_ALIAS, alias, sizeof(alias));
	info->alias = get_le16(alias);
	info->vendor = get_le32(sii + SII_VENDOR_BYTE);
	info->product = get_le32(sii + SII_PRODUCT_BYTE);
	info->revision = get_le32(sii + SII_REVISION_BYTE);
	info->serial = get_le32(sii + SII_SERIAL_BYTE);
}

static void take_clock(struct bus *bus, size_t pos)
{
	struct bus_slave *sl = &bus->slave[pos];
	uint8_t features[2] = { 0 };
	uint8_t times[16];
	uint8_t system_time[8];

	register_read(bus, pos, ESC_REG_FEATURES, features, sizeof(features));
	sl->esc_features = get_le16(features);
	sl->is_clock_64bit = (sl->esc_features & ESC_FEATURE_DC_64BIT) != 0;
	/* The feature bit does not show whether there is a system time: read it. */
	if ((sl->esc_features & ESC_FEATURE_DC) == 0 ||
	    register_read(bus, pos, ESC_REG_DC_RECEIVE_TIME_PORT, times, sizeof(times)) < 0) {
		sl->clock.kind = CLOCK_NONE;
	} else if (register_read(bus, pos, ESC_REG_DC_SYSTEM_TIME, system_time,
				 sizeof(system_time)) < 0) {
		sl->clock.kind = CLOCK_RECEIVE_TIMES;
	} else {
		sl->clock.kind = CLOCK_SYSTEM_TIME;
	}
	sl->info.has_dc = sl->clock.kind == CLOCK_SYSTEM_TIME;
}

/* The configuration of the slave at its position. */
static void take_settings(struct bus *bus, size_t pos)
{
	struct bus_slave *sl = &bus->slave[pos];
	const struct config_slave *want;

	if (pos >= bus->cfg->slave_count) {
		return;
	}
	want = &bus->cfg->slave[pos];
	sl->mode = want->mode;
	sl->sync0_shift_ns = want->sync0_shift_ns;
	snprintf(sl->info.name, sizeof(sl->info.name), "%s", want->name);
}

/* Less than its cycle, with the sign that it was given. */
static int32_t stated_shift(const struct bus_slave *sl)
{
	int64_t shift_ns = sl->sync0_shift_ns % sl->sync0_cycle_ns;

	if (shift_ns > INT32_MAX || shift_ns < -INT32_MAX) {
		shift_ns = fold_ns(shift_ns, sl->sync0_cycle_ns);
	}
	return (int32_t)shift_ns;
}

/* The EEPROM is loaded: only now does the chip have its clock. */
static int describe(struct bus *bus, size_t pos)
{
	struct bus_slave *sl = &bus->slave[pos];
	char damage[128] = "";
	int r;

	/* Damage is reported where what it hides is needed: SYNC mode, mapping. */
	sii_parse(sl->sii, sl->sii_len, &bus->parsed, damage, sizeof(damage));
	if (damage[0] == '\0') {
		bus_esi_modes(bus, pos);
	}
	free_sync(bus, pos);
	take_clock(bus, pos);
	name_device(bus, pos);
	sl->is_lrw_forbidden = (sl->esc_features & ESC_FEATURE_NO_LRW) != 0 ||
			       (bus->parsed.general_flags & SII_GENERAL_NOT_LRW) != 0;
	if (sl->info.name[0] == '\0') {
		name_slave(sl->info.device, slave_is_piccolo(&sl->info), pos, sl->info.name,
			   sizeof(sl->info.name));
	}
	bus_soem_describe(bus, pos);
	r = bus_sync_mode(bus, pos, damage);
	sl->info.sync0_shift_ns = stated_shift(sl);
	return r;
}

static int check_names(struct bus *bus)
{
	for (size_t i = 0; i < bus->slave_count; i++) {
		for (size_t k = 0; k < i; k++) {
			if (strcmp(bus->slave[i].info.name, bus->slave[k].info.name) == 0) {
				return bus_fail_slave(bus, i, -EEXIST,
						      "slave %zu has the same name", k);
			}
		}
	}
	return 0;
}

void bus_publish_slaves(struct bus *bus)
{
	for (size_t i = 0; i < bus->slave_count; i++) {
		bus->slave[i].info.sync0_cycle_ns = bus_sync0_cycle_ns(bus, i);
		bus->info[i] = bus->slave[i].info;
	}
}

static int is_identification_wanted(const struct config *cfg)
{
	for (size_t i = 0; i < cfg->slave_count; i++) {
		if (cfg->slave[i].identification != 0) {
			return 1;
		}
	}
	return 0;
}

static void note_absent(struct bus *bus, const int *config)
{
	bus->absent_count = 0;
	for (size_t i = 0; i < bus->wanted->slave_count; i++) {
		size_t j = 0;

		while (j < bus->slave_count && config[j] != (int)i) {
			j++;
		}
		if (j < bus->slave_count) {
			continue;
		}
		bus->absent = bus->absent_count++ == 0 ? (int)i : bus->absent;
		bus_emit_event(bus, &bus->listener,
			       (struct event){ .id = EVENT_SLAVE_ABSENT,
					       .slave_pos = EVENT_NO_SLAVE,
					       .arg = { (int32_t)i, 0 } });
	}
}

/* The configuration by position. Where it does not fit, bus_compare() reports it. */
static void bind_slaves(struct bus *bus)
{
	struct slave_info info[LIMIT_SLAVES];
	int config[LIMIT_SLAVES];

	memset(bus->identification, 0, sizeof(bus->identification));
	for (size_t i = 0; i < bus->slave_count; i++) {
		info[i] = bus->slave[i].info;
	}
	if (is_identification_wanted(bus->wanted)) {
		for (size_t i = 0; i < bus->slave_count; i++) {
			bus->identification[i] = bus_identification_read(bus, i);
		}
	}
	bus->absent_count = 0;
	if (compare_bind(bus->wanted, info, bus->identification, bus->slave_count, config) < 0) {
		return;
	}
	compare_apply(bus->wanted, config, bus->slave_count, &bus->bound);
	bus->cfg = &bus->bound;
	for (size_t i = 0; i < bus->slave_count; i++) {
		bus->slave[i].info.config_item = (uint16_t)(config[i] + 1);
	}
	note_absent(bus, config);
}

static int describe_all(struct bus *bus)
{
	int r = bus_sii_load(bus);

	for (size_t i = 0; i < bus->slave_count && r >= 0; i++) {
		r = check_eeprom(bus, i);
		if (r >= 0) {
			take_identity(bus, i);
		}
	}
	bus->module_count = 0;
	r = r < 0 ? r : bus_esi_load(bus);
	if (r < 0) {
		return r;
	}
	bind_slaves(bus);
	for (size_t i = 0; i < bus->slave_count && r >= 0; i++) {
		take_settings(bus, i);
		bus_esi_timeouts(bus, i);
		r = describe(bus, i);
	}
	r = r < 0 ? r : check_names(bus);
	bus->assign_count = 0;
	bus->startup_count = 0;
	return r < 0 ? r : bus_startup_plan(bus);
}

int bus_scan(struct bus *bus, char *error)
{
	int r;

	bus->error = error;
	bus->cfg = bus->wanted;
	for (uint16_t i = 0; i < LIMIT_SLAVES; i++) {
		mailbox_slave_set(bus->mailbox, i, NULL);
	}
	r = find_slaves(bus);
	if (r < 0) {
		return r;
	}
	r = describe_all(bus);
	bus_publish_slaves(bus);
	if (r < 0) {
		return r;
	}
	r = bus_mailboxes_open(bus);
	if (r < 0) {
		return bus_fail(bus, r, "the mailboxes cannot be set up: frames are lost");
	}
	r = bus_request_state(bus, AL_PREOP, (span_t){ bus->cfg->bus_scan_timeout_ns }, error);
	for (size_t i = 0; i < bus->slave_count && r >= 0; i++) {
		bus_mailbox_set(bus, i);
	}
	return r < 0 ? r : bus_modules_load(bus);
}

int bus_compare(const struct bus *bus, char *error)
{
	return compare_slaves(bus->wanted, bus->info, bus->identification, bus->slave_count, error,
			      BUS_ERROR_BYTES);
}

const struct config *bus_config(const struct bus *bus)
{
	return bus->cfg;
}

void bus_config_follow(struct bus *bus)
{
	if (bus->cfg == &bus->bound) {
		config_follow(&bus->bound, bus->wanted);
	}
}
