/* SPDX-License-Identifier: MIT */
/* Poll every slave a few times a second: states, error counters, clock difference; and one step of
 * recovery for those that need it. */
#include <string.h>

#include "base/bytes.h"
#include "base/slave_set.h"
#include "bus/bus_internal.h"
#include "bus/registers.h"

enum {
	MISSES_LOST = 2,
	RECOVERIES_PER_CALL = 8,
	DIFF_MAGNITUDE = 0x7fffffff,
	LOOKS = 5, /* registers read of one slave */
	SM_MAILBOX_IN = ESC_REG_SM + ESC_SM_BYTES,
	SM_STATUS = 5,
	SM_STATUS_FULL = 0x08,
};

struct look {
	uint8_t al[6];
	uint8_t errors[ERROR_PORT_BYTES];
	uint8_t lost_links[ERROR_LINK_BYTES];
	uint8_t diff[4];
	uint8_t mailbox;
	uint16_t wkc[LOOKS];
};

enum { LOOK_AL, LOOK_ERRORS, LOOK_LOST_LINKS, LOOK_DIFF, LOOK_MAILBOX };

static int look_at_all(struct bus *bus, struct look *look)
{
	struct access access[LIMIT_SLAVES * LOOKS];
	size_t n = 0;
	int r;

	for (size_t i = 0; i < bus->slave_count; i++) {
		const struct {
			uint16_t reg;
			uint16_t len;
			void *data;
		} part[LOOKS] = {
			[LOOK_AL] = { ESC_REG_AL_STATUS, sizeof(look->al), look[i].al },
			[LOOK_ERRORS] = { ESC_REG_RX_ERROR_COUNTER, sizeof(look->errors),
					  look[i].errors },
			[LOOK_LOST_LINKS] = { ESC_REG_LOST_LINK_COUNTER, sizeof(look->lost_links),
					      look[i].lost_links },
			[LOOK_DIFF] = { ESC_REG_DC_SYSTEM_TIME_DIFF, sizeof(look->diff),
					look[i].diff },
			[LOOK_MAILBOX] = { SM_MAILBOX_IN + SM_STATUS, sizeof(look->mailbox),
					   &look[i].mailbox },
		};

		for (int k = 0; k < LOOKS; k++) {
			access[n++] = (struct access){ .cmd = ECAT_CMD_FPRD,
						       .adp = bus->slave[i].info.station_addr,
						       .reg = part[k].reg,
						       .len = part[k].len,
						       .data = part[k].data };
		}
	}
	r = registers_run(bus, access, n);
	for (size_t i = 0; i < n; i++) {
		look[i / LOOKS].wkc[i % LOOKS] = access[i].wkc;
	}
	return r;
}

static void note_state(struct bus *bus, size_t pos, const struct look *look,
		       const struct bus_emit *emit)
{
	struct bus_slave *sl = &bus->slave[pos];
	uint16_t status = get_le16(look->al);

	if (status != sl->al_status) {
		bus_emit_event(bus, emit,
			       (struct event){ .id = EVENT_SLAVE_STATE,
					       .slave_pos = (uint16_t)pos,
					       .arg = { sl->al_status, status },
					       .value = get_le16(look->al + 4) });
	}
	sl->al_status = status;
}

static void note_presence(struct bus *bus, size_t pos, int is_here, const struct bus_emit *emit)
{
	struct bus_slave *sl = &bus->slave[pos];

	if (is_here) {
		sl->misses = 0;
		/* A slave that has just got its address again does not count as back until it is
		 * identified. */
		if (sl->is_lost && sl->step != RECOVERY_IDENTIFY) {
			sl->is_lost = 0;
			sl->step = RECOVERY_BACK;
			bus_emit_event(bus, emit,
				       (struct event){ .id = EVENT_SLAVE_BACK,
						       .slave_pos = (uint16_t)pos });
		}
		return;
	}
	sl->misses++;
	if (!sl->is_lost && sl->misses >= MISSES_LOST) {
		sl->is_lost = 1;
		sl->step = RECOVERY_FIND;
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
	if (access[0].wkc > 0 && second[0].wkc > 0) {
		error_counters_take(ec, 0, read[0], ERROR_PORT_BYTES);
		error_counters_take(ec, 0, read[1], ERROR_PORT_BYTES);
	}
	if (access[1].wkc > 0 && second[1].wkc > 0) {
		error_counters_take(ec, ERROR_LINKS, read[0] + ERROR_LINKS, ERROR_LINK_BYTES);
		error_counters_take(ec, ERROR_LINKS, read[1] + ERROR_LINKS, ERROR_LINK_BYTES);
	}
}

static void count_errors(struct bus *bus, size_t pos, const struct look *look)
{
	struct bus_slave *sl = &bus->slave[pos];
	int wants_clear = 0;

	if (sl->step == RECOVERY_IDENTIFY) {
		return; /* it may be another's */
	}
	if (look->wkc[LOOK_ERRORS] > 0) {
		wants_clear = error_counters_take(&sl->errors, 0, look->errors, ERROR_PORT_BYTES);
	}
	if (look->wkc[LOOK_LOST_LINKS] > 0) {
		wants_clear |= error_counters_take(&sl->errors, ERROR_LINKS, look->lost_links,
						   ERROR_LINK_BYTES);
	}
	if (wants_clear) {
		clear_errors(bus, pos);
	}
}

/* No request is pending, for they are answered one at a time: the message is unsolicited. */
static int has_mail(const struct bus *bus, size_t pos, const struct look *look)
{
	const struct bus_slave *sl = &bus->slave[pos];

	return look->wkc[LOOK_MAILBOX] > 0 && (look->mailbox & SM_STATUS_FULL) != 0 &&
	       !sl->is_lost && sl->step == RECOVERY_NONE && bus_has_coe(bus, pos);
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
	if (look->wkc[LOOK_AL] > 0) {
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
	atomic_store_explicit(
		&page->dc_diff_ns,
		look->wkc[LOOK_DIFF] > 0 ? (int32_t)(get_le32(look->diff) & DIFF_MAGNITUDE) : -1,
		memory_order_relaxed);
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

		if ((!is_in_op(sl) && sl->misses == 0) || sl->step != RECOVERY_NONE) {
			bus_recover(bus, pos, &out);
			steps++;
		}
	}
	bus->next_recovery += steps > 0 ? steps : 1;
	bus->is_looking = 0;
}

int bus_watch(struct bus *bus, struct status_page *page,
	      void (*emit)(void *ctx, const struct event *ev), void *emit_ctx,
	      struct bus_watch_report *ret_report)
{
	const struct bus_emit out = { .call = emit, .ctx = emit_ctx };
	struct look look[LIMIT_SLAVES] = { 0 };
	int64_t time_ns;
	int r;

	bus->error = NULL;
	bus->is_looking = 1;
	r = look_at_all(bus, look);
	for (size_t i = 0; i < bus->slave_count; i++) {
		int is_here = look[i].wkc[LOOK_AL] > 0;

		note_presence(bus, i, is_here, &out);
		if (is_here) {
			note_state(bus, i, &look[i], &out);
			count_errors(bus, i, &look[i]);
		}
		if (has_mail(bus, i, &look[i])) {
			bus_read_mail(bus, i);
		}
		if (page != NULL) {
			show(&bus->slave[i], &look[i], &page->slave[i]);
		}
	}
	if (bus->plan.dc_reference != 0 && !bus->slave[bus->reference].is_lost &&
	    bus->slave[bus->reference].step == RECOVERY_NONE) {
		bus_reference_time(bus, &time_ns);
	}
	bus->is_looking = 0;
	*ret_report = (struct bus_watch_report){ 0 };
	for (size_t i = 0; i < bus->slave_count; i++) {
		if (is_in_op(&bus->slave[i])) {
			ret_report->slaves_op++;
			slave_set_add(&ret_report->in_op, (unsigned)i);
		}
		ret_report->slaves_lost += bus->slave[i].is_lost ? 1 : 0;
	}
	ret_report->is_reference_op =
		bus->plan.dc_reference == 0 || is_in_op(&bus->slave[bus->reference]);
	ret_report->is_all_op = ret_report->slaves_op == bus->slave_count;
	return r < 0 ? r : 0;
}
