/* SPDX-License-Identifier: MIT */
/* The application's side of the chip: what reading acknowledges and what it may write. */
#include "segment/esc_internal.h"

#include <string.h>

#include "wire/al.h"

enum { SYNC0_IS_OUTPUT = 0x04 }; /* 0x0151 */

int esc_eeprom_loaded(const struct esc *esc)
{
	return esc->is_eeprom_loaded;
}

int esc_has_sync0_pin(const struct esc *esc)
{
	return (esc->reg[ESC_REG_SYNC_LATCH_CONFIG] & SYNC0_IS_OUTPUT) != 0;
}

int esc_take_reset(struct esc *esc)
{
	int was = esc->is_reset_wanted;

	esc->is_reset_wanted = 0;
	return was;
}

/* Reading is how the firmware acknowledges. */
static void acknowledge(struct esc *esc, uint16_t addr, size_t len)
{
	if (esc_touches(addr, len, ESC_REG_AL_CONTROL, 2)) {
		esc->al_event &= ~(uint32_t)ESC_AL_EVENT_CONTROL;
	}
	if (esc_touches(addr, len, ESC_REG_WATCHDOG_STATUS_PD, 1)) {
		esc->al_event &= ~(uint32_t)ESC_AL_EVENT_WATCHDOG;
	}
	if (esc_touches(addr, len, ESC_REG_DC_SYNC0_STATUS, 1)) {
		esc_sync_acknowledge(esc, 0);
	}
	if (esc_touches(addr, len, ESC_REG_DC_SYNC1_STATUS, 1)) {
		esc_sync_acknowledge(esc, 1);
	}
	if (addr >= ESC_REG_DC_RECEIVE_TIME_PORT || addr + len <= ESC_REG_SM) {
		return;
	}
	for (unsigned n = 0; n < esc->features.sm_count; n++) {
		if (esc_touches(addr, len, ESC_REG_SM + n * ESC_SM_BYTES + 6, 1)) {
			esc->sm_activations &= ~(1u << n);
		}
	}
	if (esc->sm_activations == 0) {
		esc->al_event &= ~(uint32_t)ESC_AL_EVENT_SM_ACTIVATION;
	}
}

void esc_pdi_read(struct esc *esc, int64_t t_ns, uint16_t addr, void *buf, size_t len)
{
	const uint8_t *reg;

	memset(buf, 0, len);
	if (!esc->is_eeprom_loaded || len == 0) {
		return;
	}
	esc_pdi_watchdog_trigger(esc, t_ns);
	if (addr >= ESC_REG_PROCESS_RAM) {
		esc_ram_read(esc, ESC_PDI, addr, buf, len);
		return;
	}
	if ((size_t)addr + len > ESC_REG_PROCESS_RAM) {
		len = (size_t)ESC_REG_PROCESS_RAM - addr;
	}
	reg = esc_register_read(esc, ESC_PDI, t_ns, addr, buf, len);
	if (reg != NULL && reg != buf) {
		memcpy(buf, reg, len);
	}
	acknowledge(esc, addr, len);
}

void esc_pdi_read_al_event(struct esc *esc, int64_t t_ns, uint8_t ret_octets[3])
{
	uint32_t event = esc->is_eeprom_loaded ? esc->al_event : 0;

	ret_octets[0] = (uint8_t)event;
	ret_octets[1] = (uint8_t)(event >> 8);
	ret_octets[2] = (uint8_t)(event >> 16);
	if (esc->is_eeprom_loaded) {
		esc_pdi_watchdog_trigger(esc, t_ns);
	}
}

/* What the data sheet lets the PDI write, of what is modelled. */
static int is_writable(const struct esc *esc, unsigned addr)
{
	if (addr >= ESC_REG_EEPROM_CONTROL && addr < ESC_REG_EEPROM_DATA + 8) {
		return esc_eeprom_is_free(esc, ESC_PDI) || esc_eeprom_is_asked(esc);
	}
	if (addr > ESC_REG_DC_CYCLIC_CONTROL && addr < ESC_REG_DC_SYNC1_CYCLE + 4) {
		return esc->features.has_sync_unit &&
		       (esc->reg[ESC_REG_DC_CYCLIC_CONTROL] & 1) != 0 &&
		       esc_bit(esc->ecat_writable, addr);
	}
	/* With device emulation the chip itself answers AL control (0x0141 bit 0). */
	if (addr >= ESC_REG_AL_STATUS && addr < ESC_REG_AL_STATUS_CODE + 2) {
		return addr != ESC_REG_AL_STATUS + 2 && addr != ESC_REG_AL_STATUS + 3 &&
		       !(esc->reg[ESC_REG_ESC_CONFIG] & 1);
	}
	return (addr >= ESC_REG_STATION_ALIAS && addr < ESC_REG_STATION_ALIAS + 2) ||
	       (addr >= ESC_REG_AL_EVENT_MASK && addr < ESC_REG_AL_EVENT_MASK + 4) ||
	       addr == ESC_REG_EEPROM_PDI_ACCESS || addr >= ESC_REG_USER_RAM;
}

static void set_al_status(struct esc *esc, uint8_t value)
{
	if (esc->reg[ESC_REG_AL_STATUS] != value) {
		esc->ecat_event |= ESC_ECAT_EVENT_AL_STATUS;
	}
	esc->reg[ESC_REG_AL_STATUS] = value;
}

void esc_show_late_status(struct esc *esc, int64_t t_ns)
{
	if (esc->al_late_ns != 0 && t_ns >= esc->al_late_ns) {
		esc->al_late_ns = 0;
		set_al_status(esc, esc->al_late_status);
	}
}

/* As the application writes it, or as a fault (struct esc_al_fault) has it. */
static void write_al_status(struct esc *esc, int64_t t_ns, uint8_t value)
{
	const struct esc_al_fault *fault = &esc->al_fault;
	uint8_t state = value & AL_STATE_MASK;
	uint8_t from = esc->reg[ESC_REG_AL_STATUS] & AL_STATE_MASK;
	int is_change = (value & AL_ERROR) == 0 && state != from;

	if (esc->al_late_ns != 0 && value == esc->al_late_status) {
		return; /* requested again meanwhile */
	}
	esc->al_late_ns = 0;
	esc->is_al_refused = 0;
	if (is_change && state == fault->refused_state) {
		esc->is_al_refused = 1;
		set_al_status(esc, from | AL_ERROR);
		put_le16(esc->reg + ESC_REG_AL_STATUS_CODE, fault->refused_code);
	} else if (is_change && state == fault->slow_state) {
		esc->al_late_ns = t_ns + fault->slow_ns;
		esc->al_late_status = value;
	} else {
		set_al_status(esc, value);
	}
}

static void write_register(struct esc *esc, int64_t t_ns, unsigned addr, uint8_t value)
{
	unsigned sm = (addr - ESC_REG_SM) / ESC_SM_BYTES;

	if (addr >= ESC_REG_SM && sm < esc->features.sm_count) {
		if (addr % ESC_SM_BYTES == 7) {
			esc->reg[addr] = value & 3;
			esc_sm_configure(esc, sm, ESC_PDI);
		}
		return;
	}
	if (addr == ESC_REG_RESET_PDI) {
		esc_reset_step(esc, ESC_PDI, value);
		return;
	}
	if (!is_writable(esc, addr)) {
		return;
	}
	if (addr == ESC_REG_AL_STATUS) {
		write_al_status(esc, t_ns, value);
		return;
	}
	if (addr >= ESC_REG_AL_STATUS_CODE && addr < ESC_REG_AL_STATUS_CODE + 2 &&
	    esc->is_al_refused) {
		return;
	}
	/* The SYNC unit counts on with the start time it was given. */
	if (addr >= ESC_REG_DC_START_TIME && addr < ESC_REG_DC_START_TIME + 8 &&
	    esc->sync.is_running) {
		return;
	}
	esc->reg[addr] = value;
}

void esc_pdi_write(struct esc *esc, int64_t t_ns, uint16_t addr, const void *buf, size_t len)
{
	const uint8_t *bytes = buf;

	if (!esc->is_eeprom_loaded || len == 0) {
		return;
	}
	esc_pdi_watchdog_trigger(esc, t_ns);
	if (addr >= ESC_REG_PROCESS_RAM) {
		esc_ram_write(esc, ESC_PDI, t_ns, addr, buf, len);
		return;
	}
	for (size_t i = 0; i < len && addr + i < ESC_REGISTER_BYTES; i++) {
		write_register(esc, t_ns, (unsigned)(addr + i), bytes[i]);
	}
	if (esc_touches(addr, len, ESC_REG_DC_ACTIVATION, 1) &&
	    (esc->reg[ESC_REG_DC_CYCLIC_CONTROL] & 1)) {
		esc_sync_activate(esc, t_ns);
	}
	if (esc_touches(addr, len, ESC_REG_EEPROM_PDI_ACCESS, 1)) {
		esc_eeprom_owner(esc, ESC_PDI);
	}
	if (esc_touches(addr, len, ESC_REG_EEPROM_CONTROL + 1, 1) && esc_eeprom_is_asked(esc)) {
		esc_eeprom_answered(esc, t_ns);
	} else if (esc_touches(addr, len, ESC_REG_EEPROM_CONTROL + 1, 1) &&
		   esc_eeprom_is_free(esc, ESC_PDI)) {
		esc_eeprom_command(esc, t_ns, get_le16(esc->reg + ESC_REG_EEPROM_CONTROL));
	}
}
