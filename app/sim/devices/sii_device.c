/* SPDX-License-Identifier: MIT */
#include "devices/sii_device.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "devices/cia402.h"
#include "devices/slave_application.h"
#include "wire/al.h"
#include "wire/esc_reg.h"
#include "wire/sii.h"

#define QUARTER_TURN_RAD 1.57079632679489661923

enum {
	CONFIG_DEVICE_EMULATION = 0x01,
	AREA_BYTES_MAX = 1024,
	SYNC0_ON = 0x03, /* 0x0981: cyclic unit and SYNC0 */
	IO_KEY_BYTES = 16,
};

struct sii_device {
	struct sim_device dev; /* first */
	struct slave_model model;
	int has_model; /* else only model.sii is filled */
	uint8_t image[MODEL_SII_BYTES];
	size_t image_bytes;
	const char *text[MODEL_TEXTS];
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

/* --- process data of a model --- */

static uint64_t get_bits(const uint8_t *area, uint32_t bit, uint8_t bits)
{
	uint64_t value = 0;

	for (uint32_t i = 0; i < bits && i < 64; i++) {
		value |= (uint64_t)(area[(bit + i) / 8] >> (bit + i) % 8 & 1) << i;
	}
	return value;
}

static void put_bits(uint8_t *area, uint32_t bit, uint8_t bits, uint64_t value)
{
	for (uint32_t i = 0; i < bits && i < 64; i++) {
		area[(bit + i) / 8] |= (uint8_t)((value >> i & 1) << (bit + i) % 8);
	}
}

/* Number of the entry in sii.entry, or -1. */
static int find_entry(const struct sii *sii, uint16_t index, uint8_t subindex)
{
	for (size_t i = 0; i < sii->entry_count; i++) {
		if (sii->entry[i].index == index && sii->entry[i].subindex == subindex) {
			return (int)i;
		}
	}
	return -1;
}

static uint64_t measure(const struct sii_device *d, const struct model_input *in, int64_t t_ns)
{
	struct signal_spec signal;
	double volt;

	if (d->dev.signal == NULL) {
		return 0;
	}
	signal = *d->dev.signal;
	signal.phase_rad += in->channel * QUARTER_TURN_RAD;
	volt = fmin(fmax(signal_volt(&signal, t_ns), in->low_v), in->high_v);
	return (uint64_t)(int64_t)nearbyint(volt / in->high_v * (double)in->counts);
}

static uint64_t output_of(const struct sii_device *d, const struct model_input *in)
{
	int n = find_entry(&d->model.sii, in->index, in->subindex);

	return n < 0 ? 0 : d->app.coe.dictionary.entry_value[n];
}

static uint64_t input_value(const struct sii_device *d, size_t entry, int64_t t_ns)
{
	const struct model_input *in = &d->model.input[entry];

	switch (in->source) {
	case MODEL_ZERO:
		return 0;
	case MODEL_COUNT:
		return d->count;
	case MODEL_TOGGLE:
		return d->count & 1;
	case MODEL_SIGNAL:
		return measure(d, in, t_ns);
	case MODEL_FOLLOW:
		return output_of(d, in);
	case MODEL_STATUSWORD:
		return cia402_statusword((uint16_t)d->app.coe.dictionary.entry_value[entry],
					 (uint16_t)output_of(d, in));
	case MODEL_FIXED:
		return (uint64_t)in->counts;
	}
	return 0;
}

/* A "count" of one bit is one of the counter's: the lamps of a terminal count in binary. */
static uint64_t shown(const struct sii_device *d, size_t entry, uint32_t bit, int64_t t_ns)
{
	uint64_t value = input_value(d, entry, t_ns);
	uint8_t bits = d->model.sii.entry[entry].bit_len;

	if (d->model.input[entry].source == MODEL_COUNT && bits == 1) {
		value >>= bit % 32;
	}
	return bits < 64 ? value & ((UINT64_C(1) << bits) - 1) : value;
}

static const struct sii_pdo *find_pdo(const struct sii *sii, uint16_t index)
{
	for (size_t i = 0; i < sii->pdo_count; i++) {
		if (sii->pdo[i].index == index) {
			return &sii->pdo[i];
		}
	}
	return NULL;
}

/* An object may be an entry of several PDOs: it has one value. */
static void set_object(struct sii_device *d, size_t entry, uint64_t value)
{
	const struct sii *s = &d->model.sii;

	for (size_t i = 0; i < s->entry_count; i++) {
		if (s->entry[i].index == s->entry[entry].index &&
		    s->entry[i].subindex == s->entry[entry].subindex) {
			d->app.coe.dictionary.entry_value[i] = value;
		}
	}
}

/* Go through the entries that are assigned to SM @sm: inputs into @area, outputs from it. */
static void copy_entries(struct sii_device *d, size_t sm, uint8_t *area, size_t bytes, int64_t t_ns)
{
	const struct coe_assignment *a = &d->app.coe.dictionary.assignment[sm];
	const struct sii *s = &d->model.sii;
	uint32_t bit = 0;

	for (uint8_t i = 0; i < a->count; i++) {
		const struct sii_pdo *pdo = find_pdo(s, a->pdo[i]);

		if (pdo == NULL || (bit + pdo->bits + 7) / 8 > bytes) {
			return;
		}
		for (size_t n = pdo->first_entry; n < pdo->first_entry + (size_t)pdo->entry_count;
		     n++) {
			uint8_t bits = s->entry[n].bit_len;

			if (s->entry[n].index != 0) {
				set_object(d, n,
					   pdo->is_tx ? shown(d, n, bit, t_ns)
						      : get_bits(area, bit, bits));
			}
			if (pdo->is_tx) {
				put_bits(area, bit, bits, d->app.coe.dictionary.entry_value[n]);
			}
			bit += bits;
		}
	}
}

/* Each byte of an input area of a slave without a model is one of the counter's. */
static void count_bytes(const struct sii_device *d, uint8_t *area, size_t bytes)
{
	for (size_t i = 0; i < bytes; i++) {
		area[i] = (uint8_t)(d->count >> (8 * (i % 4)));
	}
}

static void take_outputs(struct sii_device *d, int64_t t_ns, int is_op)
{
	for (size_t n = 0; d->has_model && n < d->model.sii.sm_count; n++) {
		uint8_t area[AREA_BYTES_MAX] = { 0 };
		uint16_t start = 0;
		uint16_t len = 0;

		if (d->model.sii.sm[n].type == SLAVE_SM_OUTPUTS &&
		    slave_application_sm(&d->app, t_ns, n, &start, &len) && len <= sizeof(area)) {
			if (is_op) {
				esc_pdi_read(d->dev.esc, t_ns, start, area, len);
			}
			copy_entries(d, n, area, len, t_ns);
		}
	}
}

static void give_inputs(struct sii_device *d, int64_t t_ns)
{
	d->count++;
	for (size_t n = 0; n < d->model.sii.sm_count; n++) {
		uint8_t area[AREA_BYTES_MAX] = { 0 };
		uint16_t start = 0;
		uint16_t len = 0;

		if (d->model.sii.sm[n].type != SLAVE_SM_INPUTS ||
		    !slave_application_sm(&d->app, t_ns, n, &start, &len) || len > sizeof(area)) {
			continue;
		}
		if (d->has_model) {
			copy_entries(d, n, area, len, t_ns);
		} else {
			count_bytes(d, area, len);
		}
		esc_pdi_write(d->dev.esc, t_ns, start, area, len);
	}
}

/* --- on the segment's time --- */

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
		take_outputs(d, t_ns, state == AL_OP);
		give_inputs(d, t_ns);
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

/* --- terminals --- */

static void io_get(const struct sim_device *dev, char *ret_text, size_t text_bytes)
{
	const struct sii_device *d = (const struct sii_device *)dev;
	const struct sii *s = &d->model.sii;
	size_t len = 0;

	ret_text[0] = '\0';
	for (size_t i = 0; i < s->entry_count; i++) {
		int n;

		if (s->entry[i].index == 0 ||
		    find_entry(s, s->entry[i].index, s->entry[i].subindex) != (int)i) {
			continue;
		}
		n = snprintf(ret_text + len, text_bytes - len, "%s0x%04x:%02x=%llu",
			     len > 0 ? " " : "", s->entry[i].index, s->entry[i].subindex,
			     (unsigned long long)d->app.coe.dictionary.entry_value[i]);
		if (n < 0 || (size_t)n >= text_bytes - len) {
			ret_text[len] = '\0'; /* whole words only */
			return;
		}
		len += (size_t)n;
	}
}

static int server_set(struct sim_device *dev, const char *key, const char *value)
{
	return slave_application_set(&self(dev)->app, key, value);
}

static int io_set(struct sim_device *dev, const char *key, const char *value)
{
	struct sii_device *d = self(dev);
	struct sii *s = &d->model.sii;
	char *end;
	long index = strtol(key, &end, 16);
	long subindex = *end == ':' ? strtol(end + 1, &end, 16) : -1;
	long long counts = strtoll(value, NULL, 0);
	int is_set = 0;

	if (server_set(dev, key, value) == 0) {
		return 0;
	}
	if (*end != '\0' || value[strspn(value, "0123456789xXabcdefABCDEF-")]) {
		return -EINVAL;
	}
	for (size_t p = 0; p < s->pdo_count; p++) {
		for (size_t i = s->pdo[p].first_entry;
		     s->pdo[p].is_tx && i < (size_t)s->pdo[p].first_entry + s->pdo[p].entry_count;
		     i++) {
			if (index > 0 && s->entry[i].index == index &&
			    s->entry[i].subindex == subindex) {
				d->model.input[i] = (struct model_input){ .source = MODEL_FIXED,
									  .counts = counts };
				is_set = 1;
			}
		}
	}
	return is_set ? 0 : -EINVAL;
}

static void destroy(struct sim_device *dev)
{
	slave_application_done(&self(dev)->app);
	free(dev);
}

/* --- making one --- */

static const struct sim_device_ops image_ops = {
	.power_on = power_on,
	.next_wake_ns = next_wake_ns,
	.run = run,
	.sync0 = sync0,
	.io_set = server_set,
	.destroy = destroy,
};

static const struct sim_device_ops model_ops = {
	.power_on = power_on,
	.next_wake_ns = next_wake_ns,
	.run = run,
	.sync0 = sync0,
	.io_get = io_get,
	.io_set = io_set,
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
	/* A damaged image makes a slave, too: with what comes before the damage. */
	(void)sii_parse(sii, sii_bytes, &d->model.sii, error, sizeof(error));
	sii_text(sii, sii_bytes, d->model.sii.device_name, name);
	slave_application_init(&d->app, &d->model.sii, name);
	d->dev.ops = &image_ops;
	return &d->dev;
}

struct sim_device *sii_device_from_model(const struct slave_model *model)
{
	enum { COE_INFORMATION = 0x02 };
	struct sii_device *d = calloc(1, sizeof(*d));

	if (d == NULL) {
		return NULL;
	}
	d->model = *model;
	d->has_model = 1;
	d->image_bytes = slave_model_sii(model, d->image);
	slave_application_init(&d->app, &d->model.sii, d->model.text[d->model.sii.device_name - 1]);
	d->app.coe.dictionary.device_type = model->device_type;
	if (model->sii.coe_details & COE_INFORMATION) {
		for (size_t i = 0; i < model->text_count; i++) {
			d->text[i] = d->model.text[i];
		}
		d->app.coe.dictionary.text = d->text;
		d->app.coe.dictionary.text_count = model->text_count;
		d->app.coe.dictionary.unit = d->model.unit;
	}
	d->dev.ops = &model_ops;
	return &d->dev;
}

const uint8_t *sii_device_image(struct sim_device *dev, size_t *ret_bytes)
{
	*ret_bytes = self(dev)->image_bytes;
	return self(dev)->image;
}
