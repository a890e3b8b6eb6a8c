/* SPDX-License-Identifier: MIT */
/* Between the files of the ESC model; not for others. */
#ifndef SIM_ESC_INSIDE_H
#define SIM_ESC_INSIDE_H

#include "base/bytes.h"
#include "sim/esc.h"
#include "wire/esc_reg.h"

/* --- esc_sm.c --- */

enum esc_side { ESC_ECAT, ESC_PDI };

/** The SyncManager whose area holds @addr, or NULL. */
struct esc_sm *esc_sm_at(struct esc *esc, uint16_t addr);
/**
 * Process RAM from one side, SyncManagers minded. 1 if the access was allowed (at least one byte), else 0 and
 * nothing changed. @addr .. @addr + @len lies in 0x1000 and up.
 */
int esc_ram_read(struct esc *esc, enum esc_side side, uint16_t addr, uint8_t *buf, size_t len);
int esc_ram_write(struct esc *esc, enum esc_side side, int64_t t_ns, uint16_t addr,
		  const uint8_t *buf, size_t len);
/** The SM registers of SM @n were written by @side: take them over. */
void esc_sm_configure(struct esc *esc, unsigned n, enum esc_side side);
/** Put the status byte of every SM into the register file. */
void esc_sm_status(struct esc *esc, unsigned n);

/* --- esc_fmmu.c --- */

void esc_fmmu_configure(struct esc *esc, unsigned n);
/** A logical datagram; adds to the working counter. */
void esc_fmmu_access(struct esc *esc, int64_t t_ns, struct ecat_datagram *dg);

/* --- esc_register.c --- */

void esc_register_layout(struct esc *esc);
/** Registers from the wire; 1 if at least one byte exists (is writable). */
int esc_register_read(struct esc *esc, const struct esc_frame *frame, uint16_t addr, uint8_t *buf,
		      size_t len);
int esc_register_write(struct esc *esc, const struct esc_frame *frame, uint16_t addr,
		       const uint8_t *buf, size_t len);

/* --- esc_clock.c --- */

uint64_t esc_local_time(const struct esc *esc, int64_t t_ns);
/** The master's time @received came with a frame that passed at @t_ns: compare and regulate. */
void esc_clock_compare(struct esc *esc, int64_t t_ns, uint64_t received_ns);
/** 0x0930 was written: filters in force from now on, loop reset. */
void esc_clock_reset_filter(struct esc *esc);
void esc_clock_to_registers(struct esc *esc);

/* --- esc_sync.c --- */

/** 0x0981 was written. */
void esc_sync_activate(struct esc *esc, int64_t t_ns);
/** The clock's rate or offset changed: when is the next edge? */
void esc_sync_replan(struct esc *esc, int64_t t_ns);
void esc_sync_edge(struct esc *esc);

/* --- esc_eeprom.c --- */

void esc_eeprom_power_on(struct esc *esc, int64_t t_ns);
void esc_eeprom_command(struct esc *esc, int64_t t_ns, uint16_t control);
void esc_eeprom_done(struct esc *esc);

/* --- esc_watchdog.c --- */

void esc_watchdog_trigger(struct esc *esc, int64_t t_ns);
void esc_watchdog_stop(struct esc *esc);
void esc_watchdog_expire(struct esc *esc);

static inline int esc_bit(const uint8_t *map, unsigned n)
{
	return map[n / 8] >> (n % 8) & 1;
}

#endif
