/* SPDX-License-Identifier: MIT */
#include "devices/catalogue.h"

#include <assert.h>
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "devices/catalogue_texts.h"
#include "devices/sii_device.h"
#include "wire/sii.h"

enum { VENDOR_BECKHOFF = 0x00000002, PDI_LAN9252 = 0x80, PORT_EBUS = 2, PORT_MII = 3 };

enum { ENTRIES_MAX = 256 };

enum { NEAR_EDITS = 2, NEAR_NAMES = 4 };

/* ESC features by identity, from all entries. */
struct known {
	uint32_t vendor;
	uint32_t product;
	struct esc_features features;
};

/* --- entries --- */

size_t catalogue_count(void)
{
	return catalogue_text_count;
}

void catalogue_read(size_t i, struct slave_model *ret)
{
	const struct catalogue_text *t = &catalogue_texts[i];
	char error[160];

	if (slave_model_parse(t->name, t->text, ret, error, sizeof(error)) < 0) {
		fprintf(stderr, "catalogue: %s\n", error); /* a test reads every entry */
		abort();
	}
}

int catalogue_find(const char *name, struct slave_model *ret)
{
	for (size_t i = 0; i < catalogue_text_count; i++) {
		if (strcmp(catalogue_texts[i].name, name) == 0) {
			catalogue_read(i, ret);
			return 0;
		}
	}
	return -ENOENT;
}

size_t catalogue_image(const char *name, uint8_t *image, struct sii *ret_sii)
{
	static struct slave_model model;
	char error[160];
	size_t bytes;

	if (catalogue_find(name, &model) < 0) {
		abort();
	}
	bytes = slave_model_sii(&model, image);
	(void)sii_parse(image, bytes, ret_sii, error, sizeof(error));
	return bytes;
}

/* Edits from @a to @b: letters inserted, removed, replaced. */
static unsigned distance(const char *a, const char *b)
{
	unsigned row[MODEL_NAME_BYTES + 1];
	size_t columns = strnlen(b, MODEL_NAME_BYTES);

	for (size_t j = 0; j <= columns; j++) {
		row[j] = (unsigned)j;
	}
	for (size_t i = 0; a[i] != '\0'; i++) {
		unsigned diagonal = row[0]++;

		for (size_t j = 0; j < columns; j++) {
			unsigned replaced = diagonal + (a[i] != b[j]);
			unsigned other = (row[j] < row[j + 1] ? row[j] : row[j + 1]) + 1;

			diagonal = row[j + 1];
			row[j + 1] = replaced < other ? replaced : other;
		}
	}
	return row[columns];
}

void catalogue_near(const char *name, char *ret_text, size_t text_bytes)
{
	size_t len = 0;
	unsigned names = 0;

	ret_text[0] = '\0';
	for (unsigned edits = 1; edits <= NEAR_EDITS && names == 0; edits++) {
		for (size_t i = 0; i < catalogue_text_count && names < NEAR_NAMES; i++) {
			const char *other = catalogue_texts[i].name;

			if (distance(name, other) == edits && len < text_bytes) {
				int n = snprintf(ret_text + len, text_bytes - len, "%s%s",
						 names++ > 0 ? ", " : "", other);

				len += n > 0 ? (size_t)n : 0;
			}
		}
	}
}

/* --- features by identity --- */

const struct esc_features *catalogue_features(uint32_t vendor, uint32_t product)
{
	static struct slave_model model;
	static struct known known[ENTRIES_MAX];
	static size_t count;

	assert(catalogue_text_count <= ENTRIES_MAX);
	for (; count < catalogue_text_count; count++) {
		catalogue_read(count, &model);
		known[count] =
			(struct known){ model.sii.vendor, model.sii.product, model.features };
	}
	for (size_t i = 0; i < count; i++) {
		if (known[i].vendor == vendor && known[i].product == product) {
			return &known[i].features;
		}
	}
	return &esc_et1100;
}

static const struct esc_features *features_of(const struct sii *sii)
{
	const struct esc_features *features = catalogue_features(sii->vendor, sii->product);
	int is_unknown = features == &esc_et1100;

	/* Whoever made the device: a LAN9252 is recognised by its PDI. */
	return is_unknown && (sii->pdi_control & 0xff) >= PDI_LAN9252 ? esc_chip_find("lan9252")
								      : features;
}

/* --- slaves --- */

/*
 * Terminals touch each other (captures: 300 to 310 ns round the last two, 590 to 600 ns round
 * three); others have PHYs and a cable.
 */
static void set_delays(struct segment_slave_spec *spec, int is_terminal)
{
	uint8_t ports = spec->features->port_descriptor;
	int is_coupler = (ports & 3) == PORT_MII && (ports >> 2 & 3) == PORT_EBUS;

	spec->wire_ns = is_terminal ? 5 : 260;
	spec->processing_ns = is_terminal ? 150 : 330;
	spec->forwarding_ns = is_terminal ? 140 : 300;
	if (is_coupler) {
		spec->processing_ns = 140;
	}
}

static int fill_spec(struct segment_slave_spec *spec, struct sim_device *device,
		     const struct sii *sii, int position)
{
	if (device == NULL) {
		return -ENOMEM;
	}
	*spec = (struct segment_slave_spec){
		.features = features_of(sii),
		.device = device,
		.signal = signal_default(),
		.parent = position - 1,
		.parent_port = 1,
	};
	set_delays(spec, sii->vendor == VENDOR_BECKHOFF);
	return 0;
}

int catalogue_slave(const struct slave_model *model, int position,
		    struct segment_slave_spec *ret_spec)
{
	struct sim_device *device = sii_device_from_model(model);
	int r = fill_spec(ret_spec, device, &model->sii, position);

	if (r == 0) {
		ret_spec->sii = sii_device_image(device, &ret_spec->sii_bytes);
	}
	return r;
}

int catalogue_sii_slave(const uint8_t *sii, size_t sii_bytes, int position,
			struct segment_slave_spec *ret_spec)
{
	static struct sii parsed;
	char error[128];
	int r;

	(void)sii_parse(sii, sii_bytes, &parsed, error, sizeof(error));
	r = fill_spec(ret_spec, sii_device_create(sii, sii_bytes), &parsed, position);
	if (r == 0) {
		ret_spec->sii = sii;
		ret_spec->sii_bytes = sii_bytes;
	}
	return r;
}
