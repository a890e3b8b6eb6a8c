/* SPDX-License-Identifier: MIT */
/*
 * Distributed clocks, in place of SOEM's: stop, filters, latch, delays, offsets, drift burst,
 * check. Every register access is checked; 0x0934 goes before 0x0930, which is written again after
 * the offsets, so that the loops start from zero.
 */
#include <errno.h>
#include <inttypes.h>
#include <string.h>

#include "base/bytes.h"
#include "base/slave_place.h"
#include "bus/bus_internal.h"
#include "bus/registers.h"

enum {
	BURST_PER_FRAME = 1, /* a slave compares once a frame, at its end (ET1100 data sheet,
				0x0910) */
	DIFF_MAGNITUDE = 0x7fffffff,
	SETTLE_FRAMES = 500, /* between two reads of 0x092C */
	GOOD_LOOKS = 2,
	NEAR_FRAMES = 500,     /* in a row, all clocks near: the burst has done its work */
	NEAR_SHARE = 16,       /* of dc.diff_limit is near: rates that still differ are not */
	SILENT_FRAMES_MAX = 8, /* of the burst in a row, each tried as often as any access */
};

static int is_follower(const struct bus *bus, size_t pos)
{
	return bus->slave[pos].clock.kind == CLOCK_SYSTEM_TIME && (int)pos != bus->reference;
}

/* --- clear, latch, read --- */

/* WKC 0 is an error only where a slave has a system time: the broadcasts reach all that have the
 * register. */
static int clear_clocks(struct bus *bus)
{
	static const uint8_t zero[8];
	const uint8_t filters[2] = { CLOCK_TIME_FILTER, CLOCK_SPEED_FILTER };
	uint8_t start[2];
	int r;

	put_le16(start, CLOCK_SPEED_COUNTER_START);
	r = register_broadcast(bus, ESC_REG_DC_ACTIVATION, zero, 1);
	if (r >= 0) {
		r = register_broadcast(bus, ESC_REG_DC_SYSTEM_TIME_OFFSET, zero, 8);
	}
	if (r >= 0) {
		r = register_broadcast(bus, ESC_REG_DC_SYSTEM_TIME_DELAY, zero, 4);
	}
	if (r >= 0) {
		r = register_broadcast(bus, ESC_REG_DC_TIME_FILTER, filters, sizeof(filters));
	}
	if (r >= 0) {
		r = register_broadcast(bus, ESC_REG_DC_SPEED_COUNTER_START, start, sizeof(start));
	}
	return r < 0 ? bus_fail(bus, -EIO, "no frame returns while the clocks are cleared") : 0;
}

/* Time of the DC epoch at this moment. A board without a clock of its own starts at 2000 (T39). */
static int64_t wanted_time(const struct bus *bus)
{
	const struct platform *platform = line_platform(bus->line);
	int64_t since_2000_ns = platform->tai_ns(platform->ctx) - DC_EPOCH_UNIX_S * NS_PER_S;

	return since_2000_ns > 0 ? since_2000_ns : bus_now(bus).ns;
}

static int latch(struct bus *bus, int64_t *ret_latched_ns)
{
	static const uint8_t any[4];

	/* Before the frame, so that the way out counts and the way back does not. */
	*ret_latched_ns = wanted_time(bus);
	if (register_broadcast(bus, ESC_REG_DC_RECEIVE_TIME_PORT, any, sizeof(any)) <= 0) {
		return bus_fail(bus, -EIO, "no slave latches receive times (0x0900)");
	}
	return 0;
}

static int read_latched(struct bus *bus, size_t pos, uint64_t *ret_local_ns)
{
	struct bus_slave *sl = &bus->slave[pos];
	uint8_t times[4 * DC_PORTS];
	uint8_t local[8] = { 0 };

	*ret_local_ns = 0;
	if (sl->clock.kind == CLOCK_NONE) {
		return 0;
	}
	if (register_read(bus, pos, ESC_REG_DC_RECEIVE_TIME_PORT, times, sizeof(times)) < 0) {
		return bus_fail_slave(bus, pos, -EIO, "its receive times (0x0900) cannot be read");
	}
	for (unsigned i = 0; i < DC_PORTS; i++) {
		sl->clock.time_ns[i] = get_le32(times + 4 * (size_t)i);
	}
	if (sl->clock.kind != CLOCK_SYSTEM_TIME) {
		return 0;
	}
	if (register_read(bus, pos, ESC_REG_DC_RECEIVE_TIME_PU, local, sl->is_clock_64bit ? 8 : 4) <
	    0) {
		return bus_fail_slave(bus, pos, -EIO, "its receive time (0x0918) cannot be read");
	}
	*ret_local_ns = get_le64(local);
	return 0;
}

/* --- offsets --- */

static int solve(struct bus *bus)
{
	struct dc_node node[LIMIT_SLAVES];

	for (size_t i = 0; i < bus->slave_count; i++) {
		node[i] = bus->slave[i].clock;
	}
	bus->reference = dc_topology_solve(node, bus->slave_count);
	for (size_t i = 0; i < bus->slave_count; i++) {
		bus->slave[i].clock = node[i];
		bus->slave[i].info.dc_delay_ns = (int32_t)node[i].delay_ns;
		bus->slave[i].info.is_dc_reference = (int)i == bus->reference;
	}
	if (bus->reference == -EPROTO) {
		bus->reference = -1;
		return bus_fail(bus, -EPROTO,
				"the open ports of the slaves (0x0110) do not form a tree: a cable "
				"in a wrong "
				"port, or a slave added or removed during the scan");
	}
	return 0;
}

/* 1 if its receive times were latched; a port that is closed has none. */
static int is_latched(const struct dc_node *n)
{
	uint32_t any = 0;

	for (unsigned i = 0; i < DC_PORTS; i++) {
		any |= n->time_ns[i];
	}
	return n->kind != CLOCK_NONE && any != 0;
}

void bus_show_places(const struct bus *bus, struct status_page *page)
{
	struct dc_node node[LIMIT_SLAVES];
	int r;

	for (size_t i = 0; i < bus->slave_count; i++) {
		node[i] = bus->slave[i].clock;
	}
	r = dc_topology_solve(node, bus->slave_count);
	for (size_t i = 0; i < bus->slave_count; i++) {
		const struct dc_node *n = &node[i];
		const struct slave_place place = {
			.is_known = r != -EPROTO,
			.parent = n->parent,
			.parent_port = n->parent_port,
			.entry_port = n->entry_port,
			.open_ports = n->ports,
		};
		int is_measured = r != -EPROTO && n->parent >= 0 && is_latched(&node[n->parent]);

		atomic_store_explicit(&page->slave[i].place, slave_place_pack(&place),
				      memory_order_relaxed);
		atomic_store_explicit(&page->slave[i].cable_ns,
				      is_measured ? (int32_t)n->cable_ns : -1,
				      memory_order_relaxed);
	}
}

static int set_clocks(struct bus *bus)
{
	uint64_t local_ns[LIMIT_SLAVES] = { 0 };
	int64_t latched_ns;
	int r = latch(bus, &latched_ns);

	for (size_t i = 0; i < bus->slave_count && r >= 0; i++) {
		r = read_latched(bus, i, &local_ns[i]);
	}
	if (r >= 0) {
		r = solve(bus);
	}
	for (size_t i = 0; i < bus->slave_count && r >= 0; i++) {
		const struct bus_slave *sl = &bus->slave[i];

		if (sl->clock.kind != CLOCK_SYSTEM_TIME) {
			continue;
		}
		r = bus_clock_write(bus, i, latched_ns + sl->clock.delay_ns - (int64_t)local_ns[i]);
		if (r < 0) {
			return bus_fail_slave(bus, i, -EIO, "its clock rejects offset and delay");
		}
	}
	return r;
}

/* --- static drift --- */

static int64_t silence_ms(const struct bus *bus)
{
	int64_t ns = 0;

	for (unsigned i = 0; i < LINE_TRIES; i++) {
		ns += line_timeout(bus->line, i).ns;
	}
	return SILENT_FRAMES_MAX * ns / NS_PER_MS;
}

/* Where a burst may end before its last frame. */
struct burst_end {
	int64_t near_ns; /* -1: nowhere */
	unsigned near;   /* frames in a row until now */
};

/* 0x092C of all slaves ORed is an upper estimate of each. No answer: nothing is known. */
static int has_come_near(struct burst_end *end, const struct access *diff)
{
	int64_t most_ns = (int64_t)(get_le32(diff->data) & DIFF_MAGNITUDE);

	end->near = diff->wkc > 0 && most_ns <= end->near_ns ? end->near + 1 : 0;
	return end->near >= NEAR_FRAMES;
}

/*
 * One FRMW a frame: several in one frame measure the same moment and count as one. A single lost
 * frame does no harm; only a wire that stays silent ends the burst. Each frame also reads the
 * differences that the one before has left.
 */
static int burst(struct bus *bus, uint32_t frames, struct burst_end end)
{
	uint8_t diff[4] = { 0 };
	struct access access[] = {
		{ .cmd = ECAT_CMD_FRMW,
		  .adp = bus->slave[bus->reference].info.station_addr,
		  .reg = ESC_REG_DC_SYSTEM_TIME,
		  .len = 8 },
		{ .cmd = ECAT_CMD_BRD,
		  .reg = ESC_REG_DC_SYSTEM_TIME_DIFF,
		  .len = sizeof(diff),
		  .data = diff },
	};
	unsigned silent = 0;

	for (uint32_t i = 0; i < frames; i++) {
		memset(diff, 0, sizeof(diff)); /* of a frame that no slave answers */
		if (registers_run(bus, access, sizeof(access) / sizeof(access[0])) < 0) {
			if (++silent < SILENT_FRAMES_MAX) {
				continue;
			}
			return bus_fail(bus, -EIO,
					"no frame has come back for %" PRId64
					" ms during drift compensation (bus.frame_timeout is "
					"%" PRId64 " us)",
					silence_ms(bus), line_timeout(bus->line, 0).ns / NS_PER_US);
		}
		silent = 0;
		if (access[0].wkc == 0) {
			return bus_fail_slave(bus, (size_t)bus->reference, -EIO,
					      "the reference clock no longer answers");
		}
		if (has_come_near(&end, &access[1])) {
			return 0;
		}
	}
	return 0;
}

int64_t bus_clock_diff(struct bus *bus, size_t pos)
{
	uint8_t raw[4];
	int r = register_read(bus, pos, ESC_REG_DC_SYSTEM_TIME_DIFF, raw, sizeof(raw));

	return r < 0 ? r : (int64_t)(get_le32(raw) & DIFF_MAGNITUDE);
}

/* The slave that is furthest off, -1 when all are inside the limit; with a negative @ret_diff_ns
 * one that cannot be read. */
static int find_straggler(struct bus *bus, int64_t *ret_diff_ns)
{
	struct access access[LIMIT_SLAVES];
	uint8_t raw[LIMIT_SLAVES][4] = { { 0 } };
	size_t pos[LIMIT_SLAVES];
	size_t count = 0;
	int straggler = -1;
	int r;

	for (size_t i = 0; i < bus->slave_count; i++) {
		if (is_follower(bus, i)) {
			access[count] = (struct access){ .cmd = ECAT_CMD_FPRD,
							 .adp = bus->slave[i].info.station_addr,
							 .reg = ESC_REG_DC_SYSTEM_TIME_DIFF,
							 .len = sizeof(raw[0]),
							 .data = raw[count] };
			pos[count++] = i;
		}
	}
	r = registers_run(bus, access, count);
	*ret_diff_ns = bus->cfg->dc_diff_limit_ns;
	for (size_t i = 0; i < count; i++) {
		int64_t diff_ns = (int64_t)(get_le32(raw[i]) & DIFF_MAGNITUDE);

		if (r < 0 || access[i].wkc != 1) {
			*ret_diff_ns = -EIO;
			return (int)pos[i];
		}
		if (diff_ns > *ret_diff_ns) {
			*ret_diff_ns = diff_ns;
			straggler = (int)pos[i];
		}
	}
	return straggler;
}

/*
 * Rates have settled when the clocks stay together, not when they cross: near in many frames of the
 * burst, or at its end, and two good reads in a row.
 */
static int settle(struct bus *bus)
{
	struct burst_end end = { .near_ns = bus->cfg->dc_diff_limit_ns / NEAR_SHARE };
	mono_t give_up = mono_add(bus_now(bus), (span_t){ bus->cfg->dc_lock_timeout_ns });
	uint32_t frames = bus->cfg->dc_burst_frames;
	unsigned good = 0;

	while (good < GOOD_LOOKS) {
		int64_t diff_ns = 0;
		int straggler;
		int r = burst(bus, frames, end);

		if (r < 0) {
			return r;
		}
		straggler = find_straggler(bus, &diff_ns);
		if (straggler >= 0 && diff_ns < 0) {
			return bus_fail_slave(bus, (size_t)straggler, -EIO,
					      "its system time difference (0x092C) cannot be read");
		}
		if (straggler >= 0 && bus_now(bus).ns >= give_up.ns) {
			return bus_fail_slave(bus, (size_t)straggler, -ETIME,
					      "its clock is still %" PRId64 " ns off the reference "
					      "(limit %" PRId64 " ns, dc.diff_limit)",
					      diff_ns, bus->cfg->dc_diff_limit_ns);
		}
		good = straggler < 0 ? good + 1 : 0;
		frames = SETTLE_FRAMES;
		end.near_ns = -1;
	}
	return 0;
}

/* --- public --- */

static int has_clocks(const struct bus *bus)
{
	for (size_t i = 0; i < bus->slave_count; i++) {
		if (bus->slave[i].clock.kind == CLOCK_SYSTEM_TIME) {
			return 1;
		}
	}
	return 0;
}

/* Delays are known, and the burst, which takes seconds, has not begun. */
static int check_schedule(struct bus *bus)
{
	struct schedule *sc = &bus->schedule;
	struct dc_node node[LIMIT_SLAVES];

	for (size_t i = 0; i < bus->slave_count; i++) {
		node[i] = bus->slave[i].clock;
	}
	*sc = schedule_compute(&bus->plan, node, bus->slave_count, bus->cfg->cycle_period_ns,
			       bus->cfg->cycle_receive_percent);
	line_frame_limit_set(bus->line, sc->service_frame_bytes);
	if (bus->cfg->cycle_period_ns >= sc->smallest_period_ns) {
		return 0;
	}
	return bus_fail(bus, -EINVAL,
			"cycle.period %" PRId64
			" us is too short: the frames of %zu slaves with %u "
			"bytes of process data need %" PRId64 " us, cycle.receive allows %" PRId64
			" us: set cycle.period to %" PRId64 "us or more",
			bus->cfg->cycle_period_ns / NS_PER_US, bus->slave_count,
			bus->plan.image_bytes, sc->need_ns / NS_PER_US, sc->allowed_ns / NS_PER_US,
			sc->smallest_period_ns / NS_PER_US);
}

int bus_dc_setup(struct bus *bus, char *error)
{
	int r;

	bus->error = error;
	bus->reference = -1;
	bus->plan.dc_reference = 0;
	if (!bus->cfg->dc_enable || !has_clocks(bus)) {
		return check_schedule(bus);
	}
	r = clear_clocks(bus);
	if (r >= 0) {
		r = set_clocks(bus);
	}
	if (r < 0) {
		return r;
	}
	if (!bus->slave[bus->reference].is_clock_64bit) {
		return bus_fail_slave(
			bus, (size_t)bus->reference, -ENOTSUP,
			"the first clock on the bus has 32 bits only and cannot be the reference");
	}
	bus->plan.dc_reference = bus->slave[bus->reference].info.station_addr;
	r = check_schedule(bus);
	if (r >= 0) {
		r = settle(bus);
	}
	if (r < 0) {
		return r;
	}
	bus_publish_slaves(bus);
	return bus_reference_time(bus, &bus->reference_ns) < 0
		       ? bus_fail_slave(bus, (size_t)bus->reference, -EIO,
					"the reference clock does not answer")
		       : 0;
}
