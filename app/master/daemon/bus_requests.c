/* SPDX-License-Identifier: MIT */
/*
 * Requests of the admin socket that change the state of the bus or of one slave. None waits: a
 * rescan is done by whoever drives the session, the state of a slave is looked at in each pass.
 */
#include <errno.h>
#include <stdio.h>

#include "base/bytes.h"
#include "daemon/session.h"
#include "daemon/session_internal.h"
#include "wire/al.h"

/* --- the whole bus --- */

/* Take down and bring up again. In OP that interrupts the outputs: only if it is asked for. */
static void restart(struct session *s, struct admin_pending *pending)
{
	if (s->restart != NULL) {
		admin_pending_refuse(pending, -EBUSY, "the bus is being brought up already");
		return;
	}
	s->restart = pending;
}

static int target_of(uint32_t al_state)
{
	switch (al_state) {
	case AL_INIT:
		return CONFIG_TARGET_INIT;
	case AL_PREOP:
		return CONFIG_TARGET_PREOP;
	case AL_SAFEOP:
		return CONFIG_TARGET_SAFEOP;
	case AL_OP:
		return CONFIG_TARGET_OP;
	default:
		return -EINVAL;
	}
}

static void change_all(struct session *s, struct admin_pending *pending)
{
	int target = target_of(pending->request.argument[0]);

	if (target < 0) {
		admin_pending_refuse(pending, -EINVAL, "BOOT is a state of one slave, not of all");
		return;
	}
	if (!s->is_held && s->state == BUS_OP && target == CONFIG_TARGET_OP) {
		admin_pending_complete(pending, 0);
		return;
	}
	restart(s, pending);
	if (s->restart == pending) {
		session_target_set(s, (enum config_target)target);
	}
}

void session_restart_done(struct session *s, const struct failure *failure)
{
	struct admin_pending *pending = s->restart;

	s->restart = NULL;
	if (pending == NULL) {
		return;
	}
	if (failure == NULL) {
		admin_pending_complete(pending, 0);
	} else {
		admin_pending_refuse(pending, failure->code == EXIT_CODE_OK ? -ECANCELED : -EIO,
				     "%s", failure->text);
	}
}

/* --- one slave, a frame in each pass --- */

/*
 * BOOT is entered from INIT and left to INIT only, and has mailboxes of its own: they are
 * programmed in INIT, as those of PRE-OP are on the way back. SyncManagers of process data and
 * start-up SDOs come before SAFE-OP, and SDOs before OP.
 */
enum change_step {
	CHANGE_LOOK,        /* where it is */
	CHANGE_ACKNOWLEDGE, /* an error of before, which would look like a refusal */
	CHANGE_WAIT_CLEAR,
	CHANGE_ASK_INIT,
	CHANGE_WAIT_INIT,
	CHANGE_PROGRAM, /* its mailboxes */
	CHANGE_SET_UP,  /* start-up SDOs, SyncManagers */
	CHANGE_ASK,
	CHANGE_WAIT,
};

static const char *slave_name(const struct session *s, uint16_t pos)
{
	size_t count;
	const struct slave_info *slaves = bus_slaves(s->bus, &count);

	return pos < count ? slaves[pos].name : "";
}

static enum change_step next_from(uint16_t from, uint16_t wanted)
{
	if (from == AL_INIT) {
		return wanted == AL_BOOT || wanted == AL_PREOP ? CHANGE_PROGRAM : CHANGE_ASK;
	}
	if ((from == AL_PREOP && wanted == AL_SAFEOP) || (from == AL_SAFEOP && wanted == AL_OP)) {
		return CHANGE_SET_UP;
	}
	return (from == AL_BOOT) != (wanted == AL_BOOT) && wanted != AL_INIT ? CHANGE_ASK_INIT
									     : CHANGE_ASK;
}

static int ask_for(const struct session *s, const struct admin_pending *pending, uint16_t state,
		   char *error)
{
	int r = bus_slave_al_request(s->bus, pending->request.slave_pos, state, error);

	return r < 0 ? r : state == AL_INIT ? CHANGE_WAIT_INIT : CHANGE_WAIT;
}

/* It has reached @state: the next step, or the end. */
static int reached(const struct session *s, struct admin_pending *pending, uint16_t state)
{
	uint16_t wanted = (uint16_t)pending->request.argument[0];

	bus_slave_mailbox_follow(s->bus, pending->request.slave_pos, state);
	if (state != wanted) {
		return (int)next_from(state, wanted);
	}
	admin_pending_complete(pending, 0);
	return CHANGE_WAIT;
}

/* Where is it? -EIO: it refuses what it was asked for. */
static int look(const struct session *s, struct admin_pending *pending, enum change_step step,
		char *error)
{
	uint16_t wanted = (uint16_t)pending->request.argument[0];
	uint16_t asked = step == CHANGE_WAIT_INIT ? AL_INIT : wanted;
	uint16_t pos = pending->request.slave_pos;
	uint8_t al[6] = { 0 };
	uint16_t status;
	int r = bus_slave_al_read(s->bus, pos, al, error);

	if (r < 0) {
		return r;
	}
	status = get_le16(al) & (AL_STATE_MASK | AL_ERROR);
	pending->reply.data[0] = (uint8_t)status;
	pending->reply.data_len = 1;
	if (step == CHANGE_LOOK || step == CHANGE_WAIT_CLEAR) {
		int next = step == CHANGE_LOOK ? CHANGE_ACKNOWLEDGE : CHANGE_WAIT_CLEAR;

		return status & AL_ERROR ? next : (int)next_from(status, wanted);
	}
	if (status == asked) {
		return reached(s, pending, asked);
	}
	if ((status & AL_ERROR) == 0) {
		return (int)step;
	}
	snprintf(error, BUS_ERROR_BYTES,
		 "slave %u (%s): refuses %s and is in %s: AL status code 0x%04x, %s", pos,
		 slave_name(s, pos), al_state_to_str(asked), al_state_to_str(status),
		 get_le16(al + 4), al_status_code_to_str(get_le16(al + 4)));
	return -EIO;
}

/* One step: the next one, or -errno with a line in @error. */
static int change(const struct session *s, struct admin_pending *pending, char *error)
{
	enum change_step step = (enum change_step)pending->sequence;
	uint16_t wanted = (uint16_t)pending->request.argument[0];
	int r;

	switch (step) {
	case CHANGE_ACKNOWLEDGE: /* look() has put it there */
		r = bus_slave_al_request(s->bus, pending->request.slave_pos, pending->reply.data[0],
					 error);
		return r < 0 ? r : CHANGE_WAIT_CLEAR;
	case CHANGE_ASK_INIT:
		return ask_for(s, pending, AL_INIT, error);
	case CHANGE_PROGRAM:
		r = bus_slave_mailbox_program(s->bus, pending->request.slave_pos, wanted, error);
		return r < 0 ? r : CHANGE_ASK;
	case CHANGE_SET_UP:
		r = bus_slave_set_up(s->bus, pending->request.slave_pos, wanted, error);
		return r < 0 ? r : r > 0 ? CHANGE_SET_UP : CHANGE_ASK;
	case CHANGE_ASK:
		return ask_for(s, pending, wanted, error);
	case CHANGE_LOOK:
	case CHANGE_WAIT_CLEAR:
	case CHANGE_WAIT_INIT:
	case CHANGE_WAIT:
		break;
	}
	return look(s, pending, step, error);
}

static void poll_slave(struct admin_pending *pending, const struct admin_target *target)
{
	const struct session *s = target->ctx;
	char error[BUS_ERROR_BYTES] = "";
	int r;

	if (s->bus == NULL) {
		admin_pending_refuse(pending, -ECANCELED, "the bus was taken down");
		return;
	}
	r = change(s, pending, error);
	if (r < 0) {
		admin_pending_refuse(pending, r, "%s", error);
	} else {
		pending->sequence = (uint64_t)r;
	}
}

static void abandon(struct admin_pending *pending)
{
	admin_pending_complete(pending, -ECANCELED);
}

static void change_one(const struct session *s, struct admin_pending *pending)
{
	uint16_t wanted = (uint16_t)pending->request.argument[0];
	uint16_t pos = pending->request.slave_pos;

	if (target_of(wanted) < 0 && wanted != AL_BOOT) {
		admin_pending_refuse(pending, -EINVAL, "%u is not an AL state", wanted);
		return;
	}
	if (!s->is_held) {
		admin_pending_refuse(pending, -EPERM,
				     "the bus is in operation, and its supervision would lead the "
				     "slave back: ecdaq state PREOP all first");
		return;
	}
	if (wanted == AL_BOOT && !bus_slave_has_boot(s->bus, pos)) {
		admin_pending_refuse(pending, -ENOTSUP,
				     "slave %u (%s): its SII gives no mailbox for BOOT: it has no "
				     "such state",
				     pos, slave_name(s, pos));
		return;
	}
	pending->sequence = CHANGE_LOOK;
	pending->poll = poll_slave;
	pending->cancel = abandon;
}

void session_bus_request(void *ctx, struct admin_pending *pending)
{
	struct session *s = ctx;
	int is_forced = pending->request.argument[1] != 0;

	if (pending->request.verb == ADMIN_CONFIG_RELOAD) {
		session_reload_request(s, pending); /* nobody's hands are on the bus */
		return;
	}
	s->operator_at = session_now(s);
	if (pending->request.verb == ADMIN_DATAGRAMS) {
		session_list_datagrams(s, pending);
	} else if (pending->request.verb == ADMIN_COMPARE) {
		session_compare_request(s, pending);
	} else if (pending->request.verb == ADMIN_STARTUP) {
		session_startup_request(s, pending);
	} else if (pending->request.verb == ADMIN_RESCAN) {
		if (!is_forced && !s->is_held && s->bus != NULL) {
			admin_pending_refuse(pending, -EPERM,
					     "the bus is in operation, and a rescan stops it: "
					     "--force");
			return;
		}
		restart(s, pending);
	} else if (pending->request.verb != ADMIN_STATE) {
		session_esc_request(s, pending);
	} else if (pending->request.slave_pos == ADMIN_ALL_SLAVES) {
		change_all(s, pending);
	} else {
		change_one(s, pending);
	}
}
