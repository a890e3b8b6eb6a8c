/* SPDX-License-Identifier: MIT */
/*
 * SyncManagers. Buffered mode has three buffers: the writer has one, the reader one, the third is
 * the newest complete one or free; the first byte of the area opens a buffer, the last one closes
 * it. So either side always sees a whole, newest buffer. Mailbox mode is a handshake over one
 * buffer.
 */
#include "segment/esc_internal.h"

#include <string.h>

enum sm_register {
	SM_CONTROL = 4,
	SM_STATUS = 5,
	SM_ACTIVATE = 6,
	SM_PDI_CONTROL = 7,
	SM_MODE_MAILBOX = 0x02,
	SM_DIRECTION_WRITE = 0x04,
	SM_ECAT_EVENT = 0x10,
	SM_AL_EVENT = 0x20,
	SM_WATCHDOG_TRIGGER = 0x40,
	SM_STATUS_WRITTEN = 0x01,
	SM_STATUS_READ = 0x02,
	SM_STATUS_FULL = 0x08,
	SM_STATUS_READER_OPEN = 0x40,
	SM_STATUS_WRITER_OPEN = 0x80,
	SM_BUFFERS = 3,
};

static unsigned number_of(const struct esc *esc, const struct esc_sm *sm)
{
	return (unsigned)(sm - esc->sm);
}

static uint8_t status(const struct esc *esc, const struct esc_sm *sm)
{
	uint8_t value = sm->marks;

	if (sm->is_mailbox) {
		value |= sm->is_full ? SM_STATUS_FULL : 0;
	} else {
		/* Bits 4 and 5: last written buffer, 3 when none was. */
		value |= (uint8_t)((sm->has_data ? sm->newest : 3) << 4);
	}
	if (esc->features.has_open_bits) {
		value |= sm->is_reader_open ? SM_STATUS_READER_OPEN : 0;
		value |= sm->is_writer_open ? SM_STATUS_WRITER_OPEN : 0;
	}
	return value;
}

void esc_sm_to_registers(struct esc *esc, uint16_t addr, size_t len)
{
	unsigned n = addr > ESC_REG_SM ? ((unsigned)addr - ESC_REG_SM) / ESC_SM_BYTES : 0;

	for (; n < esc->features.sm_count && ESC_REG_SM + n * ESC_SM_BYTES < addr + len; n++) {
		esc->reg[ESC_REG_SM + n * ESC_SM_BYTES + SM_STATUS] = status(esc, &esc->sm[n]);
	}
}

/* Status bits 0 and 1 say what was completed last, until the other side begins. */
static void mark(struct esc_sm *sm, unsigned set, unsigned clear)
{
	sm->marks = (uint8_t)((sm->marks & ~clear) | set);
}

/* --- events: one side's are set when the other has completed, and taken back when it begins --- */

static void set_event(struct esc *esc, const struct esc_sm *sm, enum esc_side completed_by)
{
	unsigned n = number_of(esc, sm);

	if (completed_by == ESC_ECAT && (sm->control & SM_AL_EVENT)) {
		esc->al_event |= (uint32_t)ESC_AL_EVENT_SM0 << n;
	}
	if (completed_by == ESC_PDI && (sm->control & SM_ECAT_EVENT)) {
		esc->ecat_event |= (uint32_t)ESC_ECAT_EVENT_SM0 << n;
	}
}

static void clear_event(struct esc *esc, const struct esc_sm *sm, enum esc_side begun_by)
{
	unsigned n = number_of(esc, sm);

	if (begun_by == ESC_PDI) {
		esc->al_event &= ~((uint32_t)ESC_AL_EVENT_SM0 << n);
	} else {
		esc->ecat_event &= ~((uint32_t)ESC_ECAT_EVENT_SM0 << n);
	}
}

/* --- set-up --- */

static void reset(struct esc *esc, struct esc_sm *sm)
{
	sm->is_reader_open = 0;
	sm->is_writer_open = 0;
	sm->is_full = 0;
	sm->has_data = 0;
	sm->writer = 0;
	sm->newest = 1;
	sm->reader = 2;
	clear_event(esc, sm, ESC_PDI);
	clear_event(esc, sm, ESC_ECAT);
	mark(sm, 0, SM_STATUS_WRITTEN | SM_STATUS_READ);
}

static size_t ram_end(const struct esc *esc)
{
	return ESC_REG_PROCESS_RAM + (size_t)esc->features.ram_kib * 1024;
}

static int is_apart(const struct esc *esc, const struct esc_sm *sm)
{
	for (unsigned left = esc->sm_mapped; left != 0;) {
		const struct esc_sm *other = &esc->sm[esc_take_lowest(&left)];

		if (other != sm && other->start < sm->start + sm->len &&
		    sm->start < other->start + other->len) {
			return 0;
		}
	}
	return (size_t)sm->start + sm->len <= ram_end(esc);
}

static void map_areas(struct esc *esc)
{
	esc->sm_mapped = 0;
	esc->sm_apart = 0;
	for (unsigned n = 0; n < esc->features.sm_count; n++) {
		const struct esc_sm *sm = &esc->sm[n];

		if ((sm->is_active || sm->is_locked) && sm->start >= ESC_REG_PROCESS_RAM) {
			esc->sm_mapped |= (uint16_t)(1u << n);
		}
	}
	for (unsigned left = esc->sm_mapped; left != 0;) {
		unsigned n = esc_take_lowest(&left);

		esc->sm_apart |= (uint16_t)((unsigned)is_apart(esc, &esc->sm[n]) << n);
	}
}

void esc_sm_configure(struct esc *esc, unsigned n, enum esc_side side)
{
	uint8_t *r = &esc->reg[ESC_REG_SM + n * ESC_SM_BYTES];
	struct esc_sm *sm = &esc->sm[n];
	int was_active = sm->is_active;

	sm->start = get_le16(r);
	sm->len = get_le16(r + 2);
	sm->control = r[SM_CONTROL];
	sm->is_mailbox = (sm->control & 3) == SM_MODE_MAILBOX;
	sm->is_ecat_write = (sm->control & 0x0c) == SM_DIRECTION_WRITE;
	sm->is_active = (r[SM_ACTIVATE] & 1) && !(r[SM_PDI_CONTROL] & 1) && sm->len > 0;
	sm->is_locked = (r[SM_ACTIVATE] & 1) && (r[SM_PDI_CONTROL] & 1) && sm->len > 0;
	map_areas(esc);
	if (!was_active || !sm->is_active) {
		reset(esc, sm);
	}
	if (side == ESC_ECAT && r[SM_ACTIVATE] != sm->activate) {
		/* Switched on or off, or a repeat request: the PDI has to look (0x0220 bit 4). */
		esc->sm_activations |= 1u << n;
		esc->al_event |= ESC_AL_EVENT_SM_ACTIVATION;
	}
	sm->activate = r[SM_ACTIVATE];
	if (was_active && !sm->is_active && (sm->control & SM_WATCHDOG_TRIGGER)) {
		esc_watchdog_stop(esc);
	}
}

/* --- buffers --- */

static size_t buffer_offset(const struct esc_sm *sm, unsigned buffer)
{
	size_t offset = (size_t)sm->start - ESC_REG_PROCESS_RAM + (size_t)buffer * sm->len;

	/* Three buffers that run out of the RAM are a mistake in the set-up; they share the first.
	 */
	if (sm->is_mailbox || offset + sm->len > ESC_RAM_BYTES) {
		offset = (size_t)sm->start - ESC_REG_PROCESS_RAM;
	}
	return offset;
}

static uint8_t free_buffer(const struct esc_sm *sm)
{
	uint8_t b = 0;

	/* Of three, one is neither the newest nor the reader's. */
	while (b == sm->newest || b == sm->reader) {
		b++;
	}
	return b;
}

static int is_writer(const struct esc_sm *sm, enum esc_side side)
{
	return sm->is_ecat_write == (side == ESC_ECAT);
}

/* A buffered area from its first byte to its last, as it is usually read: opened and closed. */
static int sm_read_whole(struct esc *esc, struct esc_sm *sm, enum esc_side side, uint8_t *buf)
{
	sm->reader = sm->has_data ? sm->newest : sm->reader;
	sm->is_reader_open = 0;
	clear_event(esc, sm, side);
	memcpy(buf, esc->ram + buffer_offset(sm, sm->reader), sm->len);
	set_event(esc, sm, side);
	mark(sm, SM_STATUS_READ, SM_STATUS_WRITTEN);
	return 1;
}

static int sm_read(struct esc *esc, struct esc_sm *sm, enum esc_side side, size_t at, uint8_t *buf,
		   size_t len)
{
	if (sm->is_locked || is_writer(sm, side) || (sm->is_mailbox && !sm->is_full)) {
		return 0;
	}
	if (len == sm->len && !sm->is_mailbox) {
		return sm_read_whole(esc, sm, side, buf);
	}
	if (at == 0) {
		sm->is_reader_open = 1;
		sm->reader = !sm->is_mailbox && sm->has_data ? sm->newest : sm->reader;
		clear_event(esc, sm, side);
		mark(sm, 0, SM_STATUS_WRITTEN);
	}
	if (!sm->is_reader_open) {
		return 0;
	}
	memcpy(buf, esc->ram + buffer_offset(sm, sm->reader) + at, len);
	if (at + len == sm->len) {
		sm->is_reader_open = 0;
		sm->is_full = 0;
		set_event(esc, sm, side);
		mark(sm, SM_STATUS_READ, 0);
	}
	return 1;
}

static void close_writer(struct esc *esc, struct esc_sm *sm, enum esc_side side, int64_t t_ns)
{
	sm->is_writer_open = 0;
	sm->is_full = sm->is_mailbox;
	sm->completed++;
	sm->newest = sm->writer;
	sm->has_data = 1;
	set_event(esc, sm, side);
	mark(sm, SM_STATUS_WRITTEN, 0);
	if (side == ESC_ECAT && (sm->control & SM_WATCHDOG_TRIGGER)) {
		esc_watchdog_trigger(esc, t_ns);
	}
}

/* Who writes, and when. */
struct writer {
	enum esc_side side;
	int64_t t_ns;
};

static int sm_write(struct esc *esc, struct esc_sm *sm, const struct writer *by, size_t at,
		    const uint8_t *buf, size_t len)
{
	if (sm->is_locked || !is_writer(sm, by->side) || (sm->is_mailbox && sm->is_full) ||
	    (by->side == ESC_PDI && sm->is_mailbox && by->t_ns < esc->mailbox_stuck_until_ns)) {
		return 0;
	}
	if (at == 0) {
		sm->is_writer_open = 1;
		sm->writer = sm->is_mailbox ? 0 : free_buffer(sm);
		clear_event(esc, sm, by->side);
		mark(sm, 0, SM_STATUS_READ);
	}
	if (!sm->is_writer_open) {
		return 0;
	}
	memcpy(esc->ram + buffer_offset(sm, sm->writer) + at, buf, len);
	if (at + len == sm->len) {
		close_writer(esc, sm, by->side, by->t_ns);
	}
	return 1;
}

/* --- the RAM in pieces: each within one SM's area, or within none --- */

static struct esc_sm *sm_at(struct esc *esc, size_t addr, size_t *len)
{
	for (unsigned left = esc->sm_mapped; left != 0;) {
		struct esc_sm *sm = &esc->sm[esc_take_lowest(&left)];
		size_t end = (size_t)sm->start + sm->len;

		if (addr >= end) {
			continue;
		}
		if (addr >= sm->start) {
			*len = *len < end - addr ? *len : end - addr;
			return sm;
		}
		*len = *len < sm->start - addr ? *len : sm->start - addr;
	}
	return NULL;
}

/* The SM that has exactly this area, as process data are accessed, whose SMs are the last; NULL:
 * look at the pieces. */
static struct esc_sm *sm_of(struct esc *esc, uint16_t addr, size_t len)
{
	for (unsigned left = esc->sm_apart, n; left != 0; left &= ~(1u << n)) {
		struct esc_sm *sm;

		n = 31u - (unsigned)__builtin_clz(left);
		sm = &esc->sm[n];
		if (sm->start == addr) {
			return sm->len == len ? sm : NULL;
		}
	}
	return NULL;
}

__attribute__((cold)) static int read_pieces(struct esc *esc, enum esc_side side, uint16_t addr,
					     uint8_t *buf, size_t len)
{
	size_t end = ram_end(esc) < (size_t)addr + len ? ram_end(esc) : (size_t)addr + len;
	size_t piece;
	int any = 0;

	for (size_t at = addr; at < end; at += piece) {
		struct esc_sm *sm;

		piece = end - at;
		sm = sm_at(esc, at, &piece);
		if (sm != NULL) {
			any |= sm_read(esc, sm, side, at - sm->start, buf + (at - addr), piece);
		} else {
			memcpy(buf + (at - addr), esc->ram + (at - ESC_REG_PROCESS_RAM), piece);
			any = 1;
		}
	}
	return any;
}

int esc_ram_read(struct esc *esc, enum esc_side side, uint16_t addr, uint8_t *buf, size_t len)
{
	struct esc_sm *whole = sm_of(esc, addr, len);

	return whole != NULL ? sm_read(esc, whole, side, 0, buf, len)
			     : read_pieces(esc, side, addr, buf, len);
}

__attribute__((cold)) static int write_pieces(struct esc *esc, const struct writer *by,
					      uint16_t addr, const uint8_t *buf, size_t len)
{
	size_t end = ram_end(esc) < (size_t)addr + len ? ram_end(esc) : (size_t)addr + len;
	size_t piece;
	int any = 0;

	for (size_t at = addr; at < end; at += piece) {
		struct esc_sm *sm;

		piece = end - at;
		sm = sm_at(esc, at, &piece);
		if (sm != NULL) {
			any |= sm_write(esc, sm, by, at - sm->start, buf + (at - addr), piece);
		} else {
			memcpy(esc->ram + (at - ESC_REG_PROCESS_RAM), buf + (at - addr), piece);
			any = 1;
		}
	}
	return any;
}

int esc_ram_write(struct esc *esc, enum esc_side side, int64_t t_ns, uint16_t addr,
		  const uint8_t *buf, size_t len)
{
	const struct writer by = { .side = side, .t_ns = t_ns };
	struct esc_sm *whole = sm_of(esc, addr, len);

	return whole != NULL ? sm_write(esc, whole, &by, 0, buf, len)
			     : write_pieces(esc, &by, addr, buf, len);
}

const uint8_t *esc_ram_last_written(struct esc *esc, uint16_t addr)
{
	size_t piece = 1;
	const struct esc_sm *sm = sm_at(esc, addr, &piece);

	if (sm == NULL) {
		return esc->ram + (addr - ESC_REG_PROCESS_RAM);
	}
	return esc->ram + buffer_offset(sm, sm->newest) + (addr - sm->start);
}

void esc_sm_outputs_written(struct esc *esc, int64_t t_ns, uint16_t addr, size_t len)
{
	/* Digital outputs are not buffered; an SM over them is there for its watchdog. */
	for (unsigned i = 0; i < esc->features.sm_count; i++) {
		struct esc_sm *sm = &esc->sm[i];

		if (sm->is_active && sm->start >= ESC_REG_DIGITAL_OUTPUTS &&
		    sm->start + sm->len <= ESC_REG_DIGITAL_OUTPUTS + 4 &&
		    esc_touches(addr, len, sm->start + sm->len - 1u, 1)) {
			mark(sm, SM_STATUS_WRITTEN, 0);
			if (sm->control & SM_WATCHDOG_TRIGGER) {
				esc_watchdog_trigger(esc, t_ns);
			}
		}
	}
}
