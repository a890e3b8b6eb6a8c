/* SPDX-License-Identifier: MIT */
/*
 * A slave that is nothing but its SII image: the states and SDOs of every slave
 * (slave_application.h), and inputs that count its passes. Where the EEPROM asks for device
 * emulation the chip does the states.
 */
#include <stdlib.h>
#include <string.h>

#include "devices/slave_application.h"
#include "segment/device.h"
#include "wire/al.h"
#include "wire/esc_reg.h"
#include "wire/sii.h"

enum { CONFIG_DEVICE_EMULATION = 0x01, INPUT_BYTES_MAX = 1024 };

struct sii_device {
	struct sim_device dev;
	struct sii sii;
	struct slave_application app;
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

static void count_inputs(struct sii_device *d, int64_t t_ns)
{
	uint8_t bytes[INPUT_BYTES_MAX];

	d->count++;
	for (size_t n = 0; n < d->sii.sm_count; n++) {
		uint16_t start = 0;
		uint16_t len = 0;

		if (d->sii.sm[n].type != SLAVE_SM_INPUTS ||
		    !slave_application_sm(&d->app, t_ns, n, &start, &len) || len > sizeof(bytes)) {
			continue;
		}
		for (uint16_t i = 0; i < len; i++) {
			bytes[i] = (uint8_t)(d->count >> (8 * (i % 4)));
		}
		esc_pdi_write(d->dev.esc, t_ns, start, bytes, len);
	}
}

static void run(struct sim_device *dev, int64_t t_ns)
{
	struct sii_device *d = self(dev);
	uint8_t state;

	d->next_ns = t_ns + SLAVE_APPLICATION_PASS_NS;
	if (!esc_eeprom_loaded(dev->esc)) {
		return;
	}
	if (!(read8(d, t_ns, ESC_REG_ESC_CONFIG) & CONFIG_DEVICE_EMULATION)) {
		slave_application_run(&d->app, t_ns);
	}
	state = slave_application_state(&d->app, t_ns);
	if (state == AL_SAFEOP || state == AL_OP) {
		count_inputs(d, t_ns);
	}
}

static void power_on(struct sim_device *dev, int64_t t_ns)
{
	struct sii_device *d = self(dev);

	d->next_ns = t_ns + SLAVE_APPLICATION_PASS_NS;
	d->count = 0;
	slave_application_power_on(&d->app, dev->esc);
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
	slave_application_init(&d->app, &d->sii, name);
	d->dev.ops = &ops;
	return &d->dev;
}
