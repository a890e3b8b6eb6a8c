/* SPDX-License-Identifier: MIT */
/*
 * AL states: request them of all slaves, wait while the cycle runs, and report who refused and why.
 * States are never compared by what a broadcast ORs together.
 */
#include <errno.h>
#include <stdio.h>

#include "base/bytes.h"
#include "bus/bus_internal.h"
#include "bus/places.h"
#include "bus/registers.h"

enum { AL_BYTES = 6, POLL_MS = 2, ACKNOWLEDGE_NS = 500000000 };
/* Polls without an answer after which a slave is left behind on the way down. */
enum { ABSENT_POLLS = 3 };
/* Each step of the way down: three of them and the cycle's last frames take less than a second. */
#define STOP_STEP_NS (150 * NS_PER_MS)

struct al_reading {
	uint8_t bytes[AL_BYTES]; /* 0x0130 to 0x0135: status, reserved, code */
	uint16_t wkc;
};

static uint16_t status_of(const struct al_reading *al)
{
	return get_le16(al->bytes);
}

static uint16_t code_of(const struct al_reading *al)
{
	return get_le16(al->bytes + 4);
}

/*
 * AL control is a mailbox, too: a slave that has not read the last request yet does not take
 * another (WKC 0). Write to those that have not taken @state; @taken marks the others.
 */
static int write_control(struct bus *bus, enum al_state state, uint8_t *taken)
{
	struct access access[LIMIT_SLAVES];
	size_t pos[LIMIT_SLAVES];
	size_t count = 0;
	uint8_t word[2];
	int r;

	put_le16(word, (uint16_t)state);
	for (size_t i = 0; i < bus->slave_count; i++) {
		if (taken[i]) {
			continue;
		}
		pos[count] = i;
		access[count++] = (struct access){ .cmd = ECAT_CMD_FPWR,
						   .adp = bus->slave[i].info.station_addr,
						   .reg = ESC_REG_AL_CONTROL,
						   .len = sizeof(word),
						   .data = word };
	}
	r = registers_run(bus, access, count);
	for (size_t i = 0; i < count && r >= 0; i++) {
		taken[pos[i]] = access[i].wkc == 1;
	}
	return r;
}

static int read_states(struct bus *bus, struct al_reading *al)
{
	struct access access[LIMIT_SLAVES];
	int r;

	for (size_t i = 0; i < bus->slave_count; i++) {
		access[i] = (struct access){ .cmd = ECAT_CMD_FPRD,
					     .adp = bus->slave[i].info.station_addr,
					     .reg = ESC_REG_AL_STATUS,
					     .len = AL_BYTES,
					     .data = al[i].bytes };
	}
	r = registers_run(bus, access, bus->slave_count);
	for (size_t i = 0; i < bus->slave_count; i++) {
		al[i].wkc = r < 0 ? 0 : access[i].wkc;
		if (al[i].wkc == 1) {
			bus->slave[i].al_status = status_of(&al[i]);
		}
	}
	return r;
}

static int is_in(const struct al_reading *al, enum al_state state)
{
	return al->wkc == 1 && (status_of(al) & (AL_STATE_MASK | AL_ERROR)) == (uint16_t)state;
}

static int has_error(const struct al_reading *al)
{
	return al->wkc == 1 && (status_of(al) & AL_ERROR) != 0;
}

/* The first slave that refuses, else the first that is not there yet. -1: all are in @state. */
static int find_culprit(const struct bus *bus, const struct al_reading *al, enum al_state state)
{
	int behind = -1;

	for (size_t i = 0; i < bus->slave_count; i++) {
		if (has_error(&al[i])) {
			return (int)i;
		}
		if (behind < 0 && !is_in(&al[i], state)) {
			behind = (int)i;
		}
	}
	return behind;
}

const char *bus_al_name(uint16_t al_status)
{
	switch (al_status & AL_STATE_MASK) {
	case AL_INIT:
	case AL_PREOP:
	case AL_BOOT:
	case AL_SAFEOP:
	case AL_OP:
		return al_state_to_str(al_status);
	default:
		return "an AL state that does not exist";
	}
}

void bus_describe_refusal(uint16_t al_status, uint16_t code, enum al_state wanted, char *ret_text,
			  size_t text_bytes)
{
	snprintf(ret_text, text_bytes, "refuses %s and is in %s: AL status code 0x%04x, %s",
		 al_state_to_str((uint16_t)wanted), bus_al_name(al_status), code,
		 al_status_code_to_str(code));
}

static int say_why(struct bus *bus, size_t pos, const struct al_reading *al, enum al_state state)
{
	char why[128];
	const char *wanted = al_state_to_str((uint16_t)state);

	if (al->wkc == 0) {
		return bus_fail_slave(bus, pos, -EIO, "does not answer on the way to %s", wanted);
	}
	if (al->wkc > 1) {
		return bus_fail_slave(bus, pos, -EIO,
				      "%u devices have its station address 0x%04x on the way to %s",
				      al->wkc, bus->slave[pos].info.station_addr, wanted);
	}
	if (has_error(al)) {
		bus_describe_refusal(status_of(al), code_of(al), state, why, sizeof(why));
		return bus_fail_slave(bus, pos, -ETIME, "%s", why);
	}
	return bus_fail_slave(bus, pos, -ETIME, "did not reach %s in time and is in %s", wanted,
			      bus_al_name(status_of(al)));
}

static int poll_pause(struct bus *bus)
{
	return line_sleep(bus->line, (span_t){ POLL_MS * NS_PER_MS });
}

/* An error of the past must not be taken for a refusal: acknowledge it, in the state it left. */
static int acknowledge_errors(struct bus *bus, mono_t give_up)
{
	struct al_reading al[LIMIT_SLAVES] = { 0 };

	for (;;) {
		unsigned errors = 0;
		int r = read_states(bus, al);

		for (size_t i = 0; i < bus->slave_count && r >= 0; i++) {
			uint8_t word[2];

			if (has_error(&al[i])) {
				errors++;
				put_le16(word, (status_of(&al[i]) & AL_STATE_MASK) | AL_ERROR);
				register_write(bus, i, ESC_REG_AL_CONTROL, word, sizeof(word));
			}
		}
		if (errors == 0 || bus_now(bus).ns >= give_up.ns || poll_pause(bus) < 0) {
			return r;
		}
	}
}

/* How slaves are led to a state. */
enum lead {
	LEAD_ALL,     /* each has to get there */
	LEAD_PRESENT, /* the way down: a slave that does not answer is not waited for */
};

/* 1 if nobody who answers is missing in @state. */
static int are_present_in(const struct bus *bus, const struct al_reading *al, enum al_state state)
{
	for (size_t i = 0; i < bus->slave_count; i++) {
		if (al[i].wkc > 0 && !is_in(&al[i], state)) {
			return 0;
		}
	}
	return 1;
}

static int wait_for(struct bus *bus, enum al_state state, enum lead lead, mono_t give_up)
{
	struct al_reading al[LIMIT_SLAVES] = { 0 };
	uint8_t taken[LIMIT_SLAVES] = { 0 };

	for (unsigned polls = 0;; polls++) {
		int r = write_control(bus, state, taken);
		int culprit = -1;
		int is_over;

		if (r >= 0) {
			r = read_states(bus, al);
		}
		is_over = bus_now(bus).ns >= give_up.ns;
		if (r >= 0) {
			culprit = find_culprit(bus, al, state);
			if (culprit < 0) {
				return 0;
			}
			is_over |= has_error(&al[culprit]) && taken[culprit];
			is_over |= lead == LEAD_PRESENT && polls >= ABSENT_POLLS &&
				   are_present_in(bus, al, state);
		}
		if (!is_over && r != -ECANCELED) {
			r = poll_pause(bus) < 0 ? -ECANCELED : r;
		}
		if (r == -ECANCELED) {
			return bus_fail(bus, r, "cancelled on the way to %s",
					al_state_to_str((uint16_t)state));
		}
		if (is_over) {
			return r < 0 ? bus_fail(bus, -EIO, "no frame returns on the way to %s",
						al_state_to_str((uint16_t)state))
				     : say_why(bus, (size_t)culprit, &al[culprit], state);
		}
	}
}

static int lead_to(struct bus *bus, enum al_state state, enum lead lead, span_t timeout)
{
	mono_t start = bus_now(bus);
	int64_t acknowledge_ns = timeout.ns / 2 < ACKNOWLEDGE_NS ? timeout.ns / 2 : ACKNOWLEDGE_NS;

	bus->target = state;
	acknowledge_errors(bus, mono_add(start, (span_t){ acknowledge_ns }));
	return wait_for(bus, state, lead, mono_add(start, timeout));
}

/* A slave whose vendor gives it longer is waited for as long. */
static span_t longest(const struct bus *bus, enum al_state state, span_t timeout)
{
	for (size_t i = 0; i < bus->slave_count; i++) {
		const struct esi_timeouts *esi = &bus->slave[i].esi;
		int64_t esi_ns = state == AL_INIT                       ? esi->back_to_init_ns
				 : state == AL_PREOP                    ? esi->preop_ns
				 : state == AL_SAFEOP || state == AL_OP ? esi->op_ns
									: 0;

		timeout.ns = esi_ns > timeout.ns ? esi_ns : timeout.ns;
	}
	return timeout;
}

int bus_request_state(struct bus *bus, enum al_state state, span_t timeout, char *error)
{
	bus->error = error;
	return lead_to(bus, state, LEAD_ALL, longest(bus, state, timeout));
}

int bus_slave_al_request(struct bus *bus, size_t pos, uint16_t request, char *error)
{
	uint8_t word[2];
	int r;

	bus->error = error;
	put_le16(word, request);
	r = register_write(bus, pos, ESC_REG_AL_CONTROL, word, sizeof(word));
	return r < 0 ? bus_fail_slave(bus, pos, r, "does not take a request for %s",
				      bus_al_name(request))
		     : 0;
}

int bus_slave_al_read(struct bus *bus, size_t pos, uint8_t ret_al[AL_BYTES], char *error)
{
	int r;

	bus->error = error;
	r = register_read(bus, pos, ESC_REG_AL_STATUS, ret_al, AL_BYTES);
	return r < 0 ? bus_fail_slave(bus, pos, r, "its AL status cannot be read") : 0;
}

/* A step down that continues after errors and keeps the first one. */
static int step_down(struct bus *bus, enum al_state state, int before, char *error)
{
	char later[BUS_ERROR_BYTES];
	int r;

	bus->error = before < 0 ? later : error;
	r = lead_to(bus, state, LEAD_PRESENT, (span_t){ STOP_STEP_NS });
	return before < 0 ? before : r;
}

static int is_line_dead(struct bus *bus)
{
	struct access access = { .cmd = ECAT_CMD_BRD, .reg = ESC_REG_AL_STATUS, .len = 2 };

	return registers_run(bus, &access, 1) < 0;
}

int bus_stop_outputs(struct bus *bus, char *error)
{
	return step_down(bus, AL_SAFEOP, 0, error);
}

/* A scan that was interrupted may have left slaves in PRE-OP. */
static void broadcast_init(struct bus *bus)
{
	uint8_t word[2];

	put_le16(word, AL_INIT | AL_ERROR);
	register_broadcast(bus, ESC_REG_AL_CONTROL, word, sizeof(word));
}

int bus_stop(struct bus *bus, char *error)
{
	int r = 0;

	bus->error = error;
	if (bus->slave_count == 0) {
		broadcast_init(bus);
		return 0;
	}
	if (is_line_dead(bus)) {
		return bus_fail(bus, -EIO,
				"no frame returns: the slaves are left to their watchdogs");
	}
	if (bus->target == AL_OP) {
		r = step_down(bus, AL_SAFEOP, r, error);
	}
	if (bus->target == AL_SAFEOP) {
		r = step_down(bus, AL_PREOP, r, error);
	}
	bus_sync0_stop(bus);
	bus_places_release(bus);
	return step_down(bus, AL_INIT, r, error);
}
