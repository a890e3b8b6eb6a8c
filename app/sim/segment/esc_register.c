/* SPDX-License-Identifier: MIT */
/* The register file 0x0000 to 0x0fff: what reading shows and what writing does. */
#include "segment/esc_internal.h"

#include <string.h>

#include "wire/al.h"

enum register_bits {
	CONFIG_DEVICE_EMULATION = 0x01, /* 0x0141 */
	CONFIG_ENHANCED_LINK = 0xf2,    /* all ports, or one */
	DL_EEPROM_LOADED = 0x01,        /* 0x0110 */
	DL_PDI_WATCHDOG = 0x02,
	DL_ENHANCED_LINK = 0x04,
};

enum { BITS_AT_ONCE = 16 };

/* --- reading --- */

static void refresh_dl_status(struct esc *esc)
{
	uint8_t config = esc->reg[ESC_REG_ESC_CONFIG];
	uint8_t low = esc->is_eeprom_loaded ? DL_EEPROM_LOADED : 0;

	low |= esc_pdi_watchdog_is_running(esc) ? DL_PDI_WATCHDOG : 0;
	low |= config & CONFIG_ENHANCED_LINK ? DL_ENHANCED_LINK : 0;
	esc->reg[ESC_REG_DL_STATUS] = (uint8_t)((esc->reg[ESC_REG_DL_STATUS] & 0xf0) | low);
}

static void refresh_times(struct esc *esc, enum esc_side side, int64_t t_ns, uint16_t addr,
			  size_t len)
{
	if (esc_touches(addr, len, ESC_REG_DC_SYSTEM_TIME, 8)) {
		uint64_t now = esc_system_time(esc, t_ns);

		/* The master reads when the frame was at the reference clock (data sheet, 0x0910).
		 */
		if (side == ESC_ECAT) {
			now -= get_le32(esc->reg + ESC_REG_DC_SYSTEM_TIME_DELAY);
		}
		put_le64(esc->reg + ESC_REG_DC_SYSTEM_TIME, now);
	}
	if (esc_touches(addr, len, ESC_REG_DC_SYSTEM_TIME_DIFF, 8)) {
		esc_dc_to_registers(esc);
	}
	if (esc_touches(addr, len, ESC_REG_DC_ACTIVATION_STATUS, 0x20)) {
		esc_sync_to_registers(esc);
	}
}

static void refresh(struct esc *esc, enum esc_side side, int64_t t_ns, uint16_t addr, size_t len)
{
	uint8_t *r = esc->reg;

	if (esc_touches(addr, len, ESC_REG_SM, (size_t)ESC_LIMIT_SM * ESC_SM_BYTES)) {
		esc_sm_to_registers(esc, addr, len);
	}
	if (addr + len > ESC_REG_DC_SYSTEM_TIME && addr < ESC_REG_USER_RAM) {
		refresh_times(esc, side, t_ns, addr, len);
	}
	if (addr >= ESC_REG_EEPROM_CONFIG) {
		return;
	}
	if (esc_touches(addr, len, ESC_REG_AL_STATUS, 1)) {
		esc_show_late_status(esc, t_ns);
	}
	if (addr > ESC_REG_DL_STATUS + 1 && addr + len <= ESC_REG_ECAT_EVENT_REQUEST) {
		return; /* AL status, of all slaves in each cycle */
	}
	if (esc_touches(addr, len, ESC_REG_DL_STATUS, 2)) {
		refresh_dl_status(esc);
	}
	if (esc_touches(addr, len, ESC_REG_ECAT_EVENT_REQUEST, 2)) {
		put_le16(r + ESC_REG_ECAT_EVENT_REQUEST, (uint16_t)esc->ecat_event);
	}
	if (esc_touches(addr, len, ESC_REG_AL_EVENT_REQUEST, 4)) {
		put_le32(r + ESC_REG_AL_EVENT_REQUEST, esc->al_event);
	}
	if (esc_touches(addr, len, ESC_REG_WATCHDOG_STATUS_PD, 1) &&
	    get_le16(r + ESC_REG_WATCHDOG_TIME_PD) == 0) {
		r[ESC_REG_WATCHDOG_STATUS_PD] |= 1; /* 1: active, or switched off */
	}
}

static void acknowledge_ecat(struct esc *esc, uint16_t addr, size_t len)
{
	if (esc_touches(addr, len, ESC_REG_DL_STATUS, 2)) {
		esc->ecat_event &= ~(uint32_t)ESC_ECAT_EVENT_DL_STATUS;
	}
	if (esc_touches(addr, len, ESC_REG_AL_STATUS, 2)) {
		esc->ecat_event &= ~(uint32_t)ESC_ECAT_EVENT_AL_STATUS;
	}
}

static int copy_readable(const struct esc *esc, uint16_t addr, uint8_t *buf, size_t len)
{
	int any = 0;

	for (size_t i = 0; i < len; i++) {
		size_t at = addr + i;
		int is_there = at < ESC_REGISTER_BYTES && esc_bit(esc->readable, (unsigned)at);

		buf[i] = is_there ? esc->reg[at] : 0;
		any |= is_there;
	}
	return any;
}

const uint8_t *esc_register_read(struct esc *esc, enum esc_side side, int64_t t_ns, uint16_t addr,
				 uint8_t *buf, size_t len)
{
	refresh(esc, side, t_ns, addr, len);
	if (side == ESC_ECAT) {
		acknowledge_ecat(esc, addr, len);
	}
	if (len > 0 && len <= BITS_AT_ONCE && esc_bits(esc->readable, addr, len)) {
		return esc->reg + addr;
	}
	return copy_readable(esc, addr, buf, len) ? buf : NULL;
}

/* --- writing --- */

static void latch_receive_times(struct esc *esc, const struct esc_frame *frame)
{
	for (unsigned port = 0; port < ESC_PORTS; port++) {
		/* A port that the frame does not come through keeps what it had (captures). */
		if (frame->ports_used >> port & 1) {
			put_le32(&esc->reg[ESC_REG_DC_RECEIVE_TIME_PORT + 4 * port],
				 (uint32_t)esc_local_time(esc, frame->port_ns[port]));
		}
	}
	put_le64(esc->reg + ESC_REG_DC_RECEIVE_TIME_PU, esc_local_time(esc, frame->pu_ns));
}

static int is_emulating(const struct esc *esc)
{
	return (esc->reg[ESC_REG_ESC_CONFIG] & CONFIG_DEVICE_EMULATION) != 0;
}

static void al_control_written(struct esc *esc)
{
	uint8_t *status = &esc->reg[ESC_REG_AL_STATUS];
	uint8_t control = esc->reg[ESC_REG_AL_CONTROL] & (AL_STATE_MASK | AL_ERROR);

	/* Explicit device identification (ETG.1020): the state stays, the number is in the code. */
	if ((esc->reg[ESC_REG_AL_CONTROL] & AL_ID_REQUEST) != 0 && esc->identification != 0) {
		*status |= AL_ID_REQUEST;
		put_le16(esc->reg + ESC_REG_AL_STATUS_CODE, esc->identification);
		return;
	}
	if (!is_emulating(esc)) {
		esc->al_event |= ESC_AL_EVENT_CONTROL;
		return;
	}
	/* Captures: the acknowledge bit is copied, too, and so looks like an error. */
	if (*status != control) {
		esc->ecat_event |= ESC_ECAT_EVENT_AL_STATUS;
	}
	*status = control;
}

static void time_written(struct esc *esc, int64_t t_ns, const uint8_t *buf, size_t len)
{
	uint64_t now = esc_system_time(esc, t_ns);
	/* Four bytes are enough for the comparison; the upper ones are taken as equal. */
	uint64_t received =
		len >= 8 ? get_le64(buf)
			 : now + (uint64_t)(int64_t)(int32_t)(get_le32(buf) - (uint32_t)now);

	esc_dc_compare(esc, t_ns, received);
}

static void dc_written(struct esc *esc, const struct esc_frame *frame, uint16_t addr, size_t len,
		       const uint8_t *buf)
{
	if (esc_touches(addr, len, ESC_REG_DC_RECEIVE_TIME_PORT, 1)) {
		latch_receive_times(esc, frame);
	}
	if (!esc_bit(esc->ecat_writable, ESC_REG_DC_SYSTEM_TIME)) {
		return;
	}
	if (addr <= ESC_REG_DC_SYSTEM_TIME && addr + len >= ESC_REG_DC_SYSTEM_TIME + 4u) {
		size_t skip = (size_t)(ESC_REG_DC_SYSTEM_TIME - addr);

		time_written(esc, frame->pu_ns, buf + skip, len - skip);
	}
	if (esc_touches(addr, len, ESC_REG_DC_SYSTEM_TIME_OFFSET, 8)) {
		esc->clock.offset_ns = get_le64(esc->reg + ESC_REG_DC_SYSTEM_TIME_OFFSET);
		esc_sync_replan(esc, frame->pu_ns);
	}
	if (esc_touches(addr, len, ESC_REG_DC_SPEED_COUNTER_START, 2)) {
		esc_dc_reset_filter(esc, frame->pu_ns);
	}
	if (esc_touches(addr, len, ESC_REG_DC_ACTIVATION, 1) &&
	    !(esc->reg[ESC_REG_DC_CYCLIC_CONTROL] & 1)) {
		esc_sync_activate(esc, frame->pu_ns);
	}
}

static void clear_counters(struct esc *esc, uint16_t addr, size_t len)
{
	static const struct {
		uint16_t first;
		uint16_t len;
	} groups[] = {
		{ ESC_REG_RX_ERROR_COUNTER, 12 },   { ESC_REG_ECAT_PU_ERROR, 1 },
		{ ESC_REG_PDI_ERROR, 1 },           { ESC_REG_LOST_LINK_COUNTER, 4 },
		{ ESC_REG_WATCHDOG_COUNTER_PD, 2 },
	};

	/* Writing one, whatever value, clears its group. */
	for (size_t i = 0; i < sizeof(groups) / sizeof(groups[0]); i++) {
		if (esc_touches(addr, len, groups[i].first, groups[i].len)) {
			memset(esc->reg + groups[i].first, 0, groups[i].len);
		}
	}
}

static void configure_fmmu(struct esc *esc, unsigned n)
{
	const uint8_t *r = &esc->reg[ESC_REG_FMMU + n * ESC_FMMU_BYTES];
	struct esc_fmmu *f = &esc->fmmu[n];

	f->first_bit = (int64_t)get_le32(r) * 8 + (r[6] & 7);
	f->bits = get_le16(r + 4) * 8 - (r[6] & 7) - (7 - (r[7] & 7));
	f->physical_start = get_le16(r + 8);
	f->physical_start_bit = r[10] & 7;
	f->type = r[11] & 3;
	f->is_active = (r[12] & 1) && f->bits > 0;
	esc->fmmu_active &= (uint16_t)~(1u << n);
	esc->fmmu_writing &= (uint16_t)~(1u << n);
	if (f->is_active) {
		esc->fmmu_active |= (uint16_t)(1u << n);
		esc->fmmu_writing |= (uint16_t)((f->type & FMMU_WRITE ? 1u : 0) << n);
	}
	f->is_bytewise = f->first_bit % 8 == 0 && f->bits % 8 == 0 && f->physical_start_bit == 0;
}

static void units_written(struct esc *esc, uint16_t addr, size_t len)
{
	for (unsigned n = 0; n < esc->features.fmmu_count; n++) {
		if (esc_touches(addr, len, ESC_REG_FMMU + n * ESC_FMMU_BYTES, ESC_FMMU_BYTES)) {
			configure_fmmu(esc, n);
		}
	}
	for (unsigned n = 0; n < esc->features.sm_count; n++) {
		if (esc_touches(addr, len, ESC_REG_SM + n * ESC_SM_BYTES, ESC_SM_BYTES)) {
			esc_sm_configure(esc, n, ESC_ECAT);
		}
	}
}

static void written(struct esc *esc, const struct esc_frame *frame, uint16_t addr,
		    const uint8_t *buf, size_t len)
{
	clear_counters(esc, addr, len);
	if (esc_touches(addr, len, ESC_REG_WRITE_ENABLE, 1) ||
	    esc_touches(addr, len, ESC_REG_ESC_WRITE_ENABLE, 1)) {
		esc->is_write_enabled = 1;
	}
	if (esc_touches(addr, len, ESC_REG_RESET_ECAT, 1)) {
		esc_reset_step(esc, ESC_ECAT, esc->reg[ESC_REG_RESET_ECAT]);
	}
	if (esc_touches(addr, len, ESC_REG_AL_CONTROL, 1)) {
		al_control_written(esc);
	}
	if (esc_touches(addr, len, ESC_REG_DL_CONTROL + 1, 1)) {
		esc->is_loop_changed = 1;
	}
	if (esc_touches(addr, len, ESC_REG_EEPROM_CONFIG, 1)) {
		esc_eeprom_owner(esc, ESC_ECAT);
	}
	if (esc_touches(addr, len, ESC_REG_EEPROM_CONTROL + 1, 1)) {
		esc_eeprom_command(esc, frame->pu_ns, get_le16(esc->reg + ESC_REG_EEPROM_CONTROL));
	}
	if (esc_touches(addr, len, ESC_REG_FMMU, 0x0280)) {
		units_written(esc, addr, len);
	}
	if (esc_touches(addr, len, ESC_REG_DIGITAL_OUTPUTS, 4)) {
		esc_sm_outputs_written(esc, frame->pu_ns, addr, len);
	}
	dc_written(esc, frame, addr, len, buf);
}

void esc_frame_begin(struct esc *esc)
{
	esc->is_write_enabled = 0;
}

/* Protection (0x0021 for registers, 0x0031 for all) is lifted by 0x0020 or 0x0030 in the same
 * frame. */
static int is_protected(const struct esc *esc, unsigned at)
{
	int is_on = (esc->reg[ESC_REG_WRITE_PROTECT] | esc->reg[ESC_REG_ESC_WRITE_PROTECT]) & 1;

	return is_on && !esc->is_write_enabled && at < ESC_REG_DIGITAL_OUTPUTS &&
	       at != ESC_REG_WRITE_ENABLE && at != ESC_REG_ESC_WRITE_ENABLE;
}

void esc_reset_step(struct esc *esc, enum esc_side side, uint8_t value)
{
	static const uint8_t sequence[] = { 'R', 'E', 'S' };
	uint8_t *step = &esc->reset_step[side];

	*step = (uint8_t)(value == sequence[*step] ? *step + 1 : value == sequence[0]);
	if (*step == sizeof(sequence)) {
		*step = 0;
		esc->is_reset_wanted = 1;
	}
	/* It reads as how far the sequence has come. */
	esc->reg[ESC_REG_RESET_ECAT + (side == ESC_PDI)] = *step;
}

/* Is the byte, which the master may write in general, closed to it just now? */
static int is_locked(const struct esc *esc, unsigned at)
{
	if (is_protected(esc, at)) {
		return 1;
	}
	if (at == ESC_REG_AL_CONTROL || at == ESC_REG_AL_CONTROL + 1) {
		/* A mailbox of one: the PDI must read it before it can be written again. With
		 * device emulation nobody reads it, also what came before the EEPROM was loaded. */
		return (esc->al_event & ESC_AL_EVENT_CONTROL) != 0 && !is_emulating(esc);
	}
	if (at >= ESC_REG_EEPROM_CONTROL && at < ESC_REG_MII_CONTROL) {
		return !esc_eeprom_is_free(esc, ESC_ECAT);
	}
	return at > ESC_REG_DC_CYCLIC_CONTROL && at < ESC_REG_DC_SYNC1_CYCLE + 4 &&
	       (esc->reg[ESC_REG_DC_CYCLIC_CONTROL] & 1);
}

/* Bits that the chip keeps in a register the master writes. */
static uint8_t kept_bits(const struct esc *esc, unsigned at)
{
	if (at == ESC_REG_EEPROM_CONTROL) {
		return 0xfe;
	}
	if (at == ESC_REG_EEPROM_CONTROL + 1) {
		return 0xf8;
	}
	if (at >= ESC_REG_SM && at < ESC_REG_DC_RECEIVE_TIME_PORT) {
		unsigned n = (at - ESC_REG_SM) / ESC_SM_BYTES;

		/* Status and PDI control are the slave's own; the set-up is fixed while it is
		 * active. */
		if (at % ESC_SM_BYTES == 5 || at % ESC_SM_BYTES == 7) {
			return 0xff;
		}
		return at % ESC_SM_BYTES < 5 && (esc->sm[n].activate & 1) ? 0xff : 0;
	}
	if (at >= ESC_REG_DC_RECEIVE_TIME_PORT && at < ESC_REG_DC_SYSTEM_TIME + 8u) {
		return 0xff; /* latch and compare: nothing is stored */
	}
	if (at >= ESC_REG_DC_START_TIME && at < ESC_REG_DC_START_TIME + 8u) {
		return esc->sync.is_running ? 0xff : 0;
	}
	return 0;
}

static int store(struct esc *esc, unsigned at, uint8_t value)
{
	uint8_t kept;

	if (at >= ESC_REGISTER_BYTES || !esc_bit(esc->ecat_writable, at) || is_locked(esc, at)) {
		return 0;
	}
	kept = kept_bits(esc, at);
	esc->reg[at] = (uint8_t)((esc->reg[at] & kept) | (value & ~kept));
	return 1;
}

/* The time that comes with each cycle: it is compared, and nothing is stored. */
static int is_time_only(const struct esc *esc, uint16_t addr, size_t len)
{
	return addr == ESC_REG_DC_SYSTEM_TIME && (len == 4 || len == 8) &&
	       esc_bits(esc->ecat_writable, addr, len) && !is_protected(esc, addr);
}

int esc_register_write(struct esc *esc, const struct esc_frame *frame, uint16_t addr,
		       const uint8_t *buf, size_t len)
{
	size_t run = 0; /* bytes stored without a hole, just before @i */
	int any = 0;

	if (is_time_only(esc, addr, len)) {
		time_written(esc, frame->pu_ns, buf, len);
		return 1;
	}
	for (size_t i = 0; i <= len; i++) {
		if (i < len && store(esc, (unsigned)(addr + i), buf[i])) {
			run++;
			any = 1;
		} else if (run > 0) {
			written(esc, frame, (uint16_t)(addr + i - run), buf + i - run, run);
			run = 0;
		}
	}
	return any;
}
