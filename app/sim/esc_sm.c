/* SPDX-License-Identifier: MIT */
/*
 * SyncManagers. Buffered mode has three buffers: the writer has one, the reader one, the third is the
 * newest complete one or free; the first byte of the area opens a buffer, the last one closes it. So
 * either side always sees a whole, newest buffer. Mailbox mode is a handshake over one buffer.
 */
#include "sim/esc_inside.h"

#include <string.h>

enum sm_register {
	SM_CONTROL = 4,
	SM_STATUS = 5,
	SM_ACTIVATE = 6,
	SM_PDI_CONTROL = 7,
	SM_MODE_MAILBOX = 0x02,
	SM_DIRECTION_WRITE = 0x04,
	SM_WATCHDOG_TRIGGER = 0x40,
	SM_STATUS_WRITTEN = 0x01,
	SM_STATUS_READ = 0x02,
	SM_STATUS_FULL = 0x08,
};

struct esc_sm *esc_sm_at(struct esc *esc, uint16_t addr)
{
	for (unsigned i = 0; i < esc->features.sm_count; i++) {
		struct esc_sm *sm = &esc->sm[i];

		if (sm->is_active && addr >= sm->start && addr < sm->start + sm->len) {
			return sm;
		}
	}
	return NULL;
}

void esc_sm_status(struct esc *esc, unsigned n)
{
	const struct esc_sm *sm = &esc->sm[n];
	uint8_t *status = &esc->reg[ESC_REG_SM + n * ESC_SM_BYTES + SM_STATUS];
	uint8_t value = *status & (SM_STATUS_WRITTEN | SM_STATUS_READ);

	if (sm->is_mailbox) {
		value |= sm->is_full ? SM_STATUS_FULL : 0;
	} else {
		/* Bits 4 and 5: last written buffer, 3 when none was. */
		value |= (uint8_t)((sm->has_data ? sm->newest : 3) << 4);
	}
	*status = value;
}

static void set_event(struct esc *esc, unsigned n, int is_set)
{
	uint32_t bit = (uint32_t)ESC_AL_EVENT_SM0 << n;

	esc->al_event = is_set ? esc->al_event | bit : esc->al_event & ~bit;
}

void esc_sm_configure(struct esc *esc, unsigned n, enum esc_side side)
{
	uint8_t *r = &esc->reg[ESC_REG_SM + n * ESC_SM_BYTES];
	struct esc_sm *sm = &esc->sm[n];
	int was_active = sm->is_active;
	uint8_t repeat = (r[SM_ACTIVATE] >> 1) & 1;

	sm->start = get_le16(r);
	sm->len = get_le16(r + 2);
	sm->control = r[SM_CONTROL];
	sm->is_mailbox = (sm->control & 3) == SM_MODE_MAILBOX;
	sm->is_ecat_write = (sm->control & 0x0c) == SM_DIRECTION_WRITE;
	sm->is_active = (r[SM_ACTIVATE] & 1) && !(r[SM_PDI_CONTROL] & 1) && sm->len > 0;
	if (!was_active || !sm->is_active) {
		sm->is_full = 0;
		sm->has_data = 0;
		sm->writer = 0;
		sm->newest = 1;
		sm->reader = 2;
		r[SM_STATUS] = 0;
		set_event(esc, n, 0);
	}
	if (sm->is_mailbox && !sm->is_ecat_write && repeat != sm->ecat_repeat) {
		/* Repeat request (ETG.1000.4): the PDI puts the last answer there again. */
		esc->al_event |= ESC_AL_EVENT_SM_ACTIVATION;
	}
	sm->ecat_repeat = repeat;
	if (side == ESC_ECAT) {
		esc->al_event |= ESC_AL_EVENT_SM_ACTIVATION;
	}
	if (!sm->is_active && (sm->control & SM_WATCHDOG_TRIGGER)) {
		esc_watchdog_stop(esc);
	}
	esc_sm_status(esc, n);
}

static uint8_t *area(struct esc *esc, const struct esc_sm *sm, unsigned buffer)
{
	size_t offset = (size_t)sm->start - ESC_REG_PROCESS_RAM + (size_t)buffer * sm->len;

	/* Three buffers that run out of the RAM are a mistake in the set-up; they share the first then. */
	if (sm->is_mailbox || offset + sm->len > ESC_RAM_BYTES) {
		offset = (size_t)sm->start - ESC_REG_PROCESS_RAM;
	}
	return esc->ram + offset;
}

static int is_writer(const struct esc_sm *sm, enum esc_side side)
{
	return sm->is_ecat_write == (side == ESC_ECAT);
}

static uint8_t *status_of(struct esc *esc, unsigned n)
{
	return &esc->reg[ESC_REG_SM + n * ESC_SM_BYTES + SM_STATUS];
}

static void mailbox_closed(struct esc *esc, unsigned n, enum esc_side side, int was_write)
{
	struct esc_sm *sm = &esc->sm[n];
	uint8_t *status = status_of(esc, n);

	sm->is_full = (uint8_t)was_write;
	*status = (uint8_t)((*status & ~(SM_STATUS_WRITTEN | SM_STATUS_READ)) |
			    (was_write ? SM_STATUS_WRITTEN : SM_STATUS_READ));
	/* The event tells the PDI what the master did, and is taken back by its own answer. */
	set_event(esc, n, side == ESC_ECAT);
	esc_sm_status(esc, n);
}

static int sm_read(struct esc *esc, struct esc_sm *sm, enum esc_side side, uint16_t addr,
		   uint8_t *buf, size_t len)
{
	unsigned n = (unsigned)(sm - esc->sm);
	int is_first = addr == sm->start;
	int is_last = addr + len == (size_t)sm->start + sm->len;
	size_t at = (size_t)addr - sm->start;

	if (is_writer(sm, side) && side == ESC_ECAT && !sm->is_mailbox) {
		/* The master may read back what it wrote. */
		memcpy(buf, area(esc, sm, sm->newest) + at, len);
		return 0;
	}
	if (is_writer(sm, side)) {
		return 0;
	}
	if (sm->is_mailbox) {
		if (!sm->is_full) {
			return 0;
		}
		memcpy(buf, area(esc, sm, 0) + at, len);
		if (is_last) {
			mailbox_closed(esc, n, side, 0);
		}
		return 1;
	}
	if (is_first && sm->reader != sm->newest && sm->has_data) {
		uint8_t old = sm->reader;

		sm->reader = sm->newest;
		/* The old one is free; the writer keeps its own. */
		(void)old;
	}
	memcpy(buf, area(esc, sm, sm->reader) + at, len);
	if (is_last) {
		set_event(esc, n, side == ESC_ECAT);
	}
	return 1;
}

static uint8_t free_buffer(const struct esc_sm *sm)
{
	for (uint8_t b = 0; b < 3; b++) {
		if (b != sm->newest && b != sm->reader) {
			return b;
		}
	}
	return (uint8_t)(3 - sm->newest - (sm->newest == 0 ? 1 : 0));
}

static int sm_write(struct esc *esc, struct esc_sm *sm, enum esc_side side, int64_t t_ns,
		    uint16_t addr, const uint8_t *buf, size_t len)
{
	unsigned n = (unsigned)(sm - esc->sm);
	int is_first = addr == sm->start;
	int is_last = addr + len == (size_t)sm->start + sm->len;
	size_t at = (size_t)addr - sm->start;

	if (!is_writer(sm, side) || (sm->is_mailbox && sm->is_full)) {
		return 0;
	}
	if (sm->is_mailbox) {
		memcpy(area(esc, sm, 0) + at, buf, len);
		if (is_last) {
			mailbox_closed(esc, n, side, 1);
		}
		return 1;
	}
	if (is_first) {
		sm->writer = free_buffer(sm);
	}
	memcpy(area(esc, sm, sm->writer) + at, buf, len);
	if (is_last) {
		sm->newest = sm->writer;
		sm->has_data = 1;
		set_event(esc, n, side == ESC_ECAT);
		if (side == ESC_ECAT && (sm->control & SM_WATCHDOG_TRIGGER)) {
			esc_watchdog_trigger(esc, t_ns);
		}
		esc_sm_status(esc, n);
	}
	return 1;
}

int esc_ram_read(struct esc *esc, enum esc_side side, uint16_t addr, uint8_t *buf, size_t len)
{
	struct esc_sm *sm = esc_sm_at(esc, addr);
	size_t at = (size_t)addr - ESC_REG_PROCESS_RAM;

	if (at + len > (size_t)esc->features.ram_kib * 1024) {
		return 0;
	}
	if (sm != NULL && addr + len <= (size_t)sm->start + sm->len) {
		return sm_read(esc, sm, side, addr, buf, len);
	}
	memcpy(buf, esc->ram + at, len);
	return 1;
}

int esc_ram_write(struct esc *esc, enum esc_side side, int64_t t_ns, uint16_t addr,
		  const uint8_t *buf, size_t len)
{
	struct esc_sm *sm = esc_sm_at(esc, addr);
	size_t at = (size_t)addr - ESC_REG_PROCESS_RAM;

	if (at + len > (size_t)esc->features.ram_kib * 1024) {
		return 0;
	}
	if (sm != NULL && addr + len <= (size_t)sm->start + sm->len) {
		return sm_write(esc, sm, side, t_ns, addr, buf, len);
	}
	memcpy(esc->ram + at, buf, len);
	return 1;
}
