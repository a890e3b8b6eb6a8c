/* SPDX-License-Identifier: MIT */
/* The register file 0x0000 to 0x0fff: which bytes exist, which the master may write, and what that does. */
#include "sim/esc_inside.h"

#include <string.h>

struct range {
	uint16_t first;
	uint16_t len;
};

/* What every ESC has. A register that does not exist gives no working counter. */
static const struct range always_readable[] = {
	{ ESC_REG_TYPE, 10 },
	{ ESC_REG_STATION_ADDRESS, 4 },
	{ ESC_REG_WRITE_ENABLE, 2 },
	{ 0x0030, 2 },
	{ ESC_REG_RESET_ECAT, 2 },
	{ ESC_REG_DL_CONTROL, 4 },
	{ 0x0108, 2 },
	{ ESC_REG_DL_STATUS, 2 },
	{ ESC_REG_AL_CONTROL, 2 },
	{ ESC_REG_AL_STATUS, 2 },
	{ ESC_REG_AL_STATUS_CODE, 2 },
	{ ESC_REG_PDI_CONTROL, 2 },
	{ ESC_REG_PDI_CONFIG, 4 },
	{ ESC_REG_ECAT_EVENT_MASK, 2 },
	{ ESC_REG_AL_EVENT_MASK, 4 },
	{ ESC_REG_ECAT_EVENT_REQUEST, 2 },
	{ ESC_REG_AL_EVENT_REQUEST, 4 },
	{ ESC_REG_RX_ERROR_COUNTER, 14 },
	{ ESC_REG_LOST_LINK_COUNTER, 4 },
	{ ESC_REG_WATCHDOG_DIVIDER, 2 },
	{ ESC_REG_WATCHDOG_TIME_PDI, 2 },
	{ ESC_REG_WATCHDOG_TIME_PD, 2 },
	{ ESC_REG_WATCHDOG_STATUS_PD, 4 },
	{ ESC_REG_EEPROM_CONFIG, 16 },
	{ ESC_REG_MII_CONTROL, 6 },
	{ ESC_REG_USER_RAM, 128 },
};

static const struct range always_writable[] = {
	{ ESC_REG_STATION_ADDRESS, 2 },
	{ ESC_REG_WRITE_ENABLE, 2 },
	{ 0x0030, 2 },
	{ ESC_REG_RESET_ECAT, 1 },
	{ ESC_REG_DL_CONTROL, 4 },
	{ ESC_REG_AL_CONTROL, 2 },
	{ ESC_REG_ECAT_EVENT_MASK, 2 },
	{ ESC_REG_RX_ERROR_COUNTER, 14 },
	{ ESC_REG_LOST_LINK_COUNTER, 4 },
	{ ESC_REG_WATCHDOG_DIVIDER, 2 },
	{ ESC_REG_WATCHDOG_TIME_PDI, 2 },
	{ ESC_REG_WATCHDOG_TIME_PD, 2 },
	{ ESC_REG_WATCHDOG_COUNTER_PD, 2 },
	{ ESC_REG_EEPROM_CONFIG, 1 },
	{ ESC_REG_EEPROM_CONTROL, 14 },
	{ ESC_REG_MII_CONTROL, 6 },
	{ ESC_REG_USER_RAM, 128 },
};

static const struct range system_time_readable[] = {
	{ ESC_REG_DC_SYSTEM_TIME, 0x26 },
};

static const struct range system_time_writable[] = {
	{ ESC_REG_DC_SYSTEM_TIME, 8 },        { ESC_REG_DC_SYSTEM_TIME_OFFSET, 8 },
	{ ESC_REG_DC_SYSTEM_TIME_DELAY, 4 },  { ESC_REG_DC_SPEED_COUNTER_START, 2 },
	{ ESC_REG_DC_TIME_FILTER, 3 },
};

static const struct range sync_readable[] = { { ESC_REG_DC_CYCLIC_CONTROL, 5 },
					      { ESC_REG_DC_SYNC0_STATUS, 2 },
					      { ESC_REG_DC_START_TIME, 24 } };
static const struct range sync_writable[] = { { ESC_REG_DC_CYCLIC_CONTROL, 2 },
					      { ESC_REG_DC_START_TIME, 8 },
					      { ESC_REG_DC_SYNC0_CYCLE, 8 } };

#define COUNT(a) (sizeof(a) / sizeof((a)[0]))

static void mark(uint8_t *map, const struct range *ranges, size_t count)
{
	for (size_t i = 0; i < count; i++) {
		for (unsigned n = ranges[i].first; n < (unsigned)ranges[i].first + ranges[i].len; n++) {
			map[n / 8] |= (uint8_t)(1u << (n % 8));
		}
	}
}

static void mark_units(struct esc *esc, uint16_t first, unsigned unit_bytes, unsigned count)
{
	for (unsigned n = 0; n < count; n++) {
		struct range all = { (uint16_t)(first + n * unit_bytes), (uint16_t)unit_bytes };

		mark(esc->readable, &all, 1);
		mark(esc->ecat_writable, &all, 1);
	}
}

void esc_register_layout(struct esc *esc)
{
	static const struct range ports = { ESC_REG_DC_RECEIVE_TIME_PORT, 16 };
	static const struct range latch = { ESC_REG_DC_RECEIVE_TIME_PORT, 4 };
	const struct esc_features *f = &esc->features;

	memset(esc->readable, 0, sizeof(esc->readable));
	memset(esc->ecat_writable, 0, sizeof(esc->ecat_writable));
	mark(esc->readable, always_readable, COUNT(always_readable));
	mark(esc->ecat_writable, always_writable, COUNT(always_writable));
	mark_units(esc, ESC_REG_FMMU, ESC_FMMU_BYTES, f->fmmu_count);
	mark_units(esc, ESC_REG_SM, ESC_SM_BYTES, f->sm_count);
	if (f->dc != ESC_DC_NONE) {
		mark(esc->readable, &ports, 1);
		mark(esc->ecat_writable, &latch, 1);
	}
	if (f->dc == ESC_DC_32 || f->dc == ESC_DC_64) {
		mark(esc->readable, system_time_readable, COUNT(system_time_readable));
		mark(esc->ecat_writable, system_time_writable, COUNT(system_time_writable));
	}
	if (f->has_sync_unit) {
		mark(esc->readable, sync_readable, COUNT(sync_readable));
		mark(esc->ecat_writable, sync_writable, COUNT(sync_writable));
	}
}

static int touches(uint16_t addr, size_t len, uint16_t reg, size_t reg_len)
{
	return addr < reg + reg_len && reg < addr + len;
}

static void refresh(struct esc *esc, int64_t t_ns, uint16_t addr, size_t len)
{
	if (touches(addr, len, ESC_REG_DC_SYSTEM_TIME, 8)) {
		put_le64(esc->reg + ESC_REG_DC_SYSTEM_TIME, esc_system_time(esc, t_ns));
	}
	if (touches(addr, len, ESC_REG_DC_SYSTEM_TIME_DIFF, 8)) {
		esc_clock_to_registers(esc);
	}
	if (touches(addr, len, ESC_REG_AL_EVENT_REQUEST, 4)) {
		put_le32(esc->reg + ESC_REG_AL_EVENT_REQUEST, esc->al_event);
	}
}

int esc_register_read(struct esc *esc, const struct esc_frame *frame, uint16_t addr, uint8_t *buf,
		      size_t len)
{
	int any = 0;

	refresh(esc, frame->pu_ns, addr, len);
	for (size_t i = 0; i < len; i++) {
		size_t at = addr + i;
		int is_there = at < ESC_REGISTER_BYTES && esc_bit(esc->readable, (unsigned)at);

		buf[i] = is_there ? esc->reg[at] : 0;
		any |= is_there;
	}
	return any;
}

static void latch_receive_times(struct esc *esc, const struct esc_frame *frame)
{
	for (unsigned port = 0; port < ESC_PORTS; port++) {
		uint32_t local = frame->ports_used >> port & 1
					 ? (uint32_t)esc_local_time(esc, frame->port_ns[port])
					 : 0;

		put_le32(esc->reg + ESC_REG_DC_RECEIVE_TIME_PORT + 4 * port, local);
	}
	put_le64(esc->reg + ESC_REG_DC_RECEIVE_TIME_PU, esc_local_time(esc, frame->pu_ns));
}

static void al_control_written(struct esc *esc)
{
	if (esc->reg[ESC_REG_ESC_CONFIG] & 1) {
		esc->reg[ESC_REG_AL_STATUS] = esc->reg[ESC_REG_AL_CONTROL] & 0x0f;
		return;
	}
	esc->al_event |= ESC_AL_EVENT_CONTROL;
}

static void dc_written(struct esc *esc, const struct esc_frame *frame, uint16_t addr, size_t len,
		       const uint8_t *buf)
{
	uint8_t *r = esc->reg;

	if (touches(addr, len, ESC_REG_DC_RECEIVE_TIME_PORT, 4)) {
		latch_receive_times(esc, frame);
	}
	if (esc->features.dc != ESC_DC_32 && esc->features.dc != ESC_DC_64) {
		return;
	}
	if (addr == ESC_REG_DC_SYSTEM_TIME && len >= 4) {
		uint64_t now = esc_system_time(esc, frame->pu_ns);
		/* Four bytes are enough for the comparison; the upper ones are taken as equal. */
		uint64_t received = len >= 8 ? get_le64(buf)
					     : now + (uint64_t)(int64_t)(int32_t)(get_le32(buf) -
										  (uint32_t)now);

		esc_clock_compare(esc, frame->pu_ns, received);
	}
	if (touches(addr, len, ESC_REG_DC_SYSTEM_TIME_OFFSET, 8)) {
		esc->clock.offset_ns = get_le64(r + ESC_REG_DC_SYSTEM_TIME_OFFSET);
		esc_sync_replan(esc, frame->pu_ns);
	}
	if (touches(addr, len, ESC_REG_DC_SPEED_COUNTER_START, 2)) {
		esc_clock_reset_filter(esc);
	}
	if (touches(addr, len, ESC_REG_DC_ACTIVATION, 1)) {
		esc_sync_activate(esc, frame->pu_ns);
	}
}

static void clear_counters(struct esc *esc, uint16_t addr, size_t len)
{
	if (touches(addr, len, ESC_REG_RX_ERROR_COUNTER, 12)) {
		memset(esc->reg + ESC_REG_RX_ERROR_COUNTER, 0, 12);
	}
	if (touches(addr, len, ESC_REG_ECAT_PU_ERROR, 1)) {
		esc->reg[ESC_REG_ECAT_PU_ERROR] = 0;
	}
	if (touches(addr, len, ESC_REG_PDI_ERROR, 1)) {
		esc->reg[ESC_REG_PDI_ERROR] = 0;
	}
	if (touches(addr, len, ESC_REG_LOST_LINK_COUNTER, 4)) {
		memset(esc->reg + ESC_REG_LOST_LINK_COUNTER, 0, 4);
	}
	if (touches(addr, len, ESC_REG_WATCHDOG_COUNTER_PD, 2)) {
		memset(esc->reg + ESC_REG_WATCHDOG_COUNTER_PD, 0, 2);
	}
}

static void written(struct esc *esc, const struct esc_frame *frame, uint16_t addr,
		    const uint8_t *buf, size_t len)
{
	clear_counters(esc, addr, len);
	if (touches(addr, len, ESC_REG_AL_CONTROL, 2)) {
		al_control_written(esc);
	}
	if (touches(addr, len, ESC_REG_EEPROM_CONTROL, 2)) {
		esc_eeprom_command(esc, frame->pu_ns, get_le16(esc->reg + ESC_REG_EEPROM_CONTROL));
	}
	for (unsigned n = 0; n < esc->features.fmmu_count; n++) {
		if (touches(addr, len, (uint16_t)(ESC_REG_FMMU + n * ESC_FMMU_BYTES), ESC_FMMU_BYTES)) {
			esc_fmmu_configure(esc, n);
		}
	}
	for (unsigned n = 0; n < esc->features.sm_count; n++) {
		if (touches(addr, len, (uint16_t)(ESC_REG_SM + n * ESC_SM_BYTES), ESC_SM_BYTES)) {
			esc_sm_configure(esc, n, ESC_ECAT);
		}
	}
	dc_written(esc, frame, addr, len, buf);
}

static int is_pdi_owned(const struct esc *esc, size_t at)
{
	return at > ESC_REG_DC_CYCLIC_CONTROL && at < ESC_REG_DC_SYNC1_CYCLE + 4 &&
	       (esc->reg[ESC_REG_DC_CYCLIC_CONTROL] & 1);
}

/* Bits that the chip itself keeps in a register the master writes. */
static uint8_t kept_bits(size_t at)
{
	switch (at) {
	case ESC_REG_EEPROM_CONTROL:
		return 0xfe;
	case ESC_REG_EEPROM_CONTROL + 1:
		return 0xf8;
	default:
		break;
	}
	if (at >= ESC_REG_SM && at < ESC_REG_SM + ESC_LIMIT_SM * ESC_SM_BYTES) {
		/* SM status and PDI control are the slave's own. */
		return at % ESC_SM_BYTES == 5 || at % ESC_SM_BYTES == 7 ? 0xff : 0;
	}
	return 0;
}

int esc_register_write(struct esc *esc, const struct esc_frame *frame, uint16_t addr,
		       const uint8_t *buf, size_t len)
{
	int any = 0;

	for (size_t i = 0; i < len; i++) {
		size_t at = addr + i;
		uint8_t kept;

		if (at >= ESC_REGISTER_BYTES || !esc_bit(esc->ecat_writable, (unsigned)at) ||
		    is_pdi_owned(esc, at)) {
			continue;
		}
		any = 1;
		if (at >= ESC_REG_DC_RECEIVE_TIME_PORT && at < ESC_REG_DC_SYSTEM_TIME + 8u) {
			continue; /* latch and compare: nothing is stored */
		}
		kept = kept_bits(at);
		esc->reg[at] = (uint8_t)((esc->reg[at] & kept) | (buf[i] & ~kept));
	}
	if (any) {
		written(esc, frame, addr, buf, len);
	}
	return any;
}
