/* SPDX-License-Identifier: MIT */
/*
 * The way of one slave back to OP, as far as it comes in a call: INIT, PRE-OP, set up, its clock
 * set by those that run, SYNC0 into the common grid, SAFE-OP, OP (T18). Others are not disturbed:
 * every access goes to this slave's address. The table below has the order, the state each step
 * asks for and its time-out.
 *
 * A slave that refuses, does not arrive in time or falls back at once is tried again after 1, 2, 4
 * ... 30 s, as often as bus.recovery_attempts says; then, and at once for what no repetition can
 * cure, it is left alone until an operator clears the alarm or the slave is power-cycled.
 */
#include <errno.h>
#include <stdio.h>

#include "base/bytes.h"
#include "bus/bus_internal.h"
#include "bus/registers.h"

enum { GOOD_LOOKS = 4, PAUSE_MAX_S = 30 };

#define SETUP_NS (5 * NS_PER_S)
#define SYNC0_NS (2 * NS_PER_S)
/* In OP for so long, its troubles are over. */
#define STABLE_NS (10 * NS_PER_S)

enum step_timeout {
	TIMEOUT_NONE,
	TIMEOUT_INIT,
	TIMEOUT_PREOP,
	TIMEOUT_OP,
	TIMEOUT_SETUP,
	TIMEOUT_LOCK,
	TIMEOUT_SYNC0
};

/* What an act of a step says. */
enum progress { WAIT, DONE, FAILED };

static enum progress to_init(struct bus *bus, size_t pos);
static enum progress to_state(struct bus *bus, size_t pos);
static enum progress set_up(struct bus *bus, size_t pos);
static enum progress set_up_safeop(struct bus *bus, size_t pos);
static enum progress set_clock(struct bus *bus, size_t pos);
static enum progress settle(struct bus *bus, size_t pos);
static enum progress wait_sync0(struct bus *bus, size_t pos);

static const struct {
	enum progress (*act)(struct bus *bus, size_t pos);
	enum al_state state; /* it asks for */
	enum step_timeout timeout;
	enum recovery_step next; /* when it is done */
} steps[] = {
	[RECOVERY_INIT] = { to_init, AL_INIT, TIMEOUT_INIT, RECOVERY_PREOP },
	[RECOVERY_PREOP] = { to_state, AL_PREOP, TIMEOUT_PREOP, RECOVERY_SETUP },
	[RECOVERY_SETUP] = { set_up, AL_PREOP, TIMEOUT_SETUP, RECOVERY_CLOCK },
	[RECOVERY_CLOCK] = { set_clock, AL_NONE, TIMEOUT_LOCK, RECOVERY_SETTLE },
	[RECOVERY_SETTLE] = { settle, AL_NONE, TIMEOUT_LOCK, RECOVERY_SYNC0 },
	[RECOVERY_SYNC0] = { wait_sync0, AL_NONE, TIMEOUT_SYNC0, RECOVERY_SAFEOP },
	[RECOVERY_SAFEOP] = { to_state, AL_SAFEOP, TIMEOUT_OP, RECOVERY_SAFEOP_SETUP },
	[RECOVERY_SAFEOP_SETUP] = { set_up_safeop, AL_SAFEOP, TIMEOUT_SETUP, RECOVERY_OP },
	[RECOVERY_OP] = { to_state, AL_OP, TIMEOUT_OP, RECOVERY_NONE },
};

/* The configuration goes before the vendor's description. */
static int64_t first_set(int64_t configured_ns, int64_t esi_ns, int64_t default_ns)
{
	return configured_ns != 0 ? configured_ns : esi_ns != 0 ? esi_ns : default_ns;
}

static int64_t timeout_ns(const struct bus *bus, size_t pos, enum step_timeout timeout)
{
	const struct config_slave *want = bus_config_slave(bus, pos);
	const struct bus_slave *sl = &bus->slave[pos];

	switch (timeout) {
	case TIMEOUT_INIT:
		return first_set(want != NULL ? want->preop_timeout_ns : 0, sl->esi.back_to_init_ns,
				 CONFIG_PREOP_TIMEOUT_NS);
	case TIMEOUT_PREOP:
		return first_set(want != NULL ? want->preop_timeout_ns : 0, sl->esi.preop_ns,
				 CONFIG_PREOP_TIMEOUT_NS);
	case TIMEOUT_OP:
		return first_set(want != NULL ? want->op_timeout_ns : 0, sl->esi.op_ns,
				 bus->cfg->bus_op_timeout_ns);
	case TIMEOUT_SETUP:
		return SETUP_NS;
	case TIMEOUT_LOCK:
		return bus->cfg->dc_lock_timeout_ns;
	case TIMEOUT_SYNC0:
		return SYNC0_NS;
	case TIMEOUT_NONE:
		break;
	}
	return INT64_MAX / 2;
}

static void enter_at(struct bus *bus, size_t pos, enum recovery_step step, mono_t at)
{
	struct bus_slave *sl = &bus->slave[pos];
	int64_t span_ns = step > RECOVERY_BACK ? timeout_ns(bus, pos, steps[step].timeout) : 0;

	sl->step = step;
	sl->accepted = AL_NONE;
	sl->step_deadline = mono_add(at, (span_t){ span_ns });
	if (step == RECOVERY_SETUP) {
		bus_startup_begin(bus, pos, CONFIG_TRANSITION_IP);
	} else if (step == RECOVERY_SAFEOP_SETUP) {
		bus_startup_begin(bus, pos, CONFIG_TRANSITION_SO);
	}
}

static void enter(struct bus *bus, size_t pos, enum recovery_step step)
{
	enter_at(bus, pos, step, bus_now(bus));
}

static enum al_state state_of(const struct bus_slave *sl)
{
	return (enum al_state)(sl->al_status & AL_STATE_MASK);
}

static int has_error(const struct bus_slave *sl)
{
	return (sl->al_status & AL_ERROR) != 0;
}

/* The slave takes a request when it has read the one before; else WKC is 0. */
static void ask(struct bus *bus, size_t pos, unsigned control)
{
	uint8_t word[2];

	put_le16(word, (uint16_t)control);
	if (register_write(bus, pos, ESC_REG_AL_CONTROL, word, sizeof(word)) == 0) {
		bus->slave[pos].accepted = (enum al_state)(control & AL_STATE_MASK);
	}
}

/* --- failures --- */

/* No repetition cures these: configuration or EEPROM. */
static int needs_a_person(uint16_t code)
{
	return code == AL_CODE_INVALID_DC_SYNC_CONFIG || code == AL_CODE_DC_INVALID_SYNC_CYCLE ||
	       code == AL_CODE_EEPROM_NO_ACCESS || code == AL_CODE_EEPROM_ERROR;
}

static void emit_alarm(struct bus *bus, size_t pos, const struct bus_emit *emit)
{
	const struct bus_slave *sl = &bus->slave[pos];

	bus_emit_event(bus, emit,
		       (struct event){ .id = EVENT_SLAVE_ALARM,
				       .slave_pos = (uint16_t)pos,
				       .arg = { sl->al_status, (int32_t)sl->attempts },
				       .value = sl->trouble_code });
}

/* One attempt has failed, with AL status @code or 0: pause, or give up. */
static void fail(struct bus *bus, size_t pos, enum recovery_step resume, uint16_t code,
		 const struct bus_emit *emit)
{
	struct bus_slave *sl = &bus->slave[pos];
	int64_t pause_s = sl->attempts < 5 ? INT64_C(1) << sl->attempts : PAUSE_MAX_S;

	sl->trouble_step = sl->step;
	sl->trouble_code = code;
	sl->attempts++;
	sl->retry_at = mono_add(bus_now(bus), (span_t){ pause_s * NS_PER_S });
	sl->is_latched = needs_a_person(code) || sl->attempts >= bus->cfg->bus_recovery_attempts;
	if (sl->is_latched) {
		emit_alarm(bus, pos, emit);
	}
	enter_at(bus, pos, resume, sl->retry_at);
}

/* --- states --- */

static void program_mailbox(struct bus *bus, size_t pos)
{
	const ec_slavet *soem = &bus->soem_slave[soem_index(pos)];

	if (soem->mbx_l > 0) {
		register_write(bus, pos, ESC_REG_SM, &soem->SM[0], 2 * ESC_SM_BYTES);
	}
	bus_mailbox_set(bus, pos);
	ecx_eeprom2pdi(&bus->context, soem_index(pos));
}

static enum progress to_init(struct bus *bus, size_t pos)
{
	if (state_of(&bus->slave[pos]) != AL_INIT || has_error(&bus->slave[pos])) {
		ask(bus, pos, AL_INIT | AL_ERROR);
		return WAIT;
	}
	program_mailbox(bus, pos);
	return DONE;
}

/* An accepted request is not repeated: a slave may need seconds for it. */
static enum progress to_state(struct bus *bus, size_t pos)
{
	const struct bus_slave *sl = &bus->slave[pos];
	enum al_state state = steps[sl->step].state;

	if (has_error(sl)) {
		if (sl->accepted == state) {
			return FAILED;
		}
		ask(bus, pos, (unsigned)state_of(sl) | AL_ERROR);
	} else if (state_of(sl) == state) {
		return DONE;
	} else if (sl->accepted != state) {
		ask(bus, pos, state);
	}
	return WAIT;
}

static int has_clock(const struct bus *bus, size_t pos)
{
	return bus->plan.dc_reference != 0 && bus->slave[pos].clock.kind == CLOCK_SYSTEM_TIME;
}

static int needs_clock(const struct bus *bus, size_t pos)
{
	return has_clock(bus, pos) && !bus->slave[pos].is_clock_set;
}

/* Start-up SDOs, with their failure kept in words. 1 they run; 0; -errno. */
static int poll_startup(struct bus *bus, size_t pos, enum config_transition transition)
{
	char *error = bus->error;
	int r;

	bus->error = bus->slave[pos].startup.trouble;
	r = bus_startup_poll(bus, pos, transition);
	bus->error = error;
	return r;
}

/* What it was given in PRE-OP before is gone: both transitions. */
static enum progress set_up(struct bus *bus, size_t pos)
{
	int r;

	if (bus->slave[pos].startup.transition == CONFIG_TRANSITION_IP) {
		r = poll_startup(bus, pos, CONFIG_TRANSITION_IP);
		if (r == 0) {
			bus_startup_begin(bus, pos, CONFIG_TRANSITION_PS);
		}
		return r < 0 ? FAILED : WAIT;
	}
	r = poll_startup(bus, pos, CONFIG_TRANSITION_PS);
	if (r == 0) {
		r = bus_restore_mapping(bus, pos);
	}
	if (r < 0) {
		return FAILED;
	}
	return r > 0 ? WAIT : DONE;
}

static enum progress set_up_safeop(struct bus *bus, size_t pos)
{
	int r = poll_startup(bus, pos, CONFIG_TRANSITION_SO);

	return r < 0 ? FAILED : r > 0 ? WAIT : DONE;
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

static enum progress set_clock(struct bus *bus, size_t pos)
{
	if (is_follower(bus, pos) && !is_reference_set(bus)) {
		/* Not this slave's fault: its time begins when the reference is there. */
		enter(bus, pos, RECOVERY_CLOCK);
		return WAIT;
	}
	bus->slave[pos].good_looks = 0;
	return bus_clock_restore(bus, pos) >= 0 ? DONE : WAIT;
}

/* Near once may be in passing: clocks that settle swing. */
static enum progress settle(struct bus *bus, size_t pos)
{
	struct bus_slave *sl = &bus->slave[pos];

	sl->good_looks = is_clock_near(bus, pos) ? sl->good_looks + 1 : 0;
	if (sl->good_looks < GOOD_LOOKS && is_follower(bus, pos)) {
		return WAIT;
	}
	return bus_sync0_restore(bus, pos) >= 0 ? DONE : WAIT;
}

static enum progress wait_sync0(struct bus *bus, size_t pos)
{
	return !bus_sync0_is_wanted(bus, pos) || bus_sync0_is_running(bus, pos) == 1 ? DONE : WAIT;
}

/* --- where the way begins --- */

static void choose_with_clock(struct bus *bus, size_t pos)
{
	if (is_follower(bus, pos) && !is_reference_set(bus)) {
		return;
	}
	if (needs_clock(bus, pos) || !is_clock_near(bus, pos)) {
		enter(bus, pos, RECOVERY_CLOCK);
	} else if (bus_sync0_is_wanted(bus, pos) && bus_sync0_is_running(bus, pos) == 0) {
		enter(bus, pos, RECOVERY_SETTLE);
	} else {
		enter(bus, pos,
		      state_of(&bus->slave[pos]) == AL_OP ? RECOVERY_NONE : RECOVERY_SAFEOP_SETUP);
	}
}

/* A slave that answers but is not in OP. */
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
		choose_with_clock(bus, pos);
		return;
	case AL_PREOP:
		enter(bus, pos, RECOVERY_SETUP);
		return;
	case AL_NONE:
	case AL_INIT:
	case AL_BOOT:
		break;
	}
	enter(bus, pos, RECOVERY_INIT); /* also from a number that is no state */
}

/* The first fall is followed at once; another one before it was stable has the same cause. */
static void note_fall(struct bus *bus, size_t pos, const struct bus_emit *emit)
{
	struct bus_slave *sl = &bus->slave[pos];

	if (has_error(sl) && (needs_a_person(sl->al_code) || sl->is_unstable)) {
		fail(bus, pos, RECOVERY_BACK, sl->al_code, emit);
		return;
	}
	sl->is_unstable |= has_error(sl);
	sl->trouble_step = RECOVERY_NONE;
	sl->trouble_code = has_error(sl) ? sl->al_code : 0;
	sl->step = RECOVERY_BACK;
}

/* --- public --- */

void bus_recover_begin(struct bus *bus, size_t pos, const struct bus_emit *emit)
{
	struct bus_slave *sl = &bus->slave[pos];

	if (sl->is_lost) {
		sl->is_lost = 0;
		sl->misses = 0;
		sl->step = RECOVERY_BACK;
		bus_emit_event(
			bus, emit,
			(struct event){ .id = EVENT_SLAVE_BACK, .slave_pos = (uint16_t)pos });
	}
}

void bus_recover_settled(struct bus *bus, size_t pos)
{
	struct bus_slave *sl = &bus->slave[pos];

	if (!sl->is_unstable && sl->attempts == 0) {
		return;
	}
	if (sl->op_since.ns == 0) {
		sl->op_since = bus_now(bus);
	} else if (mono_sub(bus_now(bus), sl->op_since).ns > STABLE_NS) {
		bus_recover_forget(sl);
	}
}

void bus_recover_forget(struct bus_slave *sl)
{
	sl->attempts = 0;
	sl->is_unstable = 0;
	sl->is_latched = 0;
	sl->trouble_code = 0;
	sl->startup.trouble[0] = '\0';
	sl->retry_at = (mono_t){ 0 };
}

void bus_recover_restart(struct bus *bus, size_t pos)
{
	bus_recover_forget(&bus->slave[pos]);
	enter(bus, pos, RECOVERY_INIT);
}

void bus_clear_alarms(struct bus *bus)
{
	for (size_t i = 0; i < bus->slave_count; i++) {
		bus_recover_forget(&bus->slave[i]);
	}
}

/* A slave that restarted on its way back is in PRE-OP without what was set before: SAFE-OP without
 * SYNC0 is AL status code 0x0030. */
static enum recovery_step next_step(struct bus *bus, size_t pos)
{
	enum recovery_step step = bus->slave[pos].step;

	if (step != RECOVERY_SETUP || needs_clock(bus, pos)) {
		return steps[step].next;
	}
	if (is_reference_set(bus) && !is_clock_near(bus, pos)) {
		return RECOVERY_CLOCK;
	}
	return bus_sync0_is_wanted(bus, pos) && bus_sync0_is_running(bus, pos) == 0
		       ? RECOVERY_SETTLE
		       : RECOVERY_SAFEOP;
}

void bus_recover(struct bus *bus, size_t pos, const struct bus_emit *emit)
{
	struct bus_slave *sl = &bus->slave[pos];

	sl->op_since = (mono_t){ 0 };
	if (sl->is_lost || sl->is_latched || bus_now(bus).ns < sl->retry_at.ns) {
		return;
	}
	if (sl->step == RECOVERY_NONE) {
		note_fall(bus, pos, emit);
		if (sl->is_latched || bus_now(bus).ns < sl->retry_at.ns) {
			return;
		}
	}
	if (sl->step == RECOVERY_BACK) {
		choose_way(bus, pos);
		return;
	}
	while (sl->step > RECOVERY_BACK) {
		enum progress progress = steps[sl->step].act(bus, pos);

		if (progress == FAILED) {
			fail(bus, pos, RECOVERY_BACK, has_error(sl) ? sl->al_code : 0, emit);
			return;
		}
		if (progress == WAIT) {
			if (bus_now(bus).ns >= sl->step_deadline.ns) {
				fail(bus, pos, RECOVERY_INIT, 0, emit);
			}
			return;
		}
		enter(bus, pos, next_step(bus, pos));
	}
}

/* --- in words --- */

static void describe_attempts(const struct bus *bus, const struct bus_slave *sl, char *text,
			      size_t text_bytes)
{
	int64_t wait_ns = mono_sub(sl->retry_at, bus_now(bus)).ns;

	text[0] = '\0';
	if (sl->is_latched) {
		snprintf(text, text_bytes, "; not tried again: clear the alarm (ecdaq clear)");
	} else if (wait_ns > 0) {
		snprintf(text, text_bytes, "; attempt %u of %u in %lld s", sl->attempts + 1,
			 bus->cfg->bus_recovery_attempts,
			 (long long)((wait_ns + NS_PER_S - 1) / NS_PER_S));
	}
}

static enum al_state wanted_state(const struct bus_slave *sl)
{
	enum recovery_step step = sl->trouble_step > RECOVERY_BACK ? sl->trouble_step : sl->step;

	return step > RECOVERY_BACK && steps[step].state != AL_NONE ? steps[step].state : AL_OP;
}

void bus_recover_describe(const struct bus *bus, size_t pos, char *ret_text, size_t text_bytes)
{
	const struct bus_slave *sl = &bus->slave[pos];
	char why[128];
	char attempts[64];

	ret_text[0] = '\0';
	if (sl->is_lost || sl->misses > 0) {
		snprintf(ret_text, text_bytes, "slave %zu (%s): does not answer", pos,
			 sl->info.name);
		return;
	}
	if (sl->startup.trouble[0] != '\0') {
		describe_attempts(bus, sl, attempts, sizeof(attempts));
		snprintf(ret_text, text_bytes, "%s%s", sl->startup.trouble, attempts);
		return;
	}
	if (sl->trouble_code != 0) {
		bus_describe_refusal(sl->al_status, sl->trouble_code, wanted_state(sl), why,
				     sizeof(why));
	} else if (sl->step == RECOVERY_BACK) {
		snprintf(why, sizeof(why), "answers again"); /* its AL status is the old one */
	} else {
		snprintf(why, sizeof(why), "is in %s%s", bus_al_name(sl->al_status),
			 sl->attempts > 0 && sl->trouble_step != RECOVERY_NONE
				 ? " and did not arrive in time"
				 : "");
	}
	describe_attempts(bus, sl, attempts, sizeof(attempts));
	snprintf(ret_text, text_bytes, "slave %zu (%s): %s%s", pos, sl->info.name, why, attempts);
}
