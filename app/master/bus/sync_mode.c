/* SPDX-License-Identifier: MIT */
/*
 * Which SYNC signals a slave gets: the operation mode of its SII (ETG.2010 DC category, ETG.2000
 * OpMode), the configured AssignActivate word, or none. What an ESC cannot do, or what does not fit
 * the master's cycle, is refused with the name of the mode, not rounded (T40).
 */
#include <errno.h>
#include <inttypes.h>
#include <stdio.h>

#include "bus/bus_internal.h"
#include "image/entry.h"

enum {
	PICCOLO_PERIODIC = 0x0300,
	PICCOLO_ONE_SHOT = 0x0001, /* 0x0980 bit 0: the SYNC unit is the slave's own */
};

struct choice {
	struct bus *bus;
	size_t pos;
	const struct sii_dc_mode *mode; /* NULL: the SII has none for the word */
};

static const struct sii_dc_mode *find_mode(const struct sii *sii, uint16_t word)
{
	for (size_t i = 0; i < sii->dc_mode_count; i++) {
		if (sii->dc_mode[i].assign_activate == word) {
			return &sii->dc_mode[i];
		}
	}
	return NULL;
}

static int refuse(const struct choice *ch, const char *what, int64_t value_ns)
{
	struct bus *bus = ch->bus;
	const struct bus_slave *sl = &bus->slave[ch->pos];
	char name[SII_NAME_BYTES];

	sii_text(sl->sii, sl->sii_len, ch->mode->name, name);
	return bus_fail_slave(bus, ch->pos, -ENOTSUP,
			      "SYNC mode \"%.40s\" of its SII (AssignActivate 0x%04x) %s (%" PRId64
			      " ns, cycle.period %" PRId64 " ns): set slaves[].assign_activate",
			      name, ch->mode->assign_activate, what, value_ns,
			      bus->cfg->cycle_period_ns);
}

static int set_sync0(const struct choice *ch, struct bus_slave *sl)
{
	const struct sii_dc_mode *mode = ch->mode;
	int64_t period_ns = ch->bus->cfg->cycle_period_ns;
	int64_t cycle_ns = period_ns;

	if (mode->sync0_factor > 0) {
		cycle_ns = period_ns * mode->sync0_factor;
	} else if (mode->sync0_factor < 0) {
		cycle_ns = period_ns / -mode->sync0_factor;
	} else if (mode->sync0_cycle_ns != 0) {
		cycle_ns = mode->sync0_cycle_ns;
	}
	if (cycle_ns <= 0 || (cycle_ns % period_ns != 0 && period_ns % cycle_ns != 0) ||
	    (mode->sync0_factor < 0 && cycle_ns * -mode->sync0_factor != period_ns)) {
		return refuse(ch,
			      "needs a SYNC0 cycle that is no multiple or fraction of the "
			      "master's",
			      cycle_ns);
	}
	if (cycle_ns > UINT32_MAX) {
		return refuse(ch, "needs a SYNC0 cycle beyond 32 bits", cycle_ns);
	}
	sl->sync0_cycle_ns = cycle_ns;
	sl->sync0_shift_ns += mode->sync0_shift_ns;
	return 0;
}

/*
 * 0x09a4 is the time from a SYNC0 to its SYNC1; the next SYNC1 belongs to the first SYNC0 after
 * that (ET1100 data sheet). So a SYNC1 for every n-th SYNC0 is n - 1 SYNC0 cycles and the shift.
 */
static int set_sync1(const struct choice *ch, struct bus_slave *sl)
{
	const struct sii_dc_mode *mode = ch->mode;
	int64_t shift_ns = mode->sync1_shift_ns;
	int64_t after_ns;

	if (mode->sync1_factor < 0) {
		return refuse(ch, "needs a SYNC1 cycle below the SYNC0 cycle",
			      sl->sync0_cycle_ns / -mode->sync1_factor);
	}
	if (shift_ns < 0 || shift_ns >= sl->sync0_cycle_ns) {
		return refuse(ch, "needs a SYNC1 shift outside the SYNC0 cycle", shift_ns);
	}
	after_ns = shift_ns;
	if (mode->sync1_factor > 1) {
		after_ns += (mode->sync1_factor - 1) * sl->sync0_cycle_ns;
	}
	if (after_ns > UINT32_MAX) {
		return refuse(ch, "needs a SYNC1 cycle beyond 32 bits", after_ns);
	}
	sl->sync1_after_ns = (uint32_t)after_ns;
	return 0;
}

/* Cycles and shifts of the mode. */
static int set_signals(const struct choice *ch, struct bus_slave *sl)
{
	unsigned activation = sl->assign_activate >> 8;
	int r = 0;

	if (ch->mode == NULL || sl->clock.kind != CLOCK_SYSTEM_TIME) {
		return 0;
	}
	if ((activation & (SYNC_ACTIVATE_SYNC0 | SYNC_ACTIVATE_SYNC1)) == SYNC_ACTIVATE_SYNC1) {
		return refuse(ch, "needs SYNC1 without SYNC0", 0);
	}
	if ((activation & SYNC_ACTIVATE_SYNC0) != 0) {
		r = set_sync0(ch, sl);
	}
	if (r == 0 && (activation & SYNC_ACTIVATE_SYNC1) != 0) {
		r = set_sync1(ch, sl);
	}
	return r;
}

int bus_sync_mode(struct bus *bus, size_t pos, const char *damage)
{
	const struct config_slave *want =
		pos < bus->cfg->slave_count ? &bus->cfg->slave[pos] : NULL;
	uint32_t setting = want != NULL ? want->assign_activate : CONFIG_ASSIGN_SII;
	struct bus_slave *sl = &bus->slave[pos];
	struct choice ch = { .bus = bus, .pos = pos };

	sl->assign_activate = 0;
	sl->sync0_cycle_ns = bus->cfg->cycle_period_ns;
	sl->sync1_after_ns = 0;
	if (setting == CONFIG_ASSIGN_NONE) {
		return 0;
	}
	if (setting == CONFIG_ASSIGN_SII && slave_is_piccolo(&sl->info)) {
		sl->assign_activate =
			sl->mode == CONFIG_MODE_ONESHOT ? PICCOLO_ONE_SHOT : PICCOLO_PERIODIC;
		return 0;
	}
	if (setting != CONFIG_ASSIGN_SII) {
		sl->assign_activate = (uint16_t)setting;
		ch.mode = find_mode(&bus->parsed, sl->assign_activate);
		return set_signals(&ch, sl);
	}
	if (bus->parsed.dc_mode_count > 0) {
		ch.mode = &bus->parsed.dc_mode[0];
		sl->assign_activate = ch.mode->assign_activate;
		return set_signals(&ch, sl);
	}
	if (damage[0] != '\0' && sl->clock.kind == CLOCK_SYSTEM_TIME) {
		return bus_fail_slave(bus, pos, -EPROTO,
				      "its SYNC modes are unknown: %s: write its SII again, or set "
				      "slaves[].assign_activate",
				      damage);
	}
	return 0;
}
