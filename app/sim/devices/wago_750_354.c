/* SPDX-License-Identifier: MIT */
#include "devices/wago_750_354.h"

#include <errno.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/bytes.h"
#include "devices/slave_application.h"
#include "wire/al.h"
#include "wire/esc_reg.h"

#define NAME "wago_750_354"
#define EXAMPLE NAME "+457+557+430+530"
#define QUARTER_TURN_RAD 1.57079632679489661923
#define FULL_SCALE_V 10.0

enum {
	WIRE_NS = 260,
	PROCESSING_NS = 330,
	FORWARDING_NS = 300,
	SM_OUTPUTS_NUMBER = 2,
	SM_INPUTS_NUMBER = 3,
	SYNC0_ON = 0x03,  /* 0x0981: cyclic unit and SYNC0 */
	ADC_STEPS = 4096, /* a sign and 12 bits over 10 V, in the upper bits of a word */
	ADC_STEP_COUNTS = 8,
};

enum direction { INPUTS = 0, OUTPUTS = 1 };

/* The first byte of both headers. */
enum control_bit {
	OVERRUN_DISABLE = 0x01,
	INPUT_HOLD = 0x02,
	OUTPUT_HOLD = 0x04,
	OUTPUT_CLEAR = 0x08
};
enum status_bit { OVERRUN = 0x01, INPUT_HELD = 0x02, OUTPUT_HELD = 0x04, OUTPUT_CLEARED = 0x08 };

struct coupler {
	struct sim_device dev; /* first */
	struct wago_node node;
	struct slave_application app;
	int64_t pass_ns;       /* next pass of the main loop */
	int64_t kbus_start_ns; /* next K-bus cycle without SYNC0 */
	int64_t kbus_end_ns;   /* of the one that runs; INT64_MAX: none */
	uint8_t control;       /* header of the outputs, as of this K-bus cycle */
	uint8_t has_overrun;
	uint8_t digital_in[WAGO_MODULES_MAX]; /* what the hand has set */
	/* Process image: what the terminals had at the last K-bus cycle. */
	uint8_t image[2][WAGO_DIRECTION_BYTES_MAX];
	uint8_t latched[2][WAGO_DIRECTION_BYTES_MAX]; /* of the cycle that runs */
};

static struct coupler *self(struct sim_device *dev)
{
	return (struct coupler *)dev;
}

/* --- image --- */

static uint32_t get_bits(const uint8_t *image, uint32_t bit, uint8_t bits)
{
	return bits == 1 ? (uint32_t)image[bit / 8] >> bit % 8 & 1u : get_le16(image + bit / 8);
}

static void put_bits(uint8_t *image, uint32_t bit, uint8_t bits, uint32_t value)
{
	if (bits == 1) {
		image[bit / 8] =
			(uint8_t)((image[bit / 8] & ~(1u << bit % 8)) | (value & 1u) << bit % 8);
	} else {
		put_le16(image + bit / 8, (uint16_t)value);
	}
}

/* 12 bits and a sign: 10 V is 0x7FFF, 5 V 0x4000, -10 V 0x8000. */
static uint16_t convert(double volt)
{
	double counts = nearbyint(volt / FULL_SCALE_V * ADC_STEPS) * ADC_STEP_COUNTS;

	return (uint16_t)(int16_t)fmax(fmin(counts, INT16_MAX), INT16_MIN);
}

static uint32_t measure(const struct coupler *c, size_t slot, unsigned channel, int64_t t_ns)
{
	struct signal_spec signal;

	if (c->node.slot[slot].module->bits == 1) {
		return (uint32_t)c->digital_in[slot] >> (channel - 1) & 1u;
	}
	if (c->dev.signal == NULL) {
		return 0;
	}
	signal = *c->dev.signal;
	signal.phase_rad += (channel - 1) * QUARTER_TURN_RAD;
	return convert(signal_volt(&signal, t_ns));
}

/* SDOs read what the process data has. */
static void fill_dictionary(struct coupler *c)
{
	const struct sii *sii = &c->node.sii;
	uint32_t bit[2] = { 0, 0 };

	for (size_t p = 0; p < sii->pdo_count; p++) {
		const struct sii_pdo *pdo = &sii->pdo[p];
		enum direction way = pdo->is_tx ? INPUTS : OUTPUTS;

		for (size_t i = pdo->first_entry; i < pdo->first_entry + (size_t)pdo->entry_count;
		     i++) {
			const struct sii_entry *e = &sii->entry[i];

			if (e->index != 0) {
				c->app.coe.dictionary.entry_value[i] =
					get_bits(c->image[way], bit[way], e->bit_len);
			}
			bit[way] += e->bit_len;
		}
	}
}

/* --- K-bus --- */

static void read_inputs(struct coupler *c, int64_t t_ns)
{
	uint8_t *in = c->latched[INPUTS];

	if (c->control & INPUT_HOLD) {
		memcpy(in, c->image[INPUTS], c->node.bytes[INPUTS]);
		return;
	}
	memset(in, 0, c->node.bytes[INPUTS]);
	for (size_t s = 0; s < c->node.slot_count; s++) {
		const struct wago_slot *slot = &c->node.slot[s];
		const struct wago_module *m = slot->module;

		for (unsigned ch = 1; !m->is_output && ch <= m->channels; ch++) {
			put_bits(in, slot->first_bit + (ch - 1) * m->bits, m->bits,
				 measure(c, s, ch, t_ns));
		}
	}
}

static void take_outputs(struct coupler *c, int64_t t_ns)
{
	uint8_t wanted[WAGO_DIRECTION_BYTES_MAX] = { 0 };
	uint8_t *out = c->latched[OUTPUTS];
	uint32_t bytes = c->node.bytes[OUTPUTS];
	uint16_t start = 0;
	uint16_t len = 0;

	/* Outside OP all is 0. A length that does not fit was refused on the way to SAFE-OP. */
	if (slave_application_state(&c->app, t_ns) == AL_OP &&
	    slave_application_sm(&c->app, t_ns, SM_OUTPUTS_NUMBER, &start, &len) && len == bytes) {
		esc_pdi_read(c->dev.esc, t_ns, start, wanted, len);
	}
	c->control = wanted[0];
	if (c->control & OUTPUT_HOLD) {
		memcpy(out, c->image[OUTPUTS], bytes);
	} else {
		memcpy(out, wanted, bytes);
	}
	if (c->control & OUTPUT_CLEAR) {
		memset(out + WAGO_HEADER_BYTES, 0, bytes - WAGO_HEADER_BYTES);
	}
	memcpy(out, wanted, WAGO_HEADER_BYTES);
}

static void start_kbus(struct coupler *c, int64_t t_ns)
{
	uint8_t state = slave_application_state(&c->app, t_ns);

	c->kbus_start_ns = t_ns + WAGO_FREE_RUN_NS;
	if (state != AL_SAFEOP && state != AL_OP) {
		memset(c->image, 0, sizeof(c->image));
		return;
	}
	take_outputs(c, t_ns);
	read_inputs(c, t_ns);
	c->kbus_end_ns = t_ns + WAGO_KBUS_NS;
}

static uint8_t status(const struct coupler *c)
{
	uint8_t held = c->control & (INPUT_HOLD | OUTPUT_HOLD | OUTPUT_CLEAR);

	return held | (c->has_overrun && !(c->control & OVERRUN_DISABLE) ? OVERRUN : 0);
}

static void end_kbus(struct coupler *c, int64_t t_ns)
{
	uint32_t bytes = c->node.bytes[INPUTS];
	uint16_t start = 0;
	uint16_t len = 0;

	c->kbus_end_ns = INT64_MAX;
	memcpy(c->image, c->latched, sizeof(c->image));
	memset(c->image[INPUTS], 0, WAGO_HEADER_BYTES);
	c->image[INPUTS][0] = status(c);
	c->has_overrun = 0;
	fill_dictionary(c);
	if (slave_application_sm(&c->app, t_ns, SM_INPUTS_NUMBER, &start, &len) && len == bytes) {
		esc_pdi_write(c->dev.esc, t_ns, start, c->image[INPUTS], len);
	}
}

static int is_synchronous(struct coupler *c, int64_t t_ns)
{
	uint8_t activation;

	esc_pdi_read(c->dev.esc, t_ns, ESC_REG_DC_ACTIVATION, &activation, 1);
	return (activation & SYNC0_ON) == SYNC0_ON;
}

/* --- on the segment's time --- */

static void power_on(struct sim_device *dev, int64_t t_ns)
{
	struct coupler *c = self(dev);

	c->pass_ns = t_ns + SLAVE_APPLICATION_PASS_NS;
	c->kbus_start_ns = t_ns + WAGO_FREE_RUN_NS;
	c->kbus_end_ns = INT64_MAX;
	c->control = 0;
	c->has_overrun = 0;
	memset(c->image, 0, sizeof(c->image));
	memset(c->latched, 0, sizeof(c->latched));
	slave_application_power_on(&c->app, dev->esc);
}

static int64_t earlier(int64_t a, int64_t b)
{
	return a < b ? a : b;
}

static int64_t next_wake_ns(const struct sim_device *dev)
{
	const struct coupler *c = (const struct coupler *)dev;

	return earlier(c->pass_ns, earlier(c->kbus_start_ns, c->kbus_end_ns));
}

static void run(struct sim_device *dev, int64_t t_ns)
{
	struct coupler *c = self(dev);

	if (c->kbus_end_ns <= t_ns) {
		end_kbus(c, t_ns);
	}
	if (c->pass_ns <= t_ns) {
		c->pass_ns = t_ns + SLAVE_APPLICATION_PASS_NS;
		if (esc_eeprom_loaded(dev->esc)) {
			slave_application_run(&c->app, t_ns);
		}
	}
	if (c->kbus_start_ns <= t_ns) {
		c->kbus_start_ns = t_ns + WAGO_FREE_RUN_NS;
		if (esc_eeprom_loaded(dev->esc) && !is_synchronous(c, t_ns)) {
			start_kbus(c, t_ns);
		}
	}
}

static void sync0(struct sim_device *dev, int64_t t_ns, uint64_t system_time_ns)
{
	struct coupler *c = self(dev);
	uint8_t sync0_status;

	(void)system_time_ns;
	/* With pulse length 0 the pin falls when its status is read. */
	esc_pdi_read(dev->esc, t_ns, ESC_REG_DC_SYNC0_STATUS, &sync0_status, 1);
	if (c->kbus_end_ns != INT64_MAX) {
		c->has_overrun = 1; /* the K-bus cycle still runs: this edge is left out */
		return;
	}
	start_kbus(c, t_ns);
}

static void destroy(struct sim_device *dev)
{
	slave_application_done(&((struct coupler *)dev)->app);
	free(dev);
}

/* --- the hand --- */

const struct wago_node *wago_750_354_node(const struct sim_device *dev)
{
	return &((const struct coupler *)dev)->node;
}

static int has_channel(const struct coupler *c, size_t slot, unsigned channel)
{
	return slot < c->node.slot_count && channel >= 1 &&
	       channel <= c->node.slot[slot].module->channels;
}

int wago_750_354_get(const struct sim_device *dev, size_t slot, unsigned channel, int *ret_value)
{
	const struct coupler *c = (const struct coupler *)dev;
	const struct wago_module *m;
	uint32_t raw;

	if (!has_channel(c, slot, channel)) {
		return -EINVAL;
	}
	m = c->node.slot[slot].module;
	raw = get_bits(c->image[m->is_output],
		       c->node.slot[slot].first_bit + (channel - 1) * m->bits, m->bits);
	*ret_value = m->bits == 1 ? (int)raw : (int16_t)raw;
	return 0;
}

int wago_750_354_set(struct sim_device *dev, size_t slot, unsigned channel, int is_on)
{
	struct coupler *c = self(dev);
	unsigned bit;

	if (!has_channel(c, slot, channel) || c->node.slot[slot].module->is_output ||
	    c->node.slot[slot].module->bits != 1) {
		return -EINVAL;
	}
	bit = 1u << (channel - 1);
	c->digital_in[slot] =
		(uint8_t)(is_on ? c->digital_in[slot] | bit : c->digital_in[slot] & ~bit);
	return 0;
}

/* --- its terminals as text --- */

/* A number from 0 to @limit that ends at one of @ends; moves *text to there. */
static int take_number(const char **text, const char *ends, unsigned long limit, unsigned long *ret)
{
	char *end;
	unsigned long value;

	if (**text < '0' || **text > '9') {
		return -EINVAL;
	}
	errno = 0;
	value = strtoul(*text, &end, 0);
	if (errno != 0 || value > limit || (*end != '\0' && strchr(ends, *end) == NULL)) {
		return -EINVAL;
	}
	*text = end;
	*ret = value;
	return 0;
}

struct text {
	char *buf;
	size_t bytes;
	size_t len;
};

__attribute__((format(printf, 2, 3))) static void append(struct text *t, const char *format, ...)
{
	va_list args;
	int n;

	va_start(args, format);
	n = vsnprintf(t->buf + t->len, t->bytes - t->len, format, args);
	va_end(args);
	if (n > 0) {
		t->len = t->len + (size_t)n < t->bytes ? t->len + (size_t)n : t->bytes - 1;
	}
}

static void append_slot(struct text *t, const struct sim_device *dev, size_t slot)
{
	const struct wago_module *m = wago_750_354_node(dev)->slot[slot].module;
	unsigned bits = 0;

	append(t, "%sslot%zu=", slot > 0 ? " " : "", slot + 1);
	for (unsigned channel = 1; channel <= m->channels; channel++) {
		int value = 0;

		(void)wago_750_354_get(dev, slot, channel, &value);
		if (m->bits == 1) {
			bits |= (unsigned)value << (channel - 1);
		} else {
			append(t, "%s%d", channel > 1 ? "," : "", value);
		}
	}
	if (m->bits == 1) {
		append(t, "0x%02x", bits);
	}
}

static void io_get(const struct sim_device *dev, char *ret_text, size_t text_bytes)
{
	struct text t = { .buf = ret_text, .bytes = text_bytes };

	ret_text[0] = '\0';
	for (size_t slot = 0; slot < wago_750_354_node(dev)->slot_count; slot++) {
		append_slot(&t, dev, slot);
	}
}

static int set_all(struct sim_device *dev, size_t slot, unsigned long bits)
{
	const struct wago_module *m = wago_750_354_node(dev)->slot[slot].module;

	if (bits >> m->channels != 0) {
		return -EINVAL;
	}
	for (unsigned channel = 1; channel <= m->channels; channel++) {
		int r = wago_750_354_set(dev, slot, channel, (int)(bits >> (channel - 1) & 1));

		if (r < 0) {
			return r;
		}
	}
	return 0;
}

static int io_set(struct sim_device *dev, const char *key, const char *value)
{
	unsigned long slot;
	unsigned long channel;
	unsigned long bits;

	if (strncmp(key, "slot", 4) != 0) {
		return -EINVAL;
	}
	key += 4;
	if (take_number(&key, ".", WAGO_MODULES_MAX, &slot) < 0 || slot < 1 ||
	    slot > wago_750_354_node(dev)->slot_count || take_number(&value, "", 0xff, &bits) < 0) {
		return -EINVAL;
	}
	if (*key == '\0') {
		return set_all(dev, slot - 1, bits);
	}
	key++;
	if (take_number(&key, "", 0xff, &channel) < 0 || bits > 1) {
		return -EINVAL;
	}
	return wago_750_354_set(dev, slot - 1, (unsigned)channel, (int)bits);
}

/* --- making one --- */

int wago_750_354_slave(int position, const struct wago_module *const *modules, size_t count,
		       struct segment_slave_spec *ret_spec)
{
	static const struct sim_device_ops ops = {
		.power_on = power_on,
		.next_wake_ns = next_wake_ns,
		.run = run,
		.sync0 = sync0,
		.io_get = io_get,
		.io_set = io_set,
		.destroy = destroy,
	};
	struct coupler *c = calloc(1, sizeof(*c));
	char name[SII_NAME_BYTES];
	int r;

	if (c == NULL) {
		return -ENOMEM;
	}
	r = wago_node_init(&c->node, modules, count);
	if (r < 0) {
		free(c);
		return r;
	}
	sii_text(c->node.eeprom, c->node.eeprom_bytes, c->node.sii.device_name, name);
	slave_application_init(&c->app, &c->node.sii, name);
	wago_node_complete(&c->node, &c->app.coe.dictionary);
	c->dev.ops = &ops;
	*ret_spec = (struct segment_slave_spec){
		.features = &esc_et1100,
		.sii = c->node.eeprom,
		.sii_bytes = c->node.eeprom_bytes,
		.device = &c->dev,
		.signal = signal_default(),
		.parent = position - 1,
		.parent_port = 1,
		.wire_ns = WIRE_NS,
		.processing_ns = PROCESSING_NS,
		.forwarding_ns = FORWARDING_NS,
	};
	return 0;
}

int wago_750_354_is_name(const char *name)
{
	size_t len = strlen(NAME);

	return strncmp(name, NAME, len) == 0 && (name[len] == '\0' || name[len] == '+');
}

int wago_750_354_by_name(int position, const char *name, struct segment_slave_spec *ret_spec)
{
	const struct wago_module *modules[WAGO_MODULES_MAX];
	const char *text = (strcmp(name, NAME) == 0 ? EXAMPLE : name) + strlen(NAME);
	size_t count = 0;

	while (*text == '+') {
		unsigned long number;

		text++;
		if (take_number(&text, "+", 999, &number) < 0) {
			return -EINVAL;
		}
		if (count == WAGO_MODULES_MAX) {
			return -E2BIG;
		}
		modules[count] = wago_module_find((unsigned)number);
		if (modules[count++] == NULL) {
			return -EINVAL;
		}
	}
	return wago_750_354_slave(position, modules, count, ret_spec);
}
