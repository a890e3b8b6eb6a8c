/* SPDX-License-Identifier: MIT */
/*
 * A slave that is nothing but its SII image. It goes through the AL states with the checks that ETG.1000.6
 * asks of a simple slave, falls back when its watchdog expires, and its inputs count milliseconds.
 */
#include <stdlib.h>
#include <string.h>

#include "base/bytes.h"
#include "sim/device.h"
#include "wire/al.h"
#include "wire/esc_reg.h"
#include "wire/sii.h"

enum { STEP_NS = 1000000, SM_OUTPUTS = 3, SM_INPUTS = 4, SM_MAILBOX_OUT = 1, SM_MAILBOX_IN = 2 };

struct sii_device {
	struct sim_device dev;
	struct sii sii;
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

static void set_state(struct sii_device *d, int64_t t_ns, uint8_t state, uint16_t code)
{
	uint8_t status[2] = { state, 0 };
	uint8_t code_bytes[2];

	put_le16(code_bytes, code);
	esc_pdi_write(d->dev.esc, t_ns, ESC_REG_AL_STATUS_CODE, code_bytes, 2);
	esc_pdi_write(d->dev.esc, t_ns, ESC_REG_AL_STATUS, status, 2);
}

static uint8_t al_status(struct sii_device *d, int64_t t_ns)
{
	uint8_t status[2];

	esc_pdi_read(d->dev.esc, t_ns, ESC_REG_AL_STATUS, status, 2);
	return status[0];
}

/* Bits of the PDOs that belong to SyncManager @n by default. */
static uint32_t sm_bits(const struct sii *sii, size_t n)
{
	uint32_t bits = 0;

	for (size_t i = 0; i < sii->pdo_count; i++) {
		bits += sii->pdo[i].sm == n ? sii->pdo[i].bits : 0;
	}
	return bits;
}

static int sm_is_set_up(struct sii_device *d, int64_t t_ns, size_t n, uint16_t len)
{
	uint8_t r[ESC_SM_BYTES];

	esc_pdi_read(d->dev.esc, t_ns, (uint16_t)(ESC_REG_SM + n * ESC_SM_BYTES), r, sizeof(r));
	return (r[6] & 1) && get_le16(r) == d->sii.sm[n].start && get_le16(r + 2) == len;
}

static uint16_t check_mailbox(struct sii_device *d, int64_t t_ns)
{
	for (size_t n = 0; n < d->sii.sm_count; n++) {
		uint8_t type = d->sii.sm[n].type;

		if (type == SM_MAILBOX_OUT || type == SM_MAILBOX_IN) {
			uint8_t r[ESC_SM_BYTES];

			esc_pdi_read(d->dev.esc, t_ns, (uint16_t)(ESC_REG_SM + n * ESC_SM_BYTES), r,
				     sizeof(r));
			if (!(r[6] & 1) || get_le16(r + 2) == 0) {
				return AL_CODE_INVALID_MAILBOX_CONFIG;
			}
		}
	}
	return AL_CODE_NONE;
}

static uint16_t check_process_data(struct sii_device *d, int64_t t_ns)
{
	for (size_t n = 0; n < d->sii.sm_count; n++) {
		uint8_t type = d->sii.sm[n].type;
		uint32_t bits = sm_bits(&d->sii, n);

		if ((type == SM_OUTPUTS || type == SM_INPUTS) && bits > 0 &&
		    !sm_is_set_up(d, t_ns, n, (uint16_t)((bits + 7) / 8))) {
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
	if ((to == AL_SAFEOP && from == AL_INIT) || (to == AL_OP && from != AL_SAFEOP && from != AL_OP)) {
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

static void handle_control(struct sii_device *d, int64_t t_ns)
{
	uint8_t control[2];
	uint8_t status = al_status(d, t_ns);
	uint8_t from = status & AL_STATE_MASK;
	uint8_t to;
	uint16_t code;

	esc_pdi_read(d->dev.esc, t_ns, ESC_REG_AL_CONTROL, control, 2);
	to = control[0] & AL_STATE_MASK;
	if ((status & AL_ERROR) && !(control[0] & AL_ERROR) && to != AL_INIT) {
		return; /* an error has to be acknowledged first */
	}
	code = check_step(d, t_ns, from, to);
	if (code == AL_CODE_NONE) {
		set_state(d, t_ns, to, code);
	} else {
		set_state(d, t_ns, (uint8_t)(from | AL_ERROR), code);
	}
}

static void frame_passed(struct sim_device *dev, int64_t t_ns)
{
	struct sii_device *d = self(dev);

	if (!esc_eeprom_loaded(dev->esc)) {
		return;
	}
	if (dev->esc->al_event & ESC_AL_EVENT_CONTROL) {
		handle_control(d, t_ns);
	}
}

static void count_inputs(struct sii_device *d, int64_t t_ns)
{
	uint8_t bytes[256];

	d->count++;
	for (size_t n = 0; n < d->sii.sm_count; n++) {
		uint32_t len = (sm_bits(&d->sii, n) + 7) / 8;

		if (d->sii.sm[n].type != SM_INPUTS || len == 0 || len > sizeof(bytes)) {
			continue;
		}
		for (uint32_t i = 0; i < len; i++) {
			bytes[i] = (uint8_t)(d->count >> (8 * (i % 4)));
		}
		esc_pdi_write(d->dev.esc, t_ns, d->sii.sm[n].start, bytes, len);
	}
}

static void run(struct sim_device *dev, int64_t t_ns)
{
	struct sii_device *d = self(dev);
	uint8_t state;

	d->next_ns = t_ns + STEP_NS;
	if (!esc_eeprom_loaded(dev->esc)) {
		return;
	}
	state = al_status(d, t_ns) & AL_STATE_MASK;
	if (state == AL_OP && (dev->esc->al_event & ESC_AL_EVENT_WATCHDOG)) {
		uint8_t ignored[2];

		esc_pdi_read(dev->esc, t_ns, ESC_REG_WATCHDOG_STATUS_PD, ignored, 2);
		set_state(d, t_ns, AL_SAFEOP | AL_ERROR, AL_CODE_SM_WATCHDOG);
	}
	if (state == AL_SAFEOP || state == AL_OP) {
		count_inputs(d, t_ns);
	}
}

static void power_on(struct sim_device *dev, int64_t t_ns)
{
	struct sii_device *d = self(dev);

	d->next_ns = t_ns + STEP_NS;
	d->count = 0;
}

static void sync0(struct sim_device *dev, int64_t t_ns, uint64_t system_time_ns)
{
	(void)dev;
	(void)t_ns;
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
	.frame_passed = frame_passed,
	.destroy = destroy,
};

struct sim_device *sii_device_create(const uint8_t *sii, size_t sii_bytes)
{
	struct sii_device *d = calloc(1, sizeof(*d));
	char error[128];

	if (d == NULL) {
		return NULL;
	}
	/* A damaged image is a slave, too: it has what stood before the damage. */
	(void)sii_parse(sii, sii_bytes, &d->sii, error, sizeof(error));
	d->dev.ops = &ops;
	return &d->dev;
}
