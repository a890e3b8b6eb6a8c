/* SPDX-License-Identifier: MIT */
/*
 * A slave that is nothing but its SII image. It goes through the AL states with the checks that
 * ETG.1000.6 asks of a simple slave, answers SDOs if its SII says CoE, falls back when its watchdog
 * is down, and its inputs count its passes. Where the EEPROM asks for device emulation the chip
 * does the states.
 */
#include <stdlib.h>
#include <string.h>

#include "base/bytes.h"
#include "sim/device.h"
#include "sim/devices/coe_server.h"
#include "sim/devices/mailbox.h"
#include "wire/al.h"
#include "wire/esc_reg.h"
#include "wire/sii.h"

enum {
	PASS_NS = 500000, /* its main loop */
	SM_OUTPUTS = 3,
	SM_INPUTS = 4,
	SM_MAILBOX_OUT = 1,
	SM_MAILBOX_IN = 2,
	SM_WATCHDOG_TRIGGER = 0x40,
	CONFIG_DEVICE_EMULATION = 0x01,
	INPUT_BYTES_MAX = 1024,
};

struct sii_device {
	struct sim_device dev;
	struct sii sii;
	struct coe_server coe;
	struct mailbox mailbox;
	int64_t next_ns;
	uint32_t count;
};

static struct sii_device *self(struct sim_device *dev)
{
	return (struct sii_device *)dev;
}

static int64_t next_wake_ns(const struct sim_device *dev)
{
	return ((const struct sii_device *)dev)->next_ns;
}

static uint8_t read8(struct sii_device *d, int64_t t_ns, unsigned reg)
{
	uint8_t value;

	esc_pdi_read(d->dev.esc, t_ns, (uint16_t)reg, &value, 1);
	return value;
}

/* --- AL states --- */

static void set_state(struct sii_device *d, int64_t t_ns, uint8_t state, uint16_t code)
{
	uint8_t status[2] = { state, 0 };
	uint8_t code_bytes[2];

	put_le16(code_bytes, code);
	esc_pdi_write(d->dev.esc, t_ns, ESC_REG_AL_STATUS_CODE, code_bytes, 2);
	esc_pdi_write(d->dev.esc, t_ns, ESC_REG_AL_STATUS, status, 2);
}

static void read_sm(struct sii_device *d, int64_t t_ns, size_t n, uint8_t *r)
{
	esc_pdi_read(d->dev.esc, t_ns, (uint16_t)(ESC_REG_SM + n * ESC_SM_BYTES), r, ESC_SM_BYTES);
}

static int sm_fits(struct sii_device *d, int64_t t_ns, size_t n, uint32_t len)
{
	uint8_t r[ESC_SM_BYTES];

	read_sm(d, t_ns, n, r);
	return (r[6] & 1) && get_le16(r) == d->sii.sm[n].start && get_le16(r + 2) == len;
}

static uint16_t check_mailbox(struct sii_device *d, int64_t t_ns)
{
	for (size_t n = 0; n < d->sii.sm_count; n++) {
		uint8_t type = d->sii.sm[n].type;
		uint8_t r[ESC_SM_BYTES];

		if (type != SM_MAILBOX_OUT && type != SM_MAILBOX_IN) {
			continue;
		}
		read_sm(d, t_ns, n, r);
		if (!(r[6] & 1) || get_le16(r + 2) == 0) {
			return AL_CODE_INVALID_MAILBOX_CONFIG;
		}
	}
	return AL_CODE_NONE;
}

static uint16_t check_process_data(struct sii_device *d, int64_t t_ns)
{
	for (size_t n = 0; n < d->sii.sm_count; n++) {
		uint8_t type = d->sii.sm[n].type;
		uint32_t bits = coe_dictionary_sm_bits(&d->coe.dictionary, n);

		if ((type == SM_OUTPUTS || type == SM_INPUTS) && bits > 0 &&
		    !sm_fits(d, t_ns, n, (bits + 7) / 8)) {
			return type == SM_OUTPUTS ? AL_CODE_INVALID_OUTPUT_CONFIG
						  : AL_CODE_INVALID_INPUT_CONFIG;
		}
	}
	return AL_CODE_NONE;
}

static uint16_t check_step(struct sii_device *d, int64_t t_ns, uint8_t from, uint8_t to)
{
	if (to == AL_BOOT) {
		return AL_CODE_BOOT_NOT_SUPPORTED;
	}
	if (to != AL_INIT && to != AL_PREOP && to != AL_SAFEOP && to != AL_OP) {
		return AL_CODE_UNKNOWN_STATE;
	}
	/* Up one step at a time, down as far as wanted. */
	if ((to == AL_SAFEOP && from == AL_INIT) ||
	    (to == AL_OP && from != AL_SAFEOP && from != AL_OP)) {
		return AL_CODE_INVALID_STATE_CHANGE;
	}
	if (to == AL_PREOP && from == AL_INIT) {
		return check_mailbox(d, t_ns);
	}
	if (to == AL_SAFEOP && from == AL_PREOP) {
		return check_process_data(d, t_ns);
	}
	return AL_CODE_NONE;
}

static void entered(struct sii_device *d, uint8_t from, uint8_t to)
{
	if (from == AL_INIT) {
		mailbox_reset(&d->mailbox);
		coe_dictionary_reset(&d->coe.dictionary);
	}
	d->coe.dictionary.is_preop = to == AL_PREOP;
}

static void handle_control(struct sii_device *d, int64_t t_ns)
{
	uint8_t status = read8(d, t_ns, ESC_REG_AL_STATUS);
	uint8_t from = status & AL_STATE_MASK;
	uint8_t control = read8(d, t_ns, ESC_REG_AL_CONTROL);
	uint8_t to = control & AL_STATE_MASK;
	uint16_t code;

	if ((status & AL_ERROR) && !(control & AL_ERROR) && to != AL_INIT) {
		return; /* an error has to be acknowledged first */
	}
	code = check_step(d, t_ns, from, to);
	if (code == AL_CODE_NONE) {
		set_state(d, t_ns, to, code);
		entered(d, from, to);
	} else {
		set_state(d, t_ns, (uint8_t)(from | AL_ERROR), code);
	}
}

/* Is an SM of outputs watched, and has nothing come for too long, or never? */
static int is_watchdog_down(struct sii_device *d, int64_t t_ns)
{
	for (size_t n = 0; n < d->sii.sm_count; n++) {
		uint8_t r[ESC_SM_BYTES];

		if (d->sii.sm[n].type != SM_OUTPUTS) {
			continue;
		}
		read_sm(d, t_ns, n, r);
		if ((r[6] & 1) && (r[4] & SM_WATCHDOG_TRIGGER)) {
			return !(read8(d, t_ns, ESC_REG_WATCHDOG_STATUS_PD) & 1);
		}
	}
	return 0;
}

static size_t service(void *ctx, unsigned type, const uint8_t *request, size_t request_len,
		      uint8_t *answer, size_t capacity)
{
	(void)type;
	return coe_server_answer(ctx, request, request_len, answer, capacity);
}

static void run_application(struct sii_device *d, int64_t t_ns)
{
	uint8_t state;

	if (d->dev.esc->al_event & ESC_AL_EVENT_CONTROL) {
		handle_control(d, t_ns);
	}
	state = read8(d, t_ns, ESC_REG_AL_STATUS) & AL_STATE_MASK;
	if (state != AL_INIT && (d->sii.mailbox_protocols & SII_MAILBOX_COE)) {
		mailbox_run(&d->mailbox, d->dev.esc, t_ns, service, &d->coe);
	}
	if (state == AL_OP && is_watchdog_down(d, t_ns)) {
		set_state(d, t_ns, AL_SAFEOP | AL_ERROR, AL_CODE_SM_WATCHDOG);
	}
}

/* --- inputs --- */

static void count_inputs(struct sii_device *d, int64_t t_ns)
{
	uint8_t bytes[INPUT_BYTES_MAX];

	d->count++;
	for (size_t n = 0; n < d->sii.sm_count; n++) {
		uint8_t r[ESC_SM_BYTES];
		uint16_t len;

		if (d->sii.sm[n].type != SM_INPUTS) {
			continue;
		}
		read_sm(d, t_ns, n, r);
		len = get_le16(r + 2);
		if (!(r[6] & 1) || len == 0 || len > sizeof(bytes)) {
			continue;
		}
		for (uint16_t i = 0; i < len; i++) {
			bytes[i] = (uint8_t)(d->count >> (8 * (i % 4)));
		}
		esc_pdi_write(d->dev.esc, t_ns, get_le16(r), bytes, len);
	}
}

static void run(struct sim_device *dev, int64_t t_ns)
{
	struct sii_device *d = self(dev);
	uint8_t state;

	d->next_ns = t_ns + PASS_NS;
	if (!esc_eeprom_loaded(dev->esc)) {
		return;
	}
	if (!(read8(d, t_ns, ESC_REG_ESC_CONFIG) & CONFIG_DEVICE_EMULATION)) {
		run_application(d, t_ns);
	}
	state = read8(d, t_ns, ESC_REG_AL_STATUS) & AL_STATE_MASK;
	if (state == AL_SAFEOP || state == AL_OP) {
		count_inputs(d, t_ns);
	}
}

static void power_on(struct sim_device *dev, int64_t t_ns)
{
	struct sii_device *d = self(dev);

	d->next_ns = t_ns + PASS_NS;
	d->count = 0;
	mailbox_reset(&d->mailbox);
	coe_dictionary_reset(&d->coe.dictionary);
	d->coe.dictionary.is_preop = 0;
}

static void sync0(struct sim_device *dev, int64_t t_ns, uint64_t system_time_ns)
{
	/* With pulse length 0 the pin falls when its status is read. */
	(void)read8(self(dev), t_ns, ESC_REG_DC_SYNC0_STATUS);
	(void)system_time_ns;
}

static void destroy(struct sim_device *dev)
{
	free(dev);
}

static const struct sim_device_ops ops = {
	.power_on = power_on,
	.next_wake_ns = next_wake_ns,
	.run = run,
	.sync0 = sync0,
	.destroy = destroy,
};

struct sim_device *sii_device_create(const uint8_t *sii, size_t sii_bytes)
{
	struct sii_device *d = calloc(1, sizeof(*d));
	char name[SII_NAME_BYTES];
	char error[128];

	if (d == NULL) {
		return NULL;
	}
	/* A damaged image is a slave, too: it has what stood before the damage. */
	(void)sii_parse(sii, sii_bytes, &d->sii, error, sizeof(error));
	sii_text(sii, sii_bytes, d->sii.device_name, name);
	coe_dictionary_init(&d->coe.dictionary, &d->sii, name);
	d->dev.ops = &ops;
	return &d->dev;
}
