/* SPDX-License-Identifier: MIT */
/*
 * Requests of the admin socket that change the state of the bus or of one slave. None waits: a
 * rescan is done by whoever drives the session, the state of a slave is looked at in each pass.
 */
#include <errno.h>

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

/* --- one slave --- */

/* Each pass: is it there? */
static void poll_slave(struct admin_pending *pending, const struct admin_target *target)
{
	struct session *s = target->ctx;
	uint16_t pos = pending->request.slave_pos;
	uint16_t wanted = (uint16_t)pending->request.argument[0];
	uint8_t al[6] = { 0 };
	uint16_t status;
	char error[BUS_ERROR_BYTES];
	int r;

	if (s->bus == NULL) {
		admin_pending_refuse(pending, -ECANCELED, "the bus was taken down");
		return;
	}
	r = bus_slave_al_read(s->bus, pos, al, error);
	if (r < 0) {
		admin_pending_refuse(pending, r, "%s", error);
		return;
	}
	status = get_le16(al);
	pending->reply.data[0] = (uint8_t)status;
	pending->reply.data_len = 1;
	if ((status & (AL_STATE_MASK | AL_ERROR)) == wanted) {
		admin_pending_complete(pending, 0);
	} else if ((status & AL_ERROR) != 0) {
		admin_pending_refuse(pending, -EIO,
				     "slave %u: refuses %s and is in %s: AL status code 0x%04x, %s",
				     pos, al_state_to_str(wanted), al_state_to_str(status),
				     get_le16(al + 4), al_status_code_to_str(get_le16(al + 4)));
	}
}

static void abandon(struct admin_pending *pending)
{
	admin_pending_complete(pending, -ECANCELED);
}

static void change_one(struct session *s, struct admin_pending *pending)
{
	uint16_t wanted = (uint16_t)pending->request.argument[0];
	char error[BUS_ERROR_BYTES];
	int r;

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
	r = bus_slave_al_request(s->bus, pending->request.slave_pos, wanted, error);
	if (r < 0) {
		admin_pending_refuse(pending, r, "%s", error);
		return;
	}
	pending->poll = poll_slave;
	pending->cancel = abandon;
}

void session_bus_request(void *ctx, struct admin_pending *pending)
{
	struct session *s = ctx;
	int is_forced = pending->request.argument[1] != 0;

	s->operator_at = session_now(s);
	if (pending->request.verb == ADMIN_RESCAN) {
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
