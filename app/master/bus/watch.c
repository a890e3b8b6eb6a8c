/* SPDX-License-Identifier: MIT */
/* Poll every slave a few times a second: states, error counters, clock difference; and one step of
 * recovery for those that need it. */
#include <stdio.h>
#include <string.h>

#include "base/bytes.h"
#include "base/slave_set.h"
#include "bus/bus_internal.h"
#include "bus/guests.h"
#include "bus/places.h"
#include "bus/registers.h"

enum {
	MISSES_LOST = 2,
	RECOVERIES_PER_CALL = 8,
	DIFF_MAGNITUDE = 0x7fffffff,
	DETAILS = 3,            /* registers read of one slave beside its AL status */
	DETAILED_PER_CALL = 12, /* slaves, about one frame: the others have their turn later */
};

enum { LOOK_ERRORS, LOOK_LOST_LINKS, LOOK_DIFF };

struct look {
	uint8_t al[6];
	uint16_t al_wkc;
	uint8_t errors[ERROR_PORT_BYTES];
	uint8_t lost_links[ERROR_LINK_BYTES];
	uint8_t diff[4];
	uint8_t is_detailed;
	uint16_t wkc[DETAILS];
};

/* AL status of each slave, and how many devices there are at all. */
static int read_states(struct bus *bus, struct look *look, unsigned *ret_answering)
{
	struct access access[LIMIT_SLAVES + 1];
	uint8_t any[2];
	int r;

	access[0] = (struct access){
		.cmd = ECAT_CMD_BRD, .reg = ESC_REG_AL_STATUS, .len = sizeof(any), .data = any
	};
	for (size_t i = 0; i < bus->slave_count; i++) {
		access[i + 1] = (struct access){ .cmd = ECAT_CMD_FPRD,
						 .adp = bus->slave[i].info.station_addr,
						 .reg = ESC_REG_AL_STATUS,
						 .len = sizeof(look[i].al),
						 .data = look[i].al };
	}
	r = registers_run(bus, access, bus->slave_count + 1);
	for (size_t i = 0; i < bus->slave_count && r >= 0; i++) {
		look[i].al_wkc = access[i + 1].wkc;
	}
	*ret_answering = r < 0 ? 0 : access[0].wkc;
	return r;
}

static size_t add_details(struct bus *bus, size_t pos, struct look *look, struct access *access)
{
	const struct {
		uint16_t reg;
		uint16_t len;
		void *data;
	} part[DETAILS] = {
		[LOOK_ERRORS] = { ESC_REG_RX_ERROR_COUNTER, sizeof(look->errors), look->errors },
		[LOOK_LOST_LINKS] = { ESC_REG_LOST_LINK_COUNTER, sizeof(look->lost_links),
				      look->lost_links },
		[LOOK_DIFF] = { ESC_REG_DC_SYSTEM_TIME_DIFF, sizeof(look->diff), look->diff },
	};

	for (int k = 0; k < DETAILS; k++) {
		access[k] = (struct access){ .cmd = ECAT_CMD_FPRD,
					     .adp = bus->slave[pos].info.station_addr,
					     .reg = part[k].reg,
					     .len = part[k].len,
					     .data = part[k].data };
	}
	return DETAILS;
}

/* Error counters, clock and mailbox of the slaves whose turn it is. */
static void read_details(struct bus *bus, struct look *look)
{
	struct access access[DETAILED_PER_CALL * DETAILS];
	size_t first = bus->next_detailed;
	size_t slaves = bus->slave_count < DETAILED_PER_CALL ? bus->slave_count : DETAILED_PER_CALL;
	size_t n = 0;

	for (size_t i = 0; i < slaves; i++) {
		size_t pos = (first + i) % bus->slave_count;

		n += add_details(bus, pos, &look[pos], access + n);
	}
	if (n == 0 || registers_run(bus, access, n) < 0) {
		return;
	}
	for (size_t i = 0; i < n; i++) {
		size_t pos = (first + i / DETAILS) % bus->slave_count;

		look[pos].wkc[i % DETAILS] = access[i].wkc;
		look[pos].is_detailed = 1;
	}
	bus->next_detailed = (first + slaves) % bus->slave_count;
}

/* While a slave that failed before is tried again, only what is new about it is an event. */
static int is_worth_an_event(const struct bus_slave *sl, uint16_t status, uint16_t code)
{
	if ((sl->attempts == 0 && !sl->is_unstable) || (status & AL_STATE_MASK) == AL_OP) {
		return status != sl->al_status;
	}
	return (status & AL_ERROR) != 0 && code != sl->trouble_code && code != sl->al_code;
}

static void note_state(struct bus *bus, size_t pos, const struct look *look,
		       const struct bus_emit *emit)
{
	struct bus_slave *sl = &bus->slave[pos];
	uint16_t status = get_le16(look->al);
	uint16_t code = get_le16(look->al + 4);

	if (is_worth_an_event(sl, status, code)) {
		bus_emit_event(bus, emit,
			       (struct event){ .id = EVENT_SLAVE_STATE,
					       .slave_pos = (uint16_t)pos,
					       .arg = { sl->al_status, status },
					       .value = code });
	}
	sl->al_status = status;
	sl->al_code = code;
}

/* A slave that was lost is back when its place is known (bus/places.c), not when something answers
 * to its address. */
static void note_absence(struct bus *bus, size_t pos, const struct bus_emit *emit)
{
	struct bus_slave *sl = &bus->slave[pos];

	sl->misses++;
	if (!sl->is_lost && sl->misses >= MISSES_LOST) {
		sl->is_lost = 1;
		sl->step = RECOVERY_BACK;
		bus_emit_event(
			bus, emit,
			(struct event){ .id = EVENT_SLAVE_LOST, .slave_pos = (uint16_t)pos });
	}
}

/* Clear counters before they saturate: read, cleared and read in one frame, so no count in between
 * is lost, and it does not matter which of them a chip clears. */
static void clear_errors(struct bus *bus, size_t pos)
{
	struct error_counters *ec = &bus->slave[pos].errors;
	uint16_t adp = bus->slave[pos].info.station_addr;
	uint8_t read[2][ERROR_COUNTERS];
	struct access access[] = {
		{ ECAT_CMD_FPRD, adp, ESC_REG_RX_ERROR_COUNTER, ERROR_PORT_BYTES, read[0], 0 },
		{ ECAT_CMD_FPRD, adp, ESC_REG_LOST_LINK_COUNTER, ERROR_LINK_BYTES,
		  read[0] + ERROR_LINKS, 0 },
		{ ECAT_CMD_FPWR, adp, ESC_REG_RX_ERROR_COUNTER, 2 * ESC_PORTS, NULL, 0 },
		{ ECAT_CMD_FPWR, adp, ESC_REG_ECAT_PU_ERROR, 2, NULL, 0 },
		{ ECAT_CMD_FPWR, adp, ESC_REG_LOST_LINK_COUNTER, ERROR_LINK_BYTES, NULL, 0 },
		{ ECAT_CMD_FPRD, adp, ESC_REG_RX_ERROR_COUNTER, ERROR_PORT_BYTES, read[1], 0 },
		{ ECAT_CMD_FPRD, adp, ESC_REG_LOST_LINK_COUNTER, ERROR_LINK_BYTES,
		  read[1] + ERROR_LINKS, 0 },
	};
	const struct access *second = &access[5];

	if (registers_run(bus, access, sizeof(access) / sizeof(access[0])) < 0) {
		return; /* the next look sees what has become of them */
	}
	if (access[0].wkc == 1 && second[0].wkc == 1) {
		error_counters_take(ec, 0, read[0], ERROR_PORT_BYTES);
		error_counters_take(ec, 0, read[1], ERROR_PORT_BYTES);
	}
	if (access[1].wkc == 1 && second[1].wkc == 1) {
		error_counters_take(ec, ERROR_LINKS, read[0] + ERROR_LINKS, ERROR_LINK_BYTES);
		error_counters_take(ec, ERROR_LINKS, read[1] + ERROR_LINKS, ERROR_LINK_BYTES);
	}
}

static void count_errors(struct bus *bus, size_t pos, const struct look *look)
{
	struct bus_slave *sl = &bus->slave[pos];
	int wants_clear = 0;

	if (look->wkc[LOOK_ERRORS] == 1) {
		wants_clear = error_counters_take(&sl->errors, 0, look->errors, ERROR_PORT_BYTES);
	}
	if (look->wkc[LOOK_LOST_LINKS] == 1) {
		wants_clear |= error_counters_take(&sl->errors, ERROR_LINKS, look->lost_links,
						   ERROR_LINK_BYTES);
	}
	if (wants_clear) {
		clear_errors(bus, pos);
	}
}

static void show_sync(const struct bus_slave *sl, struct slave_status *page)
{
	uint32_t out_ns = sl->output_sync.minimum_cycle_ns;
	uint32_t in_ns = sl->input_sync.minimum_cycle_ns;

	atomic_store_explicit(&page->output_sync_type, sl->output_sync.type, memory_order_relaxed);
	atomic_store_explicit(&page->input_sync_type, sl->input_sync.type, memory_order_relaxed);
	atomic_store_explicit(&page->minimum_cycle_ns, out_ns > in_ns ? out_ns : in_ns,
			      memory_order_relaxed);
}

static void show(const struct bus_slave *sl, const struct look *look, struct slave_status *page)
{
	atomic_store_explicit(&page->is_lost, (uint32_t)sl->is_lost, memory_order_relaxed);
	if (look->al_wkc == 1 && !sl->is_lost) {
		atomic_store_explicit(&page->al_state,
				      get_le16(look->al) & (AL_STATE_MASK | AL_ERROR),
				      memory_order_relaxed);
		atomic_store_explicit(&page->al_status_code, get_le16(look->al + 4),
				      memory_order_relaxed);
	} else if (sl->is_lost) {
		atomic_store_explicit(&page->al_state, AL_NONE, memory_order_relaxed);
	}
	error_counters_show(&sl->errors, page);
	show_sync(sl, page);
	if (look->is_detailed) {
		atomic_store_explicit(&page->dc_diff_ns,
				      look->wkc[LOOK_DIFF] == 1
					      ? (int32_t)(get_le32(look->diff) & DIFF_MAGNITUDE)
					      : -1,
				      memory_order_relaxed);
	}
}

/* A slave about to be restarted through INIT does not count as in OP, though its AL status shows
 * OP. */
static int is_to_leave_op(const struct bus_slave *sl)
{
	return sl->step >= RECOVERY_INIT && sl->step <= RECOVERY_CLOCK;
}

static int is_in_op(const struct bus_slave *sl)
{
	return !sl->is_lost && sl->misses == 0 && !is_to_leave_op(sl) &&
	       (sl->al_status & (AL_STATE_MASK | AL_ERROR)) == AL_OP;
}

void bus_lead_back(struct bus *bus, void (*emit)(void *ctx, const struct event *ev), void *emit_ctx)
{
	const struct bus_emit out = { .call = emit, .ctx = emit_ctx };
	unsigned steps = 0;

	if (bus->target != AL_OP) {
		return;
	}
	bus->is_looking = 1;
	for (size_t n = 0; n < bus->slave_count && steps < RECOVERIES_PER_CALL; n++) {
		size_t pos = (bus->next_recovery + n) % bus->slave_count;
		struct bus_slave *sl = &bus->slave[pos];

		if (is_in_op(sl) && sl->step == RECOVERY_NONE) {
			bus_recover_settled(bus, pos);
		} else if (!sl->is_lost && (sl->misses == 0 || sl->step != RECOVERY_NONE)) {
			bus_recover(bus, pos, &out);
			steps++;
		}
	}
	bus->next_recovery += steps > 0 ? steps : 1;
	bus->is_looking = 0;
}

/* What was read of one slave. If its address answers twice, nothing is known of it in this poll. */
static void take_look(struct bus *bus, size_t pos, const struct look *look,
		      const struct bus_emit *emit)
{
	if (look->al_wkc == 0) {
		note_absence(bus, pos, emit);
	}
	if (look->al_wkc == 1 && !bus->slave[pos].is_lost) {
		bus->slave[pos].misses = 0;
		note_state(bus, pos, look, emit);
		count_errors(bus, pos, look);
	}
}

static void describe_absent(const struct bus *bus, char *text, size_t text_bytes)
{
	const char *name = bus->wanted->slave[bus->absent].name;

	snprintf(text, text_bytes, "slaves[%d]%s%s is optional and absent%s", bus->absent,
		 name[0] != '\0' ? " " : "", name,
		 bus->absent_count > 1 ? ", and it is not the only one" : "");
}

static void make_report(const struct bus *bus, struct bus_watch_report *ret_report)
{
	*ret_report = (struct bus_watch_report){ .strangers = bus_guests_known(bus) };
	bus_guests_describe(bus, ret_report->trouble, sizeof(ret_report->trouble));
	if (bus->absent_count > 0 && ret_report->trouble[0] == '\0') {
		describe_absent(bus, ret_report->notice, sizeof(ret_report->notice));
	}
	for (size_t i = 0; i < bus->slave_count; i++) {
		const struct bus_slave *sl = &bus->slave[i];

		ret_report->slaves_lost += sl->is_lost ? 1 : 0;
		if (is_in_op(sl)) {
			ret_report->slaves_op++;
			slave_set_add(&ret_report->in_op, (unsigned)i);
		} else if (ret_report->trouble[0] == '\0') {
			bus_recover_describe(bus, i, ret_report->trouble,
					     sizeof(ret_report->trouble));
		}
	}
	ret_report->is_reference_op =
		bus->plan.dc_reference == 0 || is_in_op(&bus->slave[bus->reference]);
	ret_report->is_all_op = ret_report->slaves_op == bus->slave_count;
}

int bus_watch(struct bus *bus, struct status_page *page,
	      void (*emit)(void *ctx, const struct event *ev), void *emit_ctx,
	      struct bus_watch_report *ret_report)
{
	const struct bus_emit out = { .call = emit, .ctx = emit_ctx };
	struct look look[LIMIT_SLAVES] = { 0 };
	unsigned answering;
	int is_doubtful = 0;
	int64_t time_ns;
	int r;

	bus->error = NULL;
	bus->is_looking = 1;
	r = read_states(bus, look, &answering);
	for (size_t i = 0; i < bus->slave_count; i++) {
		is_doubtful |= look[i].al_wkc > 1;
	}
	if (r >= 0) {
		bus_places_follow(bus, answering, is_doubtful, &out);
		read_details(bus, look);
	}
	for (size_t i = 0; i < bus->slave_count; i++) {
		take_look(bus, i, &look[i], &out);
		if (page != NULL) {
			show(&bus->slave[i], &look[i], &page->slave[i]);
		}
	}
	if (bus->plan.dc_reference != 0 && !bus->slave[bus->reference].is_lost &&
	    bus->slave[bus->reference].step == RECOVERY_NONE) {
		bus_reference_time(bus, &time_ns);
	}
	bus->is_looking = 0;
	make_report(bus, ret_report);
	return r < 0 ? r : 0;
}
