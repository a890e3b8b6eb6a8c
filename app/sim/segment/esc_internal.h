/* SPDX-License-Identifier: MIT */
/* Between the files of the ESC model; not for others. */
#ifndef SIM_SEGMENT_ESC_INTERNAL_H
#define SIM_SEGMENT_ESC_INTERNAL_H

#include "base/bytes.h"
#include "segment/esc.h"
#include "wire/esc_reg.h"

/* Who accesses, and when. A frame's registers are all latched at its start. */
enum esc_side { ESC_ECAT, ESC_PDI };

/* --- esc_sm.c --- */

/**
 * Process RAM from one side, SyncManagers minded. 1 if at least one byte was allowed. What was not
 * is left alone, in @buf too. @addr is 0x1000 or more.
 */
int esc_ram_read(struct esc *esc, enum esc_side side, uint16_t addr, uint8_t *buf, size_t len);
int esc_ram_write(struct esc *esc, enum esc_side side, int64_t t_ns, uint16_t addr,
		  const uint8_t *buf, size_t len);
/** The SM registers of SM @n were written: take them over. */
void esc_sm_configure(struct esc *esc, unsigned n, enum esc_side side);
/** The status of the SMs at @addr, as it is now. */
void esc_sm_to_registers(struct esc *esc, uint16_t addr, size_t len);
/** The digital outputs at 0x0f00 were written up to before @end: what an SM over them does. */
void esc_sm_outputs_written(struct esc *esc, int64_t t_ns, uint16_t addr, size_t len);
/** The area of an active SM at @addr as it would be read back, for bits that a write leaves alone.
 */
const uint8_t *esc_ram_last_written(struct esc *esc, uint16_t addr);

/* --- esc_fmmu.c --- */

enum fmmu_type { FMMU_READ = 1, FMMU_WRITE = 2 };

/** A logical datagram; adds to the working counter. */
void esc_fmmu_access(struct esc *esc, const struct esc_frame *frame, struct ecat_datagram *dg);

/* --- esc_register.c --- */

void esc_register_layout(struct esc *esc);
/** What was read: the registers themselves, or @buf, where some do not exist; NULL: none does. */
const uint8_t *esc_register_read(struct esc *esc, enum esc_side side, int64_t t_ns, uint16_t addr,
				 uint8_t *buf, size_t len);
/** 1 if at least one byte is writable by the master. */
int esc_register_write(struct esc *esc, const struct esc_frame *frame, uint16_t addr,
		       const uint8_t *buf, size_t len);
static inline int esc_touches(uint16_t addr, size_t len, unsigned reg, size_t reg_len)
{
	return addr < reg + reg_len && reg < addr + len;
}

/** @value was written to 0x0040 (by the master) or 0x0041. */
void esc_reset_step(struct esc *esc, enum esc_side side, uint8_t value);

/* --- esc_clock.c --- */

uint64_t esc_local_time(const struct esc *esc, int64_t t_ns);
/** First true time at or after @t_ns at which the copy of the system time is @system_ns; INT64_MAX.
 */
int64_t esc_clock_when(const struct esc *esc, int64_t t_ns, uint64_t system_ns);
/** Let the clock run with another correction from @t_ns on. */
void esc_clock_correct(struct esc *esc, int64_t t_ns, int64_t correction);

/* --- esc_dc.c --- */

/** The master's time @received_ns came with a frame that started here at @t_ns: compare and
 * regulate. */
void esc_dc_compare(struct esc *esc, int64_t t_ns, uint64_t received_ns);
/** 0x0930 was written: filters in force from now on, loop reset. */
void esc_dc_reset_filter(struct esc *esc, int64_t t_ns);
void esc_dc_to_registers(struct esc *esc);

/* --- esc_sync.c --- */

/** 0x0981 was written. */
void esc_sync_activate(struct esc *esc, int64_t t_ns);
/** The clock's rate or offset changed: when is the next edge? */
void esc_sync_replan(struct esc *esc, int64_t t_ns);
void esc_sync_edge(struct esc *esc);
void esc_sync1_edge(struct esc *esc);
/** 0x098e or 0x098f was read by the PDI. */
void esc_sync_acknowledge(struct esc *esc, unsigned sync);
/** 0x0984, 0x098e, 0x0990, 0x0998 as they are now. */
void esc_sync_to_registers(struct esc *esc);

/* --- esc_eeprom.c --- */

void esc_eeprom_power_on(struct esc *esc, int64_t t_ns);
/** 0x0500 or 0x0501 was written by @side. */
void esc_eeprom_owner(struct esc *esc, enum esc_side side);
/** May @side write 0x0502 to 0x050f now? */
int esc_eeprom_is_free(const struct esc *esc, enum esc_side side);
void esc_eeprom_command(struct esc *esc, int64_t t_ns, uint16_t control);
void esc_eeprom_done(struct esc *esc);
/** Emulation: the PDI wrote 0x0502, which ends the command. */
void esc_eeprom_answered(struct esc *esc, int64_t t_ns);
int esc_eeprom_is_asked(const struct esc *esc);

/* --- esc_watchdog.c --- */

void esc_watchdog_trigger(struct esc *esc, int64_t t_ns);
void esc_watchdog_stop(struct esc *esc);
void esc_watchdog_expire(struct esc *esc);
/** The PDI has done something. */
void esc_pdi_watchdog_trigger(struct esc *esc, int64_t t_ns);
void esc_pdi_watchdog_expire(struct esc *esc);
int esc_pdi_watchdog_is_running(const struct esc *esc);

/** The lowest bit of @set, which is not empty; it is taken out. */
static inline unsigned esc_take_lowest(unsigned *set)
{
	unsigned n = (unsigned)__builtin_ctz(*set);

	*set &= *set - 1;
	return n;
}

static inline int esc_bit(const uint8_t *map, unsigned n)
{
	return map[n / 8] >> (n % 8) & 1;
}

/** Are all @len bits from @n on set? At most 16 of them, in a map of ESC_REGISTER_BYTES. */
static inline int esc_bits(const uint8_t *map, unsigned n, size_t len)
{
	unsigned wanted = (1u << len) - 1;
	uint32_t bits;

	if (n / 8 + sizeof(bits) > ESC_REGISTER_BYTES / 8) {
		return 0;
	}
	bits = get_le32(map + n / 8) >> (n % 8);
	return (bits & wanted) == wanted;
}

#endif
