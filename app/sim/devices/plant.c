/* SPDX-License-Identifier: MIT */
#include "devices/plant.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/bytes.h"
#include "devices/catalogue.h"
#include "devices/slave_application.h"
#include "wire/al.h"
#include "wire/esc_reg.h"
#include "wire/sii.h"

#define NAME "plant"
#define ACTUATOR_MAX 100.0
#define TAU_MAX_MS 1e6
#define GAIN_MAX 1e6

enum {
	WIRE_NS = 260,
	PROCESSING_NS = 330,
	FORWARDING_NS = 300,
	SYNC0_ON = 0x03, /* 0x0981: cyclic unit and SYNC0 */
	PLANT_SM_OUTPUTS = 0,
	PLANT_SM_INPUTS = 1,
	PLANT_BYTES = 4, /* of each of them */
};

struct plant {
	struct sim_device dev; /* first */
	uint8_t eeprom[MODEL_SII_BYTES];
	struct sii sii;
	struct slave_application app;
	double tau_s;
	double gain;
	double actuator;
	double sensor;
	int64_t until_ns; /* the sensor is what it is then */
	int64_t pass_ns;
};

static struct plant *self(struct sim_device *dev)
{
	return (struct plant *)dev;
}

/* --- the thing itself --- */

static void advance(struct plant *p, int64_t t_ns)
{
	double target = p->gain * p->actuator;

	p->sensor =
		target + (p->sensor - target) * exp((double)(p->until_ns - t_ns) * 1e-9 / p->tau_s);
	p->until_ns = t_ns;
}

static float real_of(uint32_t bits)
{
	float value;

	memcpy(&value, &bits, sizeof(value));
	return value;
}

static uint32_t bits_of(float value)
{
	uint32_t bits;

	memcpy(&bits, &value, sizeof(bits));
	return bits;
}

static void take_actuator(struct plant *p, int64_t t_ns)
{
	uint8_t bytes[PLANT_BYTES] = { 0 };
	uint16_t start = 0;
	uint16_t len = 0;
	double wanted;

	if (slave_application_state(&p->app, t_ns) == AL_OP &&
	    slave_application_sm(&p->app, t_ns, PLANT_SM_OUTPUTS, &start, &len) &&
	    len == sizeof(bytes)) {
		esc_pdi_read(p->dev.esc, t_ns, start, bytes, len);
	}
	wanted = (double)real_of(get_le32(bytes));
	p->actuator = isnan(wanted) ? 0 : fmin(fmax(wanted, 0), ACTUATOR_MAX);
}

static void give_sensor(struct plant *p, int64_t t_ns)
{
	uint8_t bytes[PLANT_BYTES];
	uint16_t start = 0;
	uint16_t len = 0;

	put_le32(bytes, bits_of((float)p->sensor));
	if (slave_application_sm(&p->app, t_ns, PLANT_SM_INPUTS, &start, &len) &&
	    len == sizeof(bytes)) {
		esc_pdi_write(p->dev.esc, t_ns, start, bytes, len);
	}
}

/* --- on the segment's time --- */

static int is_synchronous(struct plant *p, int64_t t_ns)
{
	uint8_t activation;

	esc_pdi_read(p->dev.esc, t_ns, ESC_REG_DC_ACTIVATION, &activation, 1);
	return (activation & SYNC0_ON) == SYNC0_ON;
}

static void power_on(struct sim_device *dev, int64_t t_ns)
{
	struct plant *p = self(dev);

	p->pass_ns = t_ns + SLAVE_APPLICATION_PASS_NS;
	p->until_ns = t_ns;
	p->actuator = 0;
	slave_application_power_on(&p->app, dev->esc);
}

static int64_t next_wake_ns(const struct sim_device *dev)
{
	return ((const struct plant *)dev)->pass_ns;
}

static void run(struct sim_device *dev, int64_t t_ns)
{
	struct plant *p = self(dev);

	if (t_ns < p->pass_ns) {
		return;
	}
	p->pass_ns = t_ns + SLAVE_APPLICATION_PASS_NS;
	advance(p, t_ns);
	if (!esc_eeprom_loaded(dev->esc)) {
		return;
	}
	slave_application_run(&p->app, t_ns);
	take_actuator(p, t_ns);
	if (!is_synchronous(p, t_ns)) {
		give_sensor(p, t_ns);
	}
}

static void sync0(struct sim_device *dev, int64_t t_ns, uint64_t system_time_ns)
{
	struct plant *p = self(dev);
	uint8_t sync0_status;

	(void)system_time_ns;
	/* With pulse length 0 the pin falls when its status is read. */
	esc_pdi_read(dev->esc, t_ns, ESC_REG_DC_SYNC0_STATUS, &sync0_status, 1);
	advance(p, t_ns);
	give_sensor(p, t_ns);
}

static void io_get(const struct sim_device *dev, char *ret_text, size_t text_bytes)
{
	snprintf(ret_text, text_bytes, "actuator=%.6g sensor=%.6g", plant_actuator(dev),
		 plant_sensor(dev));
}

static void destroy(struct sim_device *dev)
{
	free(dev);
}

/* --- making one --- */

int plant_slave(int position, double tau_s, double gain, struct segment_slave_spec *ret_spec)
{
	static const struct sim_device_ops ops = {
		.power_on = power_on,
		.next_wake_ns = next_wake_ns,
		.run = run,
		.sync0 = sync0,
		.io_get = io_get,
		.destroy = destroy,
	};
	struct plant *p = calloc(1, sizeof(*p));
	char name[SII_NAME_BYTES];
	size_t bytes;

	if (p == NULL) {
		return -ENOMEM;
	}
	bytes = catalogue_image(NAME, p->eeprom, &p->sii);
	sii_text(p->eeprom, bytes, p->sii.device_name, name);
	slave_application_init(&p->app, &p->sii, name);
	p->tau_s = tau_s;
	p->gain = gain;
	p->dev.ops = &ops;
	*ret_spec = (struct segment_slave_spec){
		.features = &esc_et1100,
		.sii = p->eeprom,
		.sii_bytes = bytes,
		.device = &p->dev,
		.signal = signal_default(),
		.parent = position - 1,
		.parent_port = 1,
		.wire_ns = WIRE_NS,
		.processing_ns = PROCESSING_NS,
		.forwarding_ns = FORWARDING_NS,
	};
	return 0;
}

int plant_is_name(const char *name)
{
	size_t len = strlen(NAME);

	return strncmp(name, NAME, len) == 0 && (name[len] == '\0' || name[len] == ':');
}

/* ":NUMBER" within the limits, or nothing; moves *text behind it. */
static int take_part(const char **text, double max, double *ret)
{
	char *end;
	double value;

	if (**text == '\0') {
		return 0;
	}
	value = strtod(*text + 1, &end);
	if (**text != ':' || end == *text + 1 || !(value > 0 && value <= max)) {
		return -EINVAL;
	}
	*ret = value;
	*text = end;
	return 0;
}

int plant_by_name(int position, const char *name, struct segment_slave_spec *ret_spec)
{
	const char *rest = name + strlen(NAME);
	double tau_ms = PLANT_TAU_S * 1e3;
	double gain = PLANT_GAIN;

	if (!plant_is_name(name) || take_part(&rest, TAU_MAX_MS, &tau_ms) < 0 ||
	    take_part(&rest, GAIN_MAX, &gain) < 0 || *rest != '\0') {
		return -EINVAL;
	}
	return plant_slave(position, tau_ms * 1e-3, gain, ret_spec);
}

double plant_actuator(const struct sim_device *dev)
{
	return ((const struct plant *)dev)->actuator;
}

double plant_sensor(const struct sim_device *dev)
{
	return ((const struct plant *)dev)->sensor;
}
