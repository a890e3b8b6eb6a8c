/* SPDX-License-Identifier: MIT */
#include "devices/catalogue.h"

#include <errno.h>

#include "wire/sii.h"

enum vendor { VENDOR_BECKHOFF = 0x00000002, VENDOR_MICROCHIP = 0x00000009 };

enum { PDI_LAN9252 = 0x80 };

/*
 * What captures of real devices say of their ESCs: types, ports and feature words as 0x0000 to
 * 0x0008 gave them, counts of FMMUs and SMs and the kind of clock by which registers gave a working
 * counter (SPECNOTES).
 */
static const struct esc_features coupler = {
	.type = 0x11,
	.build = 0x0003,
	.fmmu_count = 8,
	.sm_count = 8,
	.ram_kib = 8,
	.port_descriptor = 0x3b, /* MII, E-bus, MII */
	.features = 0x00fc,
	.dc = ESC_DC_64,
	.has_sync_unit = 1,
	.is_dc_by_eeprom = 1,
	.eeprom_bytes_a_read = 8,
	.receive_time_at_power_on = ESC_RECEIVE_TIME_UNSET,
};

/* A terminal with an ET1100: as the coupler, but E-bus. */
static const struct esc_features et1100_terminal = {
	.type = 0x11,
	.build = 0x0003,
	.fmmu_count = 8,
	.sm_count = 8,
	.ram_kib = 8,
	.port_descriptor = 0x0a,
	.features = 0x00fc,
	.dc = ESC_DC_64,
	.has_sync_unit = 1,
	.is_dc_by_eeprom = 1,
	.eeprom_bytes_a_read = 8,
	.receive_time_at_power_on = ESC_RECEIVE_TIME_UNSET,
};

/* EL1004, EL2828, EL3004: an ET1200 of the newer kind. */
static const struct esc_features et1200_terminal = {
	.type = 0x12,
	.revision = 0x01,
	.build = 0x0001,
	.fmmu_count = 3,
	.sm_count = 4,
	.ram_kib = 1,
	.port_descriptor = 0x4a, /* E-bus */
	.features = 0x01fc,
	.dc = ESC_DC_64,
	.has_sync_unit = 1,
	.is_dc_by_eeprom = 1,
	.has_open_bits = 1,
	.eeprom_bytes_a_read = 8,
	.eeprom_status = 0x0010,
	.receive_time_at_power_on = ESC_RECEIVE_TIME_UNSET,
};

/* EL2889: of the older kind; it has its system time although its EEPROM leaves both DC units off.
 */
static const struct esc_features et1200_old_terminal = {
	.type = 0x12,
	.build = 0x0001,
	.fmmu_count = 3,
	.sm_count = 4,
	.ram_kib = 1,
	.port_descriptor = 0x0a,
	.features = 0x00fc,
	.dc = ESC_DC_64,
	.has_sync_unit = 1,
	.eeprom_bytes_a_read = 8,
	.receive_time_at_power_on = ESC_RECEIVE_TIME_UNSET,
};

static const struct esc_features lan9252 = {
	.type = 0xc0,
	.revision = 0x02,
	.fmmu_count = 3,
	.sm_count = 4,
	.ram_kib = 4,
	.port_descriptor = 0x1f,
	.features = 0x01cc,
	.dc = ESC_DC_64,
	.has_sync_unit = 1,
	.has_open_bits = 1,
	.eeprom_bytes_a_read = 4,
	.has_long_eeprom = 1,
};

static const struct {
	uint32_t vendor;
	uint32_t product;
	const struct esc_features *features;
} known[] = {
	{ VENDOR_BECKHOFF, 0x044c2c52, &coupler },             /* EK1100 */
	{ VENDOR_BECKHOFF, 0x077a2c52, &coupler },             /* EK1914 */
	{ VENDOR_BECKHOFF, 0x03ec3052, &et1200_terminal },     /* EL1004 */
	{ VENDOR_BECKHOFF, 0x03f03052, &et1200_terminal },     /* EL1008: not captured */
	{ VENDOR_BECKHOFF, 0x07d43052, &et1200_terminal },     /* EL2004: not captured */
	{ VENDOR_BECKHOFF, 0x0b0c3052, &et1200_terminal },     /* EL2828 */
	{ VENDOR_BECKHOFF, 0x0b493052, &et1200_old_terminal }, /* EL2889 */
	{ VENDOR_BECKHOFF, 0x0bbc3052, &et1200_terminal },     /* EL3004 */
	{ VENDOR_BECKHOFF, 0x0c843052, &et1100_terminal },     /* EL3204: not captured */
	{ VENDOR_BECKHOFF, 0x0fa23052, &et1100_terminal },     /* EL4002: not captured */
	{ VENDOR_BECKHOFF, 0x1afe3052, &et1100_terminal },     /* EL6910 */
	{ VENDOR_MICROCHIP, 0x00009252, &lan9252 },
};

const struct esc_features *catalogue_features(uint32_t vendor, uint32_t product)
{
	for (size_t i = 0; i < sizeof(known) / sizeof(known[0]); i++) {
		if (known[i].vendor == vendor && known[i].product == product) {
			return known[i].features;
		}
	}
	return &esc_et1100;
}

static const struct esc_features *features_of(const struct sii *sii)
{
	const struct esc_features *features = catalogue_features(sii->vendor, sii->product);
	int is_unknown = features == &esc_et1100;

	/* Whoever made the device: a LAN9252 tells itself by its PDI. */
	return is_unknown && (sii->pdi_control & 0xff) >= PDI_LAN9252 ? &lan9252 : features;
}

/*
 * Terminals touch each other (captures: 300 to 310 ns round the last two, 590 to 600 ns round
 * three); others have PHYs and a cable.
 */
static void set_delays(struct segment_slave_spec *spec, int is_terminal)
{
	spec->wire_ns = is_terminal ? 5 : 260;
	spec->processing_ns = is_terminal ? 150 : 330;
	spec->forwarding_ns = is_terminal ? 140 : 300;
	if (spec->features == &coupler) {
		spec->processing_ns = 140;
	}
}

int catalogue_sii_slave(const uint8_t *sii, size_t sii_bytes, int position,
			struct segment_slave_spec *ret_spec)
{
	struct sim_device *device = sii_device_create(sii, sii_bytes);
	struct sii parsed;
	char error[128];

	if (device == NULL) {
		return -ENOMEM;
	}
	(void)sii_parse(sii, sii_bytes, &parsed, error, sizeof(error));
	*ret_spec = (struct segment_slave_spec){
		.features = features_of(&parsed),
		.sii = sii,
		.sii_bytes = sii_bytes,
		.device = device,
		.signal = signal_default(),
		.parent = position - 1,
		.parent_port = 1,
	};
	set_delays(ret_spec, parsed.vendor == VENDOR_BECKHOFF);
	return 0;
}
