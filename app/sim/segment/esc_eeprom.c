/* SPDX-License-Identifier: MIT */
/* The SII interface 0x0500 to 0x050f over the EEPROM's contents (data sheet, ESI EEPROM). */
#include "segment/esc_internal.h"
#include "wire/sii.h"

#include <string.h>

enum eeprom_bits {
	EEPROM_WRITE_ENABLE = 0x0001,
	EEPROM_EMULATED = 0x0020,
	EEPROM_READS_8_BYTES = 0x0040,
	EEPROM_TWO_BYTE_ADDRESS = 0x0080,
	EEPROM_COMMAND = 0x0700,
	EEPROM_READ = 0x0100,
	EEPROM_WRITE = 0x0200,
	EEPROM_RELOAD = 0x0400,
	EEPROM_CHECKSUM_ERROR = 0x0800,
	EEPROM_NOT_LOADED = 0x1000,
	EEPROM_COMMAND_ERROR = 0x2000,
	EEPROM_WRITE_ERROR = 0x4000,
	EEPROM_BUSY = 0x8000,
};

enum eeprom_owner { OWNER_TO_PDI = 0x01, OWNER_FORCE_ECAT = 0x02, OWNER_IS_PDI = 0x01 };

/*
 * Captured chips take 690 us to read 8 bytes: address and data, 11 bytes of I2C. A real EK1100 is
 * ready about 300 us after a write command; its memory chip then programs the word for about 3.5 ms
 * and acknowledges nothing meanwhile, so the next command is taken and ends with bit 13. Loading
 * the configuration is our own number.
 */
enum {
	I2C_BYTE_NS = 62700,
	I2C_OVERHEAD_BYTES = 3,
	WRITE_NS = 300000,
	PROGRAM_NS = 3500000,
	RELOAD_NS = 1700000,
	CONFIG_CHECKSUM_BYTE = 14,
	CONFIG_BYTES = 16,
};

static void set_status(struct esc *esc, uint16_t clear, uint16_t set)
{
	uint8_t *r = esc->reg + ESC_REG_EEPROM_CONTROL;

	put_le16(r, (uint16_t)((get_le16(r) & ~clear) | set));
}

static void fail_loading(struct esc *esc)
{
	/* The chip starts, but without a PDI; a reload that fails leaves it as it was (data sheet).
	 */
	set_status(esc, EEPROM_NOT_LOADED,
		   EEPROM_CHECKSUM_ERROR | (esc->is_eeprom_loaded ? 0 : EEPROM_NOT_LOADED));
}

static void load_configuration(struct esc *esc, int64_t t_ns)
{
	const uint8_t *sii = esc->sii;
	uint8_t *r = esc->reg;

	if (esc->sii_bytes < CONFIG_BYTES || sii_checksum(sii) != sii[CONFIG_CHECKSUM_BYTE]) {
		fail_loading(esc);
		return;
	}
	memcpy(r + ESC_REG_PDI_CONTROL, sii, 2);
	memcpy(r + ESC_REG_PDI_CONFIG, sii + 2, 2);
	memcpy(r + ESC_REG_PDI_CONFIG + 2, sii + 6, 2);
	memcpy(r + ESC_REG_DC_PULSE_LENGTH, sii + 4, 2);
	if (!esc->was_eeprom_loaded) {
		/* Only after power-on, so that a new alias needs a power cycle (data sheet,
		 * 0x0012). */
		memcpy(r + ESC_REG_STATION_ALIAS, sii + 8, 2);
	}
	esc->is_eeprom_loaded = 1;
	esc->was_eeprom_loaded = 1;
	set_status(esc, EEPROM_CHECKSUM_ERROR | EEPROM_NOT_LOADED, 0);
	esc_register_layout(esc);
	esc_pdi_watchdog_trigger(esc, t_ns);
}

/* Bits of 0x0502 that say what the interface is. */
static uint16_t fixed_bits(const struct esc *esc)
{
	return (uint16_t)((esc->features.eeprom_bytes_a_read == 8 ? EEPROM_READS_8_BYTES : 0) |
			  (esc->features.has_long_eeprom ? EEPROM_TWO_BYTE_ADDRESS : 0) |
			  (esc->features.is_eeprom_emulated ? EEPROM_EMULATED : 0) |
			  esc->features.eeprom_status);
}

/* An emulated EEPROM loads as another one: the firmware has started before it can be asked. */
void esc_eeprom_power_on(struct esc *esc, int64_t t_ns)
{
	put_le16(esc->reg + ESC_REG_EEPROM_CONTROL,
		 (uint16_t)(fixed_bits(esc) | EEPROM_NOT_LOADED | EEPROM_BUSY));
	esc->eeprom_command = EEPROM_RELOAD;
	esc->eeprom_busy_until_ns = t_ns + RELOAD_NS;
}

void esc_eeprom_cut(struct esc *esc, unsigned words)
{
	esc->eeprom_writes_left = words;
	esc->is_eeprom_cut = 0;
}

/* --- who may --- */

static int is_pdi_owner(const struct esc *esc)
{
	return (esc->reg[ESC_REG_EEPROM_PDI_ACCESS] & OWNER_IS_PDI) != 0;
}

void esc_eeprom_owner(struct esc *esc, enum esc_side side)
{
	uint8_t *config = &esc->reg[ESC_REG_EEPROM_CONFIG];
	uint8_t *access = &esc->reg[ESC_REG_EEPROM_PDI_ACCESS];

	if (side == ESC_ECAT && (*config & OWNER_FORCE_ECAT)) {
		*access = 0;
	}
	/* The PDI takes it only where the master has offered it; else the bit does not stick. */
	if (side == ESC_PDI && !(*config & OWNER_TO_PDI)) {
		*access = 0;
	}
	*access &= OWNER_IS_PDI;
}

int esc_eeprom_is_free(const struct esc *esc, enum esc_side side)
{
	return esc->eeprom_busy_until_ns == 0 && is_pdi_owner(esc) == (side == ESC_PDI);
}

/* --- commands --- */

/* How long the interface is busy with @command; 0: it refuses, status set. */
static int64_t busy_ns(struct esc *esc, int64_t t_ns, uint16_t control)
{
	uint16_t command = control & EEPROM_COMMAND;

	if (command == EEPROM_RELOAD) {
		return RELOAD_NS;
	}
	if (command != EEPROM_READ && command != EEPROM_WRITE) {
		set_status(esc, EEPROM_COMMAND | EEPROM_WRITE_ENABLE, EEPROM_COMMAND_ERROR);
		return 0;
	}
	/* The PDI needs no enable bit: it always reads 1 there. */
	if (command == EEPROM_WRITE && !(control & EEPROM_WRITE_ENABLE) && !is_pdi_owner(esc)) {
		set_status(esc, EEPROM_COMMAND, EEPROM_WRITE_ERROR);
		return 0;
	}
	esc->is_eeprom_deaf = t_ns < esc->eeprom_writing_until_ns;
	if (esc->is_eeprom_deaf) {
		return (int64_t)I2C_OVERHEAD_BYTES * I2C_BYTE_NS;
	}
	return command == EEPROM_WRITE
		       ? WRITE_NS
		       : (int64_t)(I2C_OVERHEAD_BYTES + esc->features.eeprom_bytes_a_read) *
				 I2C_BYTE_NS;
}

void esc_eeprom_command(struct esc *esc, int64_t t_ns, uint16_t control)
{
	int64_t for_ns;

	set_status(esc, EEPROM_COMMAND_ERROR | EEPROM_WRITE_ERROR, 0);
	if ((control & EEPROM_COMMAND) == 0) {
		set_status(esc, EEPROM_WRITE_ENABLE, 0);
		return;
	}
	for_ns = busy_ns(esc, t_ns, control);
	if (for_ns == 0) {
		return;
	}
	esc->eeprom_command = control & EEPROM_COMMAND;
	esc->eeprom_busy_until_ns = t_ns + for_ns + esc->eeprom_slow_ns;
	if (esc->features.is_eeprom_emulated) {
		esc->eeprom_busy_until_ns = INT64_MAX; /* until the PDI answers */
		esc->al_event |= ESC_AL_EVENT_EEPROM;
	}
	set_status(esc, 0, EEPROM_BUSY);
}

static void write_word(struct esc *esc, size_t at, const uint8_t *data)
{
	if (esc->is_eeprom_cut) {
		return;
	}
	esc->sii[at] = data[0];
	if (esc->eeprom_writes_left == 1) {
		esc->is_eeprom_cut = 1; /* torn */
		return;
	}
	esc->sii[at + 1] = data[1];
	esc->eeprom_writes_left -= esc->eeprom_writes_left > 0;
}

void esc_eeprom_done(struct esc *esc)
{
	uint64_t at = (uint64_t)get_le32(esc->reg + ESC_REG_EEPROM_ADDRESS) * 2;
	uint8_t *data = esc->reg + ESC_REG_EEPROM_DATA;
	int64_t t_ns = esc->eeprom_busy_until_ns;

	esc->eeprom_busy_until_ns = 0;
	set_status(esc, EEPROM_BUSY | EEPROM_COMMAND | EEPROM_WRITE_ENABLE, 0);
	if (esc->eeprom_command == EEPROM_RELOAD) {
		load_configuration(esc, t_ns);
		return;
	}
	if (esc->is_eeprom_deaf ||
	    (esc->eeprom_command == EEPROM_WRITE && at + 2 > esc->sii_bytes)) {
		set_status(esc, 0, EEPROM_COMMAND_ERROR); /* no acknowledge from the memory chip */
		return;
	}
	if (esc->eeprom_command == EEPROM_WRITE) {
		write_word(esc, at, data);
		esc->eeprom_writing_until_ns = t_ns + PROGRAM_NS;
		return;
	}
	for (unsigned i = 0; i < esc->features.eeprom_bytes_a_read; i++) {
		/* Beyond its end an EEPROM reads as if it were erased. */
		data[i] = at + i < esc->sii_bytes ? esc->sii[at + i] : 0xff;
	}
}

int esc_eeprom_is_asked(const struct esc *esc)
{
	return (esc->al_event & ESC_AL_EVENT_EEPROM) != 0;
}

void esc_eeprom_answered(struct esc *esc, int64_t t_ns)
{
	uint8_t *status = esc->reg + ESC_REG_EEPROM_CONTROL;

	esc->al_event &= ~(uint32_t)ESC_AL_EVENT_EEPROM;
	esc->eeprom_busy_until_ns = 0;
	put_le16(status, (uint16_t)(fixed_bits(esc) | (get_le16(status) & EEPROM_COMMAND_ERROR)));
	if (esc->eeprom_command == EEPROM_RELOAD) {
		load_configuration(esc, t_ns);
	}
}
