/* SPDX-License-Identifier: MIT */
/*
 * The ESCs of the catalogue besides the ET1100 (segment/esc.c). Types, feature words, counts of
 * FMMUs and SyncManagers and the kind of clock are what captures of real devices show in 0x0000 to
 * 0x0008 and by working counters; the IP core is not in a capture
 * (app/doc/reference/simulated-esc.md). The ports are the slave's own.
 */
#include <string.h>

#include "devices/slave_model.h"

static const struct {
	const char *name;
	struct esc_features features;
} chips[] = {
	{ "et1200",
	  { .type = 0x12,
	    .revision = 0x01,
	    .build = 0x0001,
	    .fmmu_count = 3,
	    .sm_count = 4,
	    .ram_kib = 1,
	    .features = 0x01fc,
	    .dc = ESC_DC_64,
	    .has_sync_unit = 1,
	    .is_dc_by_eeprom = 1,
	    .has_open_bits = 1,
	    .eeprom_bytes_a_read = 8,
	    .eeprom_status = 0x0010,
	    .receive_time_at_power_on = ESC_RECEIVE_TIME_UNSET } },
	/* An older one: it has its system time although its EEPROM leaves both DC units off. */
	{ "et1200_old",
	  { .type = 0x12,
	    .build = 0x0001,
	    .fmmu_count = 3,
	    .sm_count = 4,
	    .ram_kib = 1,
	    .features = 0x00fc,
	    .dc = ESC_DC_64,
	    .has_sync_unit = 1,
	    .eeprom_bytes_a_read = 8,
	    .receive_time_at_power_on = ESC_RECEIVE_TIME_UNSET } },
	/* Beckhoff's IP core for FPGAs: sizes are the device's choice, these are a model. */
	{ "ip_core",
	  { .type = 0x04,
	    .fmmu_count = 8,
	    .sm_count = 8,
	    .ram_kib = 8,
	    .features = 0x00fc,
	    .dc = ESC_DC_64,
	    .has_sync_unit = 1,
	    .eeprom_bytes_a_read = 8,
	    .has_long_eeprom = 1,
	    .is_eeprom_emulated = 1 } },
	{ "lan9252",
	  { .type = 0xc0,
	    .revision = 0x02,
	    .fmmu_count = 3,
	    .sm_count = 4,
	    .ram_kib = 4,
	    .features = 0x01cc,
	    .dc = ESC_DC_64,
	    .has_sync_unit = 1,
	    .has_open_bits = 1,
	    .eeprom_bytes_a_read = 4,
	    .has_long_eeprom = 1 } },
};

const struct esc_features *esc_chip_find(const char *name)
{
	if (strcmp(name, "et1100") == 0) {
		return &esc_et1100;
	}
	for (size_t i = 0; i < sizeof(chips) / sizeof(chips[0]); i++) {
		if (strcmp(chips[i].name, name) == 0) {
			return &chips[i].features;
		}
	}
	return NULL;
}
