/* SPDX-License-Identifier: MIT */
/*
 * SYNC0 of all slaves on one grid: multiples of the cycle period in DC time, plus each slave's
 * shift. A start time in the past never fires; so it is verified in the slave and retried
 * (T10).
 */
#include <errno.h>
#include <inttypes.h>
#include <string.h>

#include "base/bytes.h"
#include "bus/bus_internal.h"
#include "bus/registers.h"

enum {
	TRIES = 3,
	FRAMES_PER_SLAVE = 8, /* service frames to program one slave: a cycle each while riding */
	SYNC_UNIT_PDI = 0x01,
	STATUS_PENDING = 0x01,     /* 0x0984: the first SYNC0 has not fired */
	STATUS_START_WRONG = 0x04, /* 0x0984: the start time is not in the near future */
};

#define MARGIN_NS (100 * NS_PER_MS)
#define NONSENSE_NS NS_PER_S /* no clock is that far off within one start */

static int64_t period_ns(const struct bus *bus)
{
	return bus->cfg->cycle_period_ns;
}

static uint8_t activation_of(const struct bus_slave *sl)
{
	return (uint8_t)(sl->assign_activate >> 8);
}

static int has_sync0(const struct bus *bus, size_t pos)
{
	const struct bus_slave *sl = &bus->slave[pos];

	return bus->plan.dc_reference != 0 && sl->clock.kind == CLOCK_SYSTEM_TIME &&
	       sl->info.input_bits + sl->info.output_bits > 0 &&
	       (activation_of(sl) & SYNC_ACTIVATE_SYNC0) != 0;
}

/* The SYNC unit belongs to the slave's own controller: one-shot mode. */
static int is_pdi_owned(const struct bus *bus, size_t pos)
{
	const struct bus_slave *sl = &bus->slave[pos];

	return bus->plan.dc_reference != 0 && sl->clock.kind == CLOCK_SYSTEM_TIME &&
	       (sl->assign_activate & SYNC_UNIT_PDI) != 0;
}

static int64_t shift_of(const struct bus *bus, size_t pos)
{
	return mod_floor(bus->slave[pos].sync0_shift_ns, bus->slave[pos].sync0_cycle_ns);
}

/* The first SYNC0 of a slave at or after the common @start_ns: a multiple of its own cycle, and its
 * shift. */
static int64_t first_of(const struct bus *bus, size_t pos, int64_t start_ns)
{
	int64_t cycle_ns = bus->slave[pos].sync0_cycle_ns;

	return start_ns + mod_floor(-start_ns, cycle_ns) + shift_of(bus, pos);
}

static int64_t next_start(const struct bus *bus, int64_t dc_now_ns, size_t slaves)
{
	int64_t earliest_ns =
		dc_now_ns + MARGIN_NS + (int64_t)slaves * FRAMES_PER_SLAVE * period_ns(bus);

	return earliest_ns + period_ns(bus) - mod_floor(earliest_ns, period_ns(bus));
}

static int program(struct bus *bus, size_t pos, int64_t start_ns)
{
	const struct bus_slave *sl = &bus->slave[pos];
	uint8_t control = (uint8_t)sl->assign_activate;
	uint8_t off = 0;
	uint8_t owner = 0;
	uint8_t start[8];
	uint8_t cycle[8];
	uint8_t on = activation_of(sl);
	int r = register_write(bus, pos, ESC_REG_DC_ACTIVATION, &off, 1);

	put_le64(start, (uint64_t)first_of(bus, pos, start_ns));
	put_le32(cycle, (uint32_t)sl->sync0_cycle_ns);
	put_le32(cycle + 4, sl->sync1_after_ns);
	/* T12: 0x0980 is not written where it has the required value. */
	if (r >= 0) {
		r = register_read(bus, pos, ESC_REG_DC_CYCLIC_CONTROL, &owner, 1);
	}
	if (r >= 0 && owner != control) {
		r = register_write(bus, pos, ESC_REG_DC_CYCLIC_CONTROL, &control, 1);
	}
	if (r >= 0) {
		r = register_write(bus, pos, ESC_REG_DC_START_TIME, start,
				   sl->is_clock_64bit ? 8 : 4);
	}
	if (r >= 0) {
		r = register_write(bus, pos, ESC_REG_DC_SYNC0_CYCLE, cycle, sizeof(cycle));
	}
	if (r >= 0) {
		r = register_write(bus, pos, ESC_REG_DC_ACTIVATION, &on, 1);
	}
	return r;
}

/* The next SYNC0 must be within one of its cycles (plus a margin), on the grid. */
static int is_next_plausible(const struct bus *bus, size_t pos, int64_t next_ns, int64_t now_ns)
{
	int64_t cycle_ns = bus->slave[pos].sync0_cycle_ns;
	int64_t off_ns = fold_ns(next_ns - shift_of(bus, pos), cycle_ns);
	int64_t ahead_ns = next_ns - now_ns;

	if (!bus->slave[pos].is_clock_64bit) {
		ahead_ns = (int32_t)(uint32_t)ahead_ns;
		off_ns = 0; /* 2^32 is no multiple of the period */
	}
	return off_ns == 0 && ahead_ns > -NS_PER_US && ahead_ns <= cycle_ns + NS_PER_US;
}

int bus_sync0_is_running(struct bus *bus, size_t pos)
{
	const struct bus_slave *sl = &bus->slave[pos];
	uint16_t time_len = sl->is_clock_64bit ? 8 : 4;
	uint8_t next[8] = { 0 };
	uint8_t now[8] = { 0 };
	uint8_t activation = 0;
	uint8_t status = 0;
	uint8_t cycle[8] = { 0 };
	uint16_t station = sl->info.station_addr;
	struct access access[] = {
		{ .cmd = ECAT_CMD_FPRD,
		  .adp = station,
		  .reg = ESC_REG_DC_SYSTEM_TIME,
		  .len = time_len,
		  .data = now },
		{ .cmd = ECAT_CMD_FPRD,
		  .adp = station,
		  .reg = ESC_REG_DC_START_TIME,
		  .len = time_len,
		  .data = next },
		{ .cmd = ECAT_CMD_FPRD,
		  .adp = station,
		  .reg = ESC_REG_DC_ACTIVATION,
		  .len = 1,
		  .data = &activation },
		{ .cmd = ECAT_CMD_FPRD,
		  .adp = station,
		  .reg = ESC_REG_DC_SYNC0_CYCLE,
		  .len = sizeof(cycle),
		  .data = cycle },
		/* Not every controller has it. */
		{ .cmd = ECAT_CMD_FPRD,
		  .adp = station,
		  .reg = ESC_REG_DC_ACTIVATION_STATUS,
		  .len = 1,
		  .data = &status },
	};

	if (registers_run(bus, access, sizeof(access) / sizeof(access[0])) < 0) {
		return -EIO;
	}
	for (int i = 0; i < 4; i++) {
		if (access[i].wkc == 0) {
			return -ENXIO;
		}
	}
	return activation == activation_of(sl) && get_le32(cycle) == (uint32_t)sl->sync0_cycle_ns &&
	       get_le32(cycle + 4) == sl->sync1_after_ns &&
	       (status & (STATUS_PENDING | STATUS_START_WRONG)) == 0 &&
	       is_next_plausible(bus, pos, (int64_t)get_le64(next), (int64_t)get_le64(now));
}

/* --- all slaves --- */

static int program_all(struct bus *bus, const uint8_t *wanted, int64_t start_ns)
{
	for (size_t i = 0; i < bus->slave_count; i++) {
		if (wanted[i] && program(bus, i, start_ns) < 0) {
			return bus_fail_slave(bus, i, -EIO,
					      "its SYNC unit (0x0980) cannot be programmed");
		}
	}
	return 0;
}

/* The end of the first cycle of the slowest slave in @wanted. */
static int64_t end_of_start(const struct bus *bus, const uint8_t *wanted, int64_t start_ns)
{
	int64_t end_ns = start_ns + 2 * period_ns(bus);

	for (size_t i = 0; i < bus->slave_count; i++) {
		int64_t past_ns = first_of(bus, i, start_ns) + period_ns(bus);

		if (wanted[i] && past_ns > end_ns) {
			end_ns = past_ns;
		}
	}
	return end_ns;
}

/* The reference clock as it was last known; it goes on at the host's rate, about. */
struct known_time {
	int64_t dc_ns;
	mono_t at;
};

static int64_t estimate_ns(const struct bus *bus, struct known_time known)
{
	return known.dc_ns + mono_sub(bus_now(bus), known.at).ns;
}

/*
 * Wait until the reference clock has passed @end_ns. A reading that is far behind what the host's
 * clock says is an error: nothing could bound the wait. One that is ahead is found by verify_all().
 */
static int wait_past(struct bus *bus, struct known_time known, int64_t end_ns)
{
	for (;;) {
		int64_t expected_ns;
		int64_t now_ns;

		if (bus_reference_time(bus, &now_ns) < 0) {
			return bus_fail_slave(bus, (size_t)bus->reference, -EIO,
					      "the reference clock does not answer");
		}
		expected_ns = estimate_ns(bus, known);
		if (now_ns < expected_ns - NONSENSE_NS) {
			return bus_fail_slave(bus, (size_t)bus->reference, -EIO,
					      "the reference clock reads %" PRId64
					      " ns, expected %" PRId64 " ns or later",
					      now_ns, expected_ns);
		}
		if (now_ns > end_ns) {
			return 0;
		}
		if (line_sleep(bus->line, (span_t){ end_ns + period_ns(bus) - now_ns }) < 0) {
			return bus_fail(bus, -ECANCELED, "cancelled while SYNC0 started");
		}
	}
}

/* Clear those that run: the ones left in @wanted have to be started again. Returns their count. */
static int verify_all(struct bus *bus, uint8_t *wanted)
{
	int left = 0;

	for (size_t i = 0; i < bus->slave_count; i++) {
		if (wanted[i] && bus_sync0_is_running(bus, i) == 1) {
			wanted[i] = 0;
		}
		left += wanted[i];
	}
	return left;
}

static int fail_silent(struct bus *bus, const uint8_t *wanted)
{
	for (size_t i = 0; i < bus->slave_count; i++) {
		if (wanted[i]) {
			return bus_fail_slave(
				bus, i, -ETIME,
				"SYNC0 does not start (0x0984, 0x0990), tried %d times", TRIES);
		}
	}
	return 0;
}

static int give_to_pdi(struct bus *bus)
{
	for (size_t i = 0; i < bus->slave_count; i++) {
		uint8_t control = (uint8_t)bus->slave[i].assign_activate;
		uint8_t off = 0;

		if (!is_pdi_owned(bus, i)) {
			continue;
		}
		register_write(bus, i, ESC_REG_DC_ACTIVATION, &off, 1);
		if (register_write(bus, i, ESC_REG_DC_CYCLIC_CONTROL, &control, 1) < 0) {
			return bus_fail_slave(
				bus, i, -EIO,
				"its SYNC unit (0x0980) cannot be assigned to its controller");
		}
	}
	return 0;
}

int bus_sync0_start(struct bus *bus, int64_t dc_now_ns, char *error)
{
	uint8_t wanted[LIMIT_SLAVES] = { 0 };
	struct known_time known = { dc_now_ns, bus_now(bus) };
	size_t left = 0;
	int r;

	bus->error = error;
	for (size_t i = 0; i < bus->slave_count; i++) {
		wanted[i] = bus_sync0_cycle_ns(bus, i) != 0;
		left += wanted[i];
	}
	r = bus->plan.dc_reference != 0 ? give_to_pdi(bus) : 0;
	for (int i = 0; i < TRIES && left > 0 && r >= 0; i++) {
		int64_t start_ns = next_start(bus, estimate_ns(bus, known), left);

		r = program_all(bus, wanted, start_ns);
		if (r >= 0) {
			r = wait_past(bus, known, end_of_start(bus, wanted, start_ns));
		}
		if (r >= 0) {
			left = (size_t)verify_all(bus, wanted);
			known = (struct known_time){ bus->reference_ns, bus->reference_at };
			bus->sync0_start_ns = start_ns;
		}
	}
	if (r < 0) {
		return r;
	}
	return left > 0 ? fail_silent(bus, wanted) : 0;
}

/* A slave that returned: into the grid of the others. */
int bus_sync0_restore(struct bus *bus, size_t pos)
{
	int64_t now_ns;

	if (is_pdi_owned(bus, pos)) {
		uint8_t control = (uint8_t)bus->slave[pos].assign_activate;

		return register_write(bus, pos, ESC_REG_DC_CYCLIC_CONTROL, &control, 1);
	}
	if (!has_sync0(bus, pos) || bus->sync0_start_ns == 0) {
		return 0;
	}
	if (bus_reference_time(bus, &now_ns) < 0) {
		return -EIO;
	}
	return program(bus, pos, next_start(bus, now_ns, 1));
}

uint32_t bus_sync0_cycle_ns(const struct bus *bus, size_t pos)
{
	return has_sync0(bus, pos) && !is_pdi_owned(bus, pos)
		       ? (uint32_t)bus->slave[pos].sync0_cycle_ns
		       : 0;
}

int bus_sync0_is_wanted(const struct bus *bus, size_t pos)
{
	return bus_sync0_cycle_ns(bus, pos) != 0 && bus->sync0_start_ns != 0;
}

void bus_sync0_stop(struct bus *bus)
{
	uint8_t off = 0;

	for (size_t i = 0; i < bus->slave_count; i++) {
		if (is_pdi_owned(bus, i)) {
			register_write(bus, i, ESC_REG_DC_CYCLIC_CONTROL, &off, 1);
		}
		if (has_sync0(bus, i) || is_pdi_owned(bus, i)) {
			register_write(bus, i, ESC_REG_DC_ACTIVATION, &off, 1);
		}
	}
	bus->sync0_start_ns = 0;
}
