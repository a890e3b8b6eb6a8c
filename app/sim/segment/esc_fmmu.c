/* SPDX-License-Identifier: MIT */
/* FMMUs: logical addresses to process RAM and registers, by bytes where possible, else bit by bit.
 */
#include "segment/esc_internal.h"

#include <string.h>

enum { LOGICAL_BYTES_MAX = ECAT_DATAGRAM_MAX_BYTES };

/* Registers can be mapped, too (mailbox status); so a read may do what reading a register does. */
static int read_physical(struct esc *esc, int64_t t_ns, uint16_t addr, uint8_t *buf, size_t len)
{
	const uint8_t *reg;

	if (addr >= ESC_REG_PROCESS_RAM) {
		return esc_ram_read(esc, ESC_ECAT, addr, buf, len);
	}
	reg = esc_register_read(esc, ESC_ECAT, t_ns, addr, buf, len);
	if (reg != NULL && reg != buf) {
		memcpy(buf, reg, len);
	}
	return reg != NULL;
}

/* Of the registers an FMMU reaches the outputs only (our reading of the data sheet). */
static int write_physical(struct esc *esc, const struct esc_frame *frame, uint16_t addr,
			  const uint8_t *buf, size_t len)
{
	if (addr >= ESC_REG_PROCESS_RAM) {
		return esc_ram_write(esc, ESC_ECAT, frame->pu_ns, addr, buf, len);
	}
	return addr >= ESC_REG_DIGITAL_OUTPUTS && esc_register_write(esc, frame, addr, buf, len);
}

/* The part of an FMMU that is in a datagram, in bits; the slave's are counted from 8 *
 * physical_start. */
struct overlap {
	size_t datagram_bit;
	size_t physical_bit;
	size_t bits;
};

static int overlaps(const struct esc_fmmu *f, uint32_t start, size_t len, struct overlap *ret)
{
	int64_t first = f->first_bit - (int64_t)start * 8;
	int64_t end = first + f->bits;
	int64_t from = first > 0 ? first : 0;
	int64_t to = end < (int64_t)len * 8 ? end : (int64_t)len * 8;

	*ret = (struct overlap){ .datagram_bit = (size_t)from,
				 .physical_bit = (size_t)(from - first) + f->physical_start_bit,
				 .bits = (size_t)(to - from) };
	return from < to;
}

static uint16_t physical_address(const struct esc_fmmu *f, const struct overlap *o)
{
	return (uint16_t)(f->physical_start + o->physical_bit / 8);
}

static size_t physical_bytes(const struct overlap *o)
{
	return (o->physical_bit % 8 + o->bits + 7) / 8;
}

static void copy_bits(uint8_t *to, size_t to_bit, const uint8_t *from, size_t from_bit, size_t bits)
{
	for (; bits > 0; bits--, to_bit++, from_bit++) {
		uint8_t mask = (uint8_t)(1u << (to_bit % 8));
		int value = from[from_bit / 8] >> (from_bit % 8) & 1;

		to[to_bit / 8] = (uint8_t)(value ? to[to_bit / 8] | mask : to[to_bit / 8] & ~mask);
	}
}

static int read_mapped(struct esc *esc, int64_t t_ns, const struct esc_fmmu *f,
		       const struct overlap *o, uint8_t *data)
{
	uint8_t physical[LOGICAL_BYTES_MAX + 2];

	if (f->is_bytewise) {
		return read_physical(esc, t_ns, physical_address(f, o), data + o->datagram_bit / 8,
				     o->bits / 8);
	}
	memset(physical, 0, physical_bytes(o));
	if (!read_physical(esc, t_ns, physical_address(f, o), physical, physical_bytes(o))) {
		return 0;
	}
	copy_bits(data, o->datagram_bit, physical, o->physical_bit % 8, o->bits);
	return 1;
}

/* Bits that are not mapped keep what was written last (our model). */
static void fetch_last(struct esc *esc, uint16_t addr, uint8_t *buf, size_t len)
{
	for (size_t i = 0; i < len; i++) {
		size_t at = (size_t)addr + i;

		if (at < ESC_REG_PROCESS_RAM) {
			buf[i] = esc->reg[at];
		} else if (at < ESC_REG_PROCESS_RAM + ESC_RAM_BYTES) {
			buf[i] = *esc_ram_last_written(esc, (uint16_t)at);
		} else {
			buf[i] = 0;
		}
	}
}

static int write_mapped(struct esc *esc, const struct esc_frame *frame, const struct esc_fmmu *f,
			const struct overlap *o, const uint8_t *data)
{
	uint8_t physical[LOGICAL_BYTES_MAX + 2];
	uint16_t addr = physical_address(f, o);

	if (f->is_bytewise) {
		return write_physical(esc, frame, addr, data + o->datagram_bit / 8, o->bits / 8);
	}
	fetch_last(esc, addr, physical, physical_bytes(o));
	copy_bits(physical, o->physical_bit % 8, data, o->datagram_bit, o->bits);
	return write_physical(esc, frame, addr, physical, physical_bytes(o));
}

void esc_fmmu_access(struct esc *esc, const struct esc_frame *frame, struct ecat_datagram *dg)
{
	uint32_t start = ecat_logical_address(dg);
	uint8_t copy[LOGICAL_BYTES_MAX];
	const uint8_t *came = dg->data;
	int is_read = dg->cmd == ECAT_CMD_LRD || dg->cmd == ECAT_CMD_LRW;
	int is_write = dg->cmd == ECAT_CMD_LWR || dg->cmd == ECAT_CMD_LRW;
	int did_read = 0;
	int did_write = 0;

	/* What is written is what came in, not what an FMMU before has put there. */
	if (dg->cmd == ECAT_CMD_LRW && (esc->features.features & ESC_FEATURE_NO_LRW) != 0) {
		return;
	}
	for (unsigned left = esc->fmmu_active; left != 0;) {
		const struct esc_fmmu *f = &esc->fmmu[esc_take_lowest(&left)];
		struct overlap o;

		if (!overlaps(f, start, dg->data_len, &o)) {
			continue;
		}
		if (is_write && (f->type & FMMU_WRITE)) {
			did_write |= write_mapped(esc, frame, f, &o, came);
		}
		if (is_read && (f->type & FMMU_READ)) {
			if (is_write && came == dg->data && (left & esc->fmmu_writing) != 0) {
				memcpy(copy, dg->data, dg->data_len);
				came = copy;
			}
			did_read |= read_mapped(esc, frame->pu_ns, f, &o, dg->data);
		}
	}
	put_le16(dg->wkc, (uint16_t)(get_le16(dg->wkc) + did_read +
				     (dg->cmd == ECAT_CMD_LRW ? 2 : 1) * did_write));
}
