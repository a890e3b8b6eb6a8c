/* SPDX-License-Identifier: MIT */
#include "al.h"

#include "esc_register.h"
#include "foe.h"
#include "mailbox.h"
#include "objects.h"
#include "pdo.h"
#include "spi.h"
#include "sync0.h"

enum { AL_STATE = 0x0f, AL_ACKNOWLEDGE = 0x10, AL_ERROR_FLAG = 0x10 };

static void show(struct piccolo *p)
{
	uint16_t status = (uint16_t)p->al.state;

	if (p->al.has_error) {
		status |= AL_ERROR_FLAG;
	}
	piccolo_esc_write16(p, REG_AL_STATUS_CODE, p->al.code);
	piccolo_esc_write16(p, REG_AL_STATUS, status);
}

/* One SyncManager as the master set it against the description. */
static int sm_fits(struct piccolo *p, enum piccolo_sm_index index, octet_t *ret_control)
{
	const struct piccolo_sm *wanted = &piccolo_description.sm[index];
	octet_t sm[SM_OCTETS];

	piccolo_esc_read(p, (uint16_t)(REG_SM + SM_OCTETS * (unsigned)index), sm, SM_OCTETS);
	*ret_control = sm[SM_OFFSET_CONTROL];
	return octets_get16(sm) == wanted->start && octets_get16(sm + 2) == wanted->length &&
	       (sm[SM_OFFSET_CONTROL] & SM_CONTROL_KIND) == (wanted->control & SM_CONTROL_KIND) &&
	       (sm[SM_OFFSET_ACTIVATE] & SM_ACTIVATE_ENABLE) != 0;
}

/* The mailboxes of BOOT are the same; only the code differs. */
static enum piccolo_al_code check_mailbox(struct piccolo *p, enum piccolo_al_code code)
{
	octet_t control;

	if (!sm_fits(p, PICCOLO_SM_MAILBOX_OUT, &control) ||
	    !sm_fits(p, PICCOLO_SM_MAILBOX_IN, &control)) {
		return code;
	}
	return AL_OK;
}

static enum piccolo_al_code check_process_data(struct piccolo *p)
{
	octet_t control;

	if (!p->rx_assigned || !sm_fits(p, PICCOLO_SM_OUTPUTS, &control)) {
		return AL_INVALID_OUTPUT_CONFIG;
	}
	p->is_watchdog_used = OCTET((control & SM_CONTROL_WATCHDOG) != 0);
	if (!p->tx_assigned || !sm_fits(p, PICCOLO_SM_INPUTS, &control)) {
		return AL_INVALID_INPUT_CONFIG;
	}
	return AL_OK;
}

/*
 * The SYNC unit must be set up before SAFEOP: running under the master's hand in periodic mode,
 * given to us (0x0980 bit 0) in one-shot mode. The first edge may still lie in the future.
 */
static enum piccolo_al_code check_sync(struct piccolo *p)
{
	octet_t unit[2], period[4];
	int is_ours;

	piccolo_esc_read(p, REG_DC_CYCLIC_CONTROL, unit, 2);
	is_ours = (unit[0] & CYCLIC_CONTROL_PDI) != 0;
	if (p->mode == PICCOLO_ONESHOT) {
		return is_ours ? AL_OK : AL_INVALID_DC_SYNC_CONFIG;
	}
	if (is_ours || (unit[1] & ACTIVATION_CYCLIC_SYNC0) != ACTIVATION_CYCLIC_SYNC0) {
		return AL_INVALID_DC_SYNC_CONFIG;
	}
	piccolo_esc_read(p, REG_DC_SYNC0_CYCLE, period, 4);
	p->sync0.cycle_ns = octets_get32(period);
	if (p->sync0.cycle_ns < PICCOLO_MIN_CYCLE_NS || p->sync0.cycle_ns > PICCOLO_MAX_CYCLE_NS) {
		return AL_INVALID_DC_CYCLE;
	}
	return AL_OK;
}

/* Stop what the lower state does not have, highest first. */
static void leave_to(struct piccolo *p, enum piccolo_state to)
{
	p->al.is_op_pending = 0;
	if (p->al.state == PICCOLO_OP && to != PICCOLO_OP) {
		piccolo_pdo_outputs_safe(p);
	}
	if (p->al.state >= PICCOLO_SAFEOP && to < PICCOLO_SAFEOP) {
		piccolo_sync0_stop(p);
	}
	if (p->al.state >= PICCOLO_PREOP && to == PICCOLO_INIT) {
		piccolo_mailbox_reset(p);
	}
}

static enum piccolo_al_code enter_preop(struct piccolo *p)
{
	enum piccolo_al_code code;

	if (p->al.state == PICCOLO_BOOT) {
		return AL_INVALID_STATE_CHANGE;
	}
	if (p->al.state != PICCOLO_INIT) {
		leave_to(p, PICCOLO_PREOP);
		piccolo_pdo_reset(p);
		return AL_OK;
	}
	code = check_mailbox(p, AL_INVALID_MAILBOX_CONFIG);
	if (code == AL_OK) {
		piccolo_mailbox_reset(p);
		piccolo_settings_reset(p);
		piccolo_pdo_reset(p);
	}
	return code;
}

/* BOOT is entered from INIT and left to INIT only. */
static enum piccolo_al_code enter_boot(struct piccolo *p)
{
	enum piccolo_al_code code;

	if (p->al.state == PICCOLO_BOOT) {
		return AL_OK;
	}
	if (p->al.state != PICCOLO_INIT) {
		return AL_INVALID_STATE_CHANGE;
	}
	code = check_mailbox(p, AL_INVALID_MAILBOX_CONFIG_BOOT);
	if (code == AL_OK) {
		piccolo_mailbox_reset(p);
		piccolo_foe_reset(p);
	}
	return code;
}

static enum piccolo_al_code enter_safeop(struct piccolo *p)
{
	enum piccolo_al_code code;

	if (p->al.state == PICCOLO_INIT || p->al.state == PICCOLO_BOOT) {
		return AL_INVALID_STATE_CHANGE;
	}
	if (p->al.state != PICCOLO_PREOP) {
		leave_to(p, PICCOLO_SAFEOP);
		return AL_OK;
	}
	code = check_process_data(p);
	if (code == AL_OK) {
		code = check_sync(p);
	}
	if (code == AL_OK) {
		piccolo_sync0_start(p);
		piccolo_pdo_start(p);
	}
	return code;
}

static enum piccolo_al_code enter_op(struct piccolo *p)
{
	if (p->al.state < PICCOLO_SAFEOP) {
		return AL_INVALID_STATE_CHANGE;
	}
	if (p->al.state == PICCOLO_SAFEOP && !p->al.is_op_pending) {
		p->al.is_op_pending = 1;
		p->al.op_since_us = p->hal.time_us(p->hal.ctx);
	}
	return AL_OK;
}

/* Enter the state that the master requests; on refusal the state stays. */
static enum piccolo_al_code change(struct piccolo *p, unsigned wanted)
{
	enum piccolo_al_code code = AL_OK;

	switch (wanted) {
	case PICCOLO_INIT:
		leave_to(p, PICCOLO_INIT);
		break;
	case PICCOLO_PREOP:
		code = enter_preop(p);
		break;
	case PICCOLO_SAFEOP:
		code = enter_safeop(p);
		break;
	case PICCOLO_OP:
		code = enter_op(p);
		break;
	case PICCOLO_BOOT:
		code = enter_boot(p);
		break;
	default: /* four bits of the wire, not an enum */
		return AL_UNKNOWN_STATE;
	}
	if (code == AL_OK && wanted != PICCOLO_OP) {
		p->al.state = (enum piccolo_state)wanted;
	}
	return code;
}

static void handle(struct piccolo *p, uint16_t control)
{
	enum piccolo_al_code code;

	p->al.control = control;
	if (p->al.has_error && (control & AL_ACKNOWLEDGE) == 0) {
		return; /* ETG.1000.6: no request counts until the error is acknowledged */
	}
	code = change(p, control & AL_STATE);
	if (code != AL_OK) {
		p->al.is_op_pending = 0;
	}
	p->al.has_error = OCTET(code != AL_OK);
	p->al.code = (uint16_t)code;
	show(p);
	if (p->al.state == PICCOLO_INIT && piccolo_foe_has_image(p)) {
		piccolo_foe_reset(p);
		p->hal.flash_start(p->hal.ctx);
	}
}

/* OP is shown when outputs and, in periodic mode, an edge of SYNC0 have come. */
static void finish_op(struct piccolo *p)
{
	int has_sync = p->mode == PICCOLO_ONESHOT || p->sync0.edges > 0;

	if (p->al_event & AL_EVENT_SM2) {
		p->has_outputs = 1;
	}
	if (has_sync && p->has_outputs) {
		p->al.is_op_pending = 0;
		p->al.state = PICCOLO_OP;
		show(p);
		return;
	}
	if (p->hal.time_us(p->hal.ctx) - p->al.op_since_us >= PICCOLO_OP_TIMEOUT_US) {
		piccolo_al_fail(p, PICCOLO_SAFEOP,
				has_sync ? AL_SM_WATCHDOG : AL_SYNC_NOT_RECEIVED);
	}
}

/* A SyncManager was switched off or on under us; reading the activation octets clears the event. */
static void check_sm_change(struct piccolo *p)
{
	enum piccolo_al_code code;
	octet_t activate[PICCOLO_SM_COUNT];
	unsigned i;

	for (i = 0; i < PICCOLO_SM_COUNT; i++) {
		activate[i] = piccolo_esc_read8(
			p, (uint16_t)(REG_SM + SM_OCTETS * i + SM_OFFSET_ACTIVATE));
	}
	if (p->al.state == PICCOLO_INIT) {
		return;
	}
	piccolo_mailbox_sm1_activated(p, activate[PICCOLO_SM_MAILBOX_IN]);
	code = check_mailbox(p, p->al.state == PICCOLO_BOOT ? AL_INVALID_MAILBOX_CONFIG_BOOT
							    : AL_INVALID_MAILBOX_CONFIG);
	if (code != AL_OK) {
		piccolo_al_fail(p, PICCOLO_INIT, code);
		return;
	}
	if (p->al.state == PICCOLO_PREOP || p->al.state == PICCOLO_BOOT) {
		return;
	}
	code = check_process_data(p);
	if (code != AL_OK) {
		piccolo_al_fail(p, PICCOLO_PREOP, code);
	}
}

void piccolo_al_start(struct piccolo *p)
{
	p->al.polled_us = p->hal.time_us(p->hal.ctx);
	show(p);
}

void piccolo_al_fail(struct piccolo *p, enum piccolo_state state, enum piccolo_al_code code)
{
	leave_to(p, state);
	if (state == PICCOLO_PREOP) {
		piccolo_pdo_reset(p);
	}
	p->al.state = state;
	p->al.has_error = 1;
	p->al.code = (uint16_t)code;
	show(p);
}

void piccolo_al_step(struct piccolo *p)
{
	uint32_t now_us = p->hal.time_us(p->hal.ctx);
	int is_event = (p->al_event & AL_EVENT_CONTROL) != 0;

	if (is_event || now_us - p->al.polled_us >= PICCOLO_AL_POLL_US) {
		uint16_t control = piccolo_esc_read16(p, REG_AL_CONTROL);

		p->al.polled_us = now_us;
		is_event |= (p->al_event & AL_EVENT_CONTROL) != 0;
		p->al_event = (uint16_t)(p->al_event & ~(unsigned)AL_EVENT_CONTROL);
		if (is_event || control != p->al.control) {
			handle(p, control);
		}
	} else if (p->al_event & AL_EVENT_SM_CHANGED) {
		check_sm_change(p);
		p->al_event = (uint16_t)(p->al_event & ~(unsigned)AL_EVENT_SM_CHANGED);
	}
	if (p->al.is_op_pending) {
		finish_op(p);
	}
}
