/* SPDX-License-Identifier: MIT */
#include "devices/slave_application.h"

#include <errno.h>
#include <string.h>

#include "base/bytes.h"
#include "devices/aoe_server.h"
#include "devices/eeprom_emulation.h"
#include "devices/voe_server.h"
#include "wire/al.h"
#include "wire/esc_reg.h"

enum { SM_WATCHDOG_TRIGGER = 0x40 };

static uint8_t read8(struct slave_application *app, int64_t t_ns, unsigned reg)
{
	uint8_t value;

	esc_pdi_read(app->esc, t_ns, (uint16_t)reg, &value, 1);
	return value;
}

static void set_state(struct slave_application *app, int64_t t_ns, uint8_t state, uint16_t code)
{
	uint8_t status[2] = { state, 0 };
	uint8_t code_bytes[2];

	put_le16(code_bytes, code);
	esc_pdi_write(app->esc, t_ns, ESC_REG_AL_STATUS_CODE, code_bytes, 2);
	esc_pdi_write(app->esc, t_ns, ESC_REG_AL_STATUS, status, 2);
}

static void read_sm(struct slave_application *app, int64_t t_ns, size_t n, uint8_t *r)
{
	esc_pdi_read(app->esc, t_ns, (uint16_t)(ESC_REG_SM + n * ESC_SM_BYTES), r, ESC_SM_BYTES);
}

static int has_boot(const struct sii *sii)
{
	return (sii->mailbox_protocols & SII_MAILBOX_FOE) && sii->boot_out_len > 0 &&
	       sii->boot_in_len > 0;
}

static int sm_is(struct slave_application *app, int64_t t_ns, size_t n, uint16_t start,
		 uint32_t len)
{
	uint8_t r[ESC_SM_BYTES];

	read_sm(app, t_ns, n, r);
	return (r[6] & 1) && get_le16(r) == start && get_le16(r + 2) == len;
}

static uint16_t check_mailbox(struct slave_application *app, int64_t t_ns)
{
	for (size_t n = 0; n < app->sii->sm_count; n++) {
		uint8_t type = app->sii->sm[n].type;
		uint8_t r[ESC_SM_BYTES];

		if (type != SLAVE_SM_MAILBOX_OUT && type != SLAVE_SM_MAILBOX_IN) {
			continue;
		}
		read_sm(app, t_ns, n, r);
		if (!(r[6] & 1) || get_le16(r + 2) == 0) {
			return AL_CODE_INVALID_MAILBOX_CONFIG;
		}
	}
	return AL_CODE_NONE;
}

static uint16_t check_boot(struct slave_application *app, int64_t t_ns)
{
	const struct sii *sii = app->sii;

	if (!has_boot(sii)) {
		return AL_CODE_BOOT_NOT_SUPPORTED;
	}
	return sm_is(app, t_ns, 0, sii->boot_out_start, sii->boot_out_len) &&
			       sm_is(app, t_ns, 1, sii->boot_in_start, sii->boot_in_len)
		       ? AL_CODE_NONE
		       : AL_CODE_INVALID_MAILBOX_CONFIG_BOOT;
}

static uint16_t check_process_data(struct slave_application *app, int64_t t_ns)
{
	for (size_t n = 0; n < app->sii->sm_count; n++) {
		uint8_t type = app->sii->sm[n].type;
		uint32_t bits = coe_dictionary_sm_bits(&app->coe.dictionary, n);

		if (coe_dictionary_sm_has_twice(&app->coe.dictionary, n)) {
			return type == SLAVE_SM_OUTPUTS ? AL_CODE_INVALID_OUTPUT_MAPPING
							: AL_CODE_INVALID_INPUT_MAPPING;
		}
		if ((type == SLAVE_SM_OUTPUTS || type == SLAVE_SM_INPUTS) && bits > 0 &&
		    !sm_is(app, t_ns, n, app->sii->sm[n].start, (bits + 7) / 8)) {
			return type == SLAVE_SM_OUTPUTS ? AL_CODE_INVALID_OUTPUT_CONFIG
							: AL_CODE_INVALID_INPUT_CONFIG;
		}
	}
	return AL_CODE_NONE;
}

static uint16_t check_step(struct slave_application *app, int64_t t_ns, uint8_t from, uint8_t to)
{
	if (to != AL_INIT && to != AL_PREOP && to != AL_BOOT && to != AL_SAFEOP && to != AL_OP) {
		return AL_CODE_UNKNOWN_STATE;
	}
	if (to == AL_BOOT && !has_boot(app->sii)) {
		return AL_CODE_BOOT_NOT_SUPPORTED;
	}
	/* BOOT is entered from INIT and left to INIT only. */
	if ((to == AL_BOOT && from != AL_INIT && from != AL_BOOT) ||
	    (from == AL_BOOT && to != AL_INIT && to != AL_BOOT)) {
		return AL_CODE_INVALID_STATE_CHANGE;
	}
	if (to == AL_BOOT) {
		return check_boot(app, t_ns);
	}
	/* Up one step at a time, down as far as wanted. */
	if ((to == AL_SAFEOP && from == AL_INIT) ||
	    (to == AL_OP && from != AL_SAFEOP && from != AL_OP)) {
		return AL_CODE_INVALID_STATE_CHANGE;
	}
	if (to == AL_PREOP && from == AL_INIT) {
		return check_mailbox(app, t_ns);
	}
	if (to == AL_SAFEOP && from == AL_PREOP) {
		return check_process_data(app, t_ns);
	}
	return AL_CODE_NONE;
}

static void reset_servers(struct slave_application *app)
{
	foe_server_reset(&app->foe);
	soe_server_reset(&app->soe);
	eoe_server_reset(&app->eoe);
}

static void entered(struct slave_application *app, uint8_t from, uint8_t to)
{
	if (from == AL_INIT) {
		mailbox_reset(&app->mailbox);
		reset_servers(app);
		coe_dictionary_reset(&app->coe.dictionary);
	}
	app->coe.dictionary.is_preop = to == AL_PREOP;
}

static void handle_control(struct slave_application *app, int64_t t_ns)
{
	uint8_t status = read8(app, t_ns, ESC_REG_AL_STATUS);
	uint8_t from = status & AL_STATE_MASK;
	uint8_t control = read8(app, t_ns, ESC_REG_AL_CONTROL);
	uint8_t to = control & AL_STATE_MASK;
	uint16_t code;

	if ((status & AL_ERROR) && !(control & AL_ERROR) && to != AL_INIT) {
		return; /* an error has to be acknowledged first */
	}
	code = check_step(app, t_ns, from, to);
	if (code == AL_CODE_NONE) {
		set_state(app, t_ns, to, code);
		entered(app, from, to);
	} else {
		set_state(app, t_ns, (uint8_t)(from | AL_ERROR), code);
	}
}

/* Is an SM of outputs watched, and has nothing come for too long, or never? */
static int is_watchdog_down(struct slave_application *app, int64_t t_ns)
{
	for (size_t n = 0; n < app->sii->sm_count; n++) {
		uint8_t r[ESC_SM_BYTES];

		if (app->sii->sm[n].type != SLAVE_SM_OUTPUTS) {
			continue;
		}
		read_sm(app, t_ns, n, r);
		if ((r[6] & 1) && (r[4] & SM_WATCHDOG_TRIGGER)) {
			return !(read8(app, t_ns, ESC_REG_WATCHDOG_STATUS_PD) & 1);
		}
	}
	return 0;
}

static size_t answer_coe(void *ctx, const struct mailbox_call *call)
{
	struct slave_application *app = ctx;
	struct esc_mailbox_fault *fault = &app->esc->mailbox_fault;

	/* In the middle of a segmented transfer. */
	if (fault->kind == ESC_MAILBOX_ABORT && fault->count > 0 &&
	    (app->coe.target != NULL || app->coe.upload_pos < app->coe.upload_len)) {
		fault->count = 0;
		return coe_server_abort(&app->coe, call->answer);
	}
	return coe_server_answer(&app->coe, call->request, call->request_len, call->answer,
				 call->capacity);
}

/* In BOOT there is only FoE. */
static void run_mailbox(struct slave_application *app, int64_t t_ns, uint8_t state)
{
	const struct {
		uint16_t protocol;
		struct mailbox_server server;
	} all[] = {
		{ SII_MAILBOX_COE, { MAILBOX_TYPE_COE, answer_coe, NULL, app } },
		{ SII_MAILBOX_FOE, { MAILBOX_TYPE_FOE, foe_server_answer, NULL, &app->foe } },
		{ SII_MAILBOX_SOE,
		  { MAILBOX_TYPE_SOE, soe_server_answer, soe_server_next, &app->soe } },
		{ SII_MAILBOX_EOE,
		  { MAILBOX_TYPE_EOE, eoe_server_answer, eoe_server_next, &app->eoe } },
		{ SII_MAILBOX_AOE,
		  { MAILBOX_TYPE_AOE, aoe_server_answer, NULL, &app->coe.dictionary } },
		{ SII_MAILBOX_VOE, { MAILBOX_TYPE_VOE, voe_server_answer, NULL, NULL } },
	};
	struct mailbox_server server[sizeof(all) / sizeof(all[0])];
	unsigned protocols = app->sii->mailbox_protocols;
	size_t count = 0;

	if (state == AL_BOOT) {
		protocols &= SII_MAILBOX_FOE;
	}
	for (size_t i = 0; i < sizeof(all) / sizeof(all[0]); i++) {
		if (all[i].protocol & protocols) {
			server[count++] = all[i].server;
		}
	}
	if (count > 0) {
		mailbox_run(&app->mailbox, app->esc, t_ns, server, count);
	}
}

void slave_application_run(struct slave_application *app, int64_t t_ns)
{
	uint8_t state;

	eeprom_emulation_run(app->esc, t_ns);
	if (app->esc->al_event & ESC_AL_EVENT_CONTROL) {
		handle_control(app, t_ns);
	}
	state = slave_application_state(app, t_ns);
	if (state != AL_INIT) {
		run_mailbox(app, t_ns, state);
	}
	if (state == AL_OP && is_watchdog_down(app, t_ns)) {
		set_state(app, t_ns, AL_SAFEOP | AL_ERROR, AL_CODE_SM_WATCHDOG);
	}
}

/* --- public --- */

void slave_application_init(struct slave_application *app, const struct sii *sii, const char *name)
{
	app->sii = sii;
	app->esc = NULL;
	coe_dictionary_init(&app->coe.dictionary, sii, name);
}

void slave_application_done(struct slave_application *app)
{
	foe_server_done(&app->foe);
	coe_server_done(&app->coe);
}

int slave_application_set(struct slave_application *app, const char *key, const char *value)
{
	if (strncmp(key, "foe.", 4) == 0) {
		return foe_server_set(&app->foe, key + 4, value);
	}
	if (strncmp(key, "coe.", 4) == 0) {
		return coe_server_set(&app->coe, key + 4, value);
	}
	return -EINVAL;
}

void slave_application_power_on(struct slave_application *app, struct esc *esc)
{
	app->esc = esc;
	mailbox_reset(&app->mailbox);
	reset_servers(app);
	coe_dictionary_reset(&app->coe.dictionary);
	app->coe.dictionary.is_preop = 0;
}

uint8_t slave_application_state(struct slave_application *app, int64_t t_ns)
{
	return read8(app, t_ns, ESC_REG_AL_STATUS) & AL_STATE_MASK;
}

int slave_application_sm(struct slave_application *app, int64_t t_ns, size_t n, uint16_t *ret_start,
			 uint16_t *ret_len)
{
	uint8_t r[ESC_SM_BYTES];

	read_sm(app, t_ns, n, r);
	if (!(r[6] & 1) || get_le16(r + 2) == 0) {
		return 0;
	}
	*ret_start = get_le16(r);
	*ret_len = get_le16(r + 2);
	return 1;
}
