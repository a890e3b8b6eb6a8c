/* SPDX-License-Identifier: MIT */
/* The SII interface 0x0500 to 0x050f over the EEPROM's contents. */
#include "sim/esc_inside.h"

#include <string.h>

enum eeprom_bits {
	EEPROM_WRITE_ENABLE = 0x0001,
	EEPROM_READS_8_BYTES = 0x0040,
	EEPROM_TWO_BYTE_ADDRESS = 0x0080,
	EEPROM_COMMAND = 0x0700,
	EEPROM_READ = 0x0100,
	EEPROM_WRITE = 0x0200,
	EEPROM_RELOAD = 0x0400,
	EEPROM_CHECKSUM_ERROR = 0x0800,
	EEPROM_NOT_LOADED = 0x1000,
	EEPROM_ACKNOWLEDGE_ERROR = 0x2000,
	EEPROM_WRITE_ERROR = 0x4000,
	EEPROM_BUSY = 0x8000,
};

/* An I2C EEPROM at 100 kHz gives a byte in 90 us, and takes milliseconds for a word. */
enum { READ_NS = 380000, WRITE_NS = 5000000, RELOAD_NS = 1700000, CONFIG_BYTES = 14 };

static uint8_t checksum(const uint8_t *p, size_t len)
{
	uint8_t crc = 0xff;

	/* x^8 + x^2 + x + 1, start 0xff, over words 0 to 6 (ETG.2010). */
	for (size_t i = 0; i < len; i++) {
		crc ^= p[i];
		for (unsigned bit = 0; bit < 8; bit++) {
			crc = (uint8_t)(crc & 0x80 ? (unsigned)crc << 1 ^ 0x07 : (unsigned)crc << 1);
		}
	}
	return crc;
}

static void set_status(struct esc *esc, uint16_t clear, uint16_t set)
{
	uint8_t *r = esc->reg + ESC_REG_EEPROM_CONTROL;

	put_le16(r, (uint16_t)((get_le16(r) & ~clear) | set));
}

static void load_configuration(struct esc *esc)
{
	const uint8_t *sii = esc->sii;
	int is_right = esc->sii_bytes >= 16 && checksum(sii, CONFIG_BYTES) == sii[CONFIG_BYTES];

	if (!is_right) {
		/* The chip starts, but without a PDI (data sheet: EEPROM loading error). */
		esc->is_eeprom_loaded = 0;
		set_status(esc, 0, EEPROM_CHECKSUM_ERROR | EEPROM_NOT_LOADED);
		return;
	}
	memcpy(esc->reg + ESC_REG_PDI_CONTROL, sii, 2);
	memcpy(esc->reg + ESC_REG_PDI_CONFIG, sii + 2, 2);
	memcpy(esc->reg + ESC_REG_PDI_CONFIG + 2, sii + 6, 2);
	memcpy(esc->reg + ESC_REG_DC_PULSE_LENGTH, sii + 4, 2);
	memcpy(esc->reg + ESC_REG_STATION_ALIAS, sii + 8, 2);
	if (esc->features.is_device_emulation) {
		esc->reg[ESC_REG_ESC_CONFIG] |= 1;
	}
	esc->is_eeprom_loaded = 1;
	set_status(esc, EEPROM_CHECKSUM_ERROR | EEPROM_NOT_LOADED, 0);
}

void esc_eeprom_power_on(struct esc *esc, int64_t t_ns)
{
	put_le16(esc->reg + ESC_REG_EEPROM_CONTROL,
		 (uint16_t)((esc->features.eeprom_bytes_a_read == 8 ? EEPROM_READS_8_BYTES : 0) |
			    EEPROM_NOT_LOADED | EEPROM_BUSY));
	esc->eeprom_command = EEPROM_RELOAD;
	esc->eeprom_busy_until_ns = t_ns + RELOAD_NS;
}

void esc_eeprom_command(struct esc *esc, int64_t t_ns, uint16_t control)
{
	uint16_t command = control & EEPROM_COMMAND;
	int64_t busy_ns = READ_NS;

	set_status(esc, EEPROM_ACKNOWLEDGE_ERROR | EEPROM_WRITE_ERROR, 0);
	if (command == 0) {
		return;
	}
	if (command == EEPROM_WRITE) {
		if (!(control & EEPROM_WRITE_ENABLE)) {
			set_status(esc, 0, EEPROM_WRITE_ERROR);
			return;
		}
		busy_ns = WRITE_NS;
	} else if (command == EEPROM_RELOAD) {
		busy_ns = RELOAD_NS;
	} else if (command != EEPROM_READ) {
		set_status(esc, 0, EEPROM_ACKNOWLEDGE_ERROR);
		return;
	}
	esc->eeprom_command = command;
	esc->eeprom_busy_until_ns = t_ns + busy_ns;
	set_status(esc, 0, EEPROM_BUSY);
}

void esc_eeprom_done(struct esc *esc)
{
	uint64_t at = (uint64_t)get_le32(esc->reg + ESC_REG_EEPROM_ADDRESS) * 2;
	uint8_t *data = esc->reg + ESC_REG_EEPROM_DATA;

	esc->eeprom_busy_until_ns = 0;
	set_status(esc, EEPROM_BUSY | EEPROM_COMMAND | EEPROM_WRITE_ENABLE, 0);
	if (esc->eeprom_command == EEPROM_RELOAD) {
		load_configuration(esc);
		return;
	}
	if (esc->eeprom_command == EEPROM_WRITE) {
		if (at + 2 <= esc->sii_bytes) {
			memcpy(esc->sii + at, data, 2);
		} else {
			set_status(esc, 0, EEPROM_ACKNOWLEDGE_ERROR);
		}
		return;
	}
	for (unsigned i = 0; i < esc->features.eeprom_bytes_a_read; i++) {
		/* Beyond its end an EEPROM reads as if it were erased. */
		data[i] = at + i < esc->sii_bytes ? esc->sii[at + i] : 0xff;
	}
}
