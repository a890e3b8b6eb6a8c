/* SPDX-License-Identifier: MIT */
/*
 * SYNC0 of all slaves on one grid: multiples of the cycle period in DC time, plus each slave's
 * shift. A start time in the past never fires; so it is verified in the slave and retried
 * (T10).
 */
#include <errno.h>
#include <inttypes.h>
#include <stddef.h>
#include <string.h>

#include "base/bytes.h"
#include "bus/bus_internal.h"
#include "bus/exchange_frame.h"
#include "bus/registers.h"
#include "wire/datagram.h"

enum {
	TRIES = 3,
	RESTORE_TRY = 1,      /* nobody waits for a slave that returns: the longer margin */
	CYCLES_PER_FRAME = 2, /* from one service frame to the next, while riding */
	FRAME_HEADS = ECAT_ETHERNET_BYTES + ECAT_FRAME_HEADER_BYTES,
	/* Datagrams of one slave in one frame, at most. */
	STEP_BYTES = EXCHANGE_OVERHEAD + 8,
	READ_BYTES = 5 * EXCHANGE_OVERHEAD + 8 + 8 + 1 + 8 + 1,
	VERIFY_SLAVES = LIMIT_FRAME_BYTES / READ_BYTES,
	SYNC_UNIT_PDI = 0x01,
	STATUS_PENDING = 0x01,     /* 0x0984: the first SYNC0 has not fired */
	STATUS_START_WRONG = 0x04, /* 0x0984: the start time is not in the near future */
};

/* For what delays the programming; four times as much for each further try. */
#define MARGIN_NS (25 * NS_PER_MS)
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

/* The registers of one slave that is started. */
struct sync_unit {
	uint8_t off;
	uint8_t owner; /* 0x0980 as it was */
	uint8_t control;
	uint8_t start[8];
	uint8_t cycle[8];
	uint8_t on;
};

/* What is written takes effect at the end of its frame: one after the other, each to all slaves. */
static const struct step {
	enum ecat_cmd cmd;
	uint16_t reg;
	uint16_t len;
	size_t offset;
} steps[] = {
	{ ECAT_CMD_FPWR, ESC_REG_DC_ACTIVATION, 1, offsetof(struct sync_unit, off) },
	{ ECAT_CMD_FPRD, ESC_REG_DC_CYCLIC_CONTROL, 1, offsetof(struct sync_unit, owner) },
	{ ECAT_CMD_FPWR, ESC_REG_DC_CYCLIC_CONTROL, 1, offsetof(struct sync_unit, control) },
	{ ECAT_CMD_FPWR, ESC_REG_DC_START_TIME, 8, offsetof(struct sync_unit, start) },
	{ ECAT_CMD_FPWR, ESC_REG_DC_SYNC0_CYCLE, 8, offsetof(struct sync_unit, cycle) },
	{ ECAT_CMD_FPWR, ESC_REG_DC_ACTIVATION, 1, offsetof(struct sync_unit, on) },
};

enum { STEPS = sizeof(steps) / sizeof(steps[0]) };

/* How many slaves, with @bytes of datagrams each, one service frame has room for. */
static size_t slaves_per_frame(const struct bus *bus, size_t bytes)
{
	size_t room = line_frame_limit(bus->line) - FRAME_HEADS;

	return room / bytes > 0 ? room / bytes : 1;
}

/* Service frames that program so many slaves: at least one for each step. */
static int64_t frames_for(const struct bus *bus, size_t slaves)
{
	size_t a_frame = slaves_per_frame(bus, STEP_BYTES);

	return STEPS * (int64_t)((slaves + a_frame - 1) / a_frame);
}

static int64_t next_start(const struct bus *bus, int64_t dc_now_ns, size_t slaves, unsigned try)
{
	int64_t earliest_ns = dc_now_ns + MARGIN_NS * (INT64_C(1) << 2 * try) +
			      frames_for(bus, slaves) * CYCLES_PER_FRAME * period_ns(bus);

	return earliest_ns + period_ns(bus) - mod_floor(earliest_ns, period_ns(bus));
}

static struct sync_unit unit_of(const struct bus *bus, size_t pos, int64_t start_ns)
{
	const struct bus_slave *sl = &bus->slave[pos];
	struct sync_unit unit = { .control = (uint8_t)sl->assign_activate,
				  .on = activation_of(sl) };

	put_le64(unit.start, (uint64_t)first_of(bus, pos, start_ns));
	put_le32(unit.cycle, (uint32_t)sl->sync0_cycle_ns);
	put_le32(unit.cycle + 4, sl->sync1_after_ns);
	return unit;
}

static struct access access_of(const struct bus *bus, size_t pos, const struct step *step,
			       struct sync_unit *unit)
{
	const struct bus_slave *sl = &bus->slave[pos];
	int is_short = step->reg == ESC_REG_DC_START_TIME && !sl->is_clock_64bit;

	return (struct access){ .cmd = step->cmd,
				.adp = sl->info.station_addr,
				.reg = step->reg,
				.len = is_short ? 4 : step->len,
				.data = (uint8_t *)unit + step->offset };
}

/* T12: 0x0980 is not written where it has the required value. */
static int needs_step(const struct step *step, const struct sync_unit *unit)
{
	return step->cmd != ECAT_CMD_FPWR || step->reg != ESC_REG_DC_CYCLIC_CONTROL ||
	       unit->owner != unit->control;
}

/* Start those in @wanted at @start_ns. 0, or -errno with the one that failed in @ret_pos. */
static int program(struct bus *bus, const uint8_t *wanted, int64_t start_ns, size_t *ret_pos)
{
	struct sync_unit unit[LIMIT_SLAVES];
	struct access access[LIMIT_SLAVES];
	size_t pos[LIMIT_SLAVES];

	for (size_t i = 0; i < bus->slave_count; i++) {
		if (wanted[i]) {
			unit[i] = unit_of(bus, i, start_ns);
		}
	}
	for (int step = 0; step < STEPS; step++) {
		size_t count = 0;
		int r;

		for (size_t i = 0; i < bus->slave_count; i++) {
			if (wanted[i] && needs_step(&steps[step], &unit[i])) {
				access[count] = access_of(bus, i, &steps[step], &unit[i]);
				pos[count++] = i;
			}
		}
		r = registers_run(bus, access, count);
		for (size_t i = 0; i < count; i++) {
			if (r < 0 || access[i].wkc != 1) {
				*ret_pos = pos[i];
				return -EIO;
			}
		}
	}
	return 0;
}

/* What shows that SYNC0 runs. */
struct sync_reading {
	uint8_t now[8];
	uint8_t next[8];
	uint8_t activation;
	uint8_t cycle[8];
	uint8_t status;
};

/*
 * The next SYNC0 must be within one of its cycles (plus a margin), on the grid. The time is that of
 * the frame's first octet, and an edge may come before 0x0990 is read, up to @frame_ns later.
 */
static int is_next_plausible(const struct bus *bus, size_t pos, const struct sync_reading *in,
			     int64_t frame_ns)
{
	int64_t next_ns = (int64_t)get_le64(in->next);
	int64_t now_ns = (int64_t)get_le64(in->now);
	int64_t cycle_ns = bus->slave[pos].sync0_cycle_ns;
	int64_t off_ns = fold_ns(next_ns - shift_of(bus, pos), cycle_ns);
	int64_t ahead_ns = next_ns - now_ns;

	if (!bus->slave[pos].is_clock_64bit) {
		ahead_ns = (int32_t)(uint32_t)ahead_ns;
		off_ns = 0; /* 2^32 is no multiple of the period */
	}
	return off_ns == 0 && ahead_ns > -NS_PER_US && ahead_ns <= cycle_ns + NS_PER_US + frame_ns;
}

enum { NOW, NEXT, ACTIVATION, CYCLE, STATUS, READS };

static void ask_sync(const struct bus *bus, size_t pos, struct sync_reading *in,
		     struct access ret_access[READS])
{
	const struct bus_slave *sl = &bus->slave[pos];
	const uint16_t time_len = sl->is_clock_64bit ? 8 : 4;
	const struct {
		uint16_t reg;
		uint16_t len;
		uint8_t *data;
	} reads[READS] = {
		[NOW] = { ESC_REG_DC_SYSTEM_TIME, time_len, in->now },
		[NEXT] = { ESC_REG_DC_START_TIME, time_len, in->next },
		[ACTIVATION] = { ESC_REG_DC_ACTIVATION, 1, &in->activation },
		[CYCLE] = { ESC_REG_DC_SYNC0_CYCLE, sizeof(in->cycle), in->cycle },
		/* Not every controller has it. */
		[STATUS] = { ESC_REG_DC_ACTIVATION_STATUS, 1, &in->status },
	};

	*in = (struct sync_reading){ .status = 0 };
	for (int i = 0; i < READS; i++) {
		ret_access[i] = (struct access){ .cmd = ECAT_CMD_FPRD,
						 .adp = sl->info.station_addr,
						 .reg = reads[i].reg,
						 .len = reads[i].len,
						 .data = reads[i].data };
	}
}

/* As bus_sync0_is_running(), of @slaves in one frame. */
static int judge_sync(const struct bus *bus, size_t pos, const struct sync_reading *in,
		      const struct access access[READS], size_t slaves)
{
	int64_t frame_ns = ecat_wire_time_ns(FRAME_HEADS + slaves * READ_BYTES);
	const struct bus_slave *sl = &bus->slave[pos];

	for (int i = 0; i < STATUS; i++) {
		if (access[i].wkc == 0) {
			return -ENXIO;
		}
	}
	return in->activation == activation_of(sl) &&
	       get_le32(in->cycle) == (uint32_t)sl->sync0_cycle_ns &&
	       get_le32(in->cycle + 4) == sl->sync1_after_ns &&
	       (in->status & (STATUS_PENDING | STATUS_START_WRONG)) == 0 &&
	       is_next_plausible(bus, pos, in, frame_ns);
}

int bus_sync0_is_running(struct bus *bus, size_t pos)
{
	struct sync_reading in;
	struct access access[READS];

	ask_sync(bus, pos, &in, access);
	return registers_run(bus, access, READS) < 0 ? -EIO : judge_sync(bus, pos, &in, access, 1);
}

/* --- all slaves --- */

static int program_all(struct bus *bus, const uint8_t *wanted, int64_t start_ns)
{
	size_t pos;

	return program(bus, wanted, start_ns, &pos) < 0
		       ? bus_fail_slave(bus, pos, -EIO,
					"its SYNC unit (0x0980) cannot be programmed")
		       : 0;
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

/* Those at @pos, in one frame: the time and the next SYNC0 of a slave belong together. */
static void verify_some(struct bus *bus, const size_t *pos, size_t count, uint8_t *wanted)
{
	struct sync_reading in[VERIFY_SLAVES];
	struct access access[VERIFY_SLAVES * READS];

	for (size_t i = 0; i < count; i++) {
		ask_sync(bus, pos[i], &in[i], &access[i * READS]);
	}
	if (registers_run(bus, access, count * READS) < 0) {
		return;
	}
	for (size_t i = 0; i < count; i++) {
		if (judge_sync(bus, pos[i], &in[i], &access[i * READS], count) == 1) {
			wanted[pos[i]] = 0;
		}
	}
}

/* Clear those that run: the ones left in @wanted have to be started again. Returns their count. */
static int verify_all(struct bus *bus, uint8_t *wanted)
{
	size_t a_frame = slaves_per_frame(bus, READ_BYTES);
	size_t pos[VERIFY_SLAVES];
	size_t count = 0;
	int left = 0;

	for (size_t i = 0; i < bus->slave_count; i++) {
		if (wanted[i]) {
			pos[count++] = i;
		}
		if (count == a_frame || count == VERIFY_SLAVES || i + 1 == bus->slave_count) {
			verify_some(bus, pos, count, wanted);
			count = 0;
		}
	}
	for (size_t i = 0; i < bus->slave_count; i++) {
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
	for (unsigned i = 0; i < TRIES && left > 0 && r >= 0; i++) {
		int64_t start_ns = next_start(bus, estimate_ns(bus, known), left, i);

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
	uint8_t wanted[LIMIT_SLAVES] = { 0 };
	size_t failed;
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
	wanted[pos] = 1;
	return program(bus, wanted, next_start(bus, now_ns, 1, RESTORE_TRY), &failed);
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
