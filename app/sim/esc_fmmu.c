/* SPDX-License-Identifier: MIT */
/* FMMUs: logical addresses to process RAM and registers, by bytes where possible, else bit by bit. */
#include "sim/esc_inside.h"

#include <string.h>

enum { FMMU_READ = 1, FMMU_WRITE = 2, LOGICAL_BYTES_MAX = ECAT_DATAGRAM_MAX_BYTES };

void esc_fmmu_configure(struct esc *esc, unsigned n)
{
	const uint8_t *r = &esc->reg[ESC_REG_FMMU + n * ESC_FMMU_BYTES];
	struct esc_fmmu *f = &esc->fmmu[n];

	f->logical_start = get_le32(r);
	f->len = get_le16(r + 4);
	f->logical_start_bit = r[6] & 7;
	f->logical_end_bit = r[7] & 7;
	f->physical_start = get_le16(r + 8);
	f->physical_start_bit = r[10] & 7;
	f->type = r[11] & 3;
	f->is_active = (r[12] & 1) && f->len > 0;
	f->is_bytewise = f->logical_start_bit == 0 && f->logical_end_bit == 7 &&
			 f->physical_start_bit == 0;
}

/* Registers can be mapped, too (mailbox status by FMMU). */
static int read_physical(struct esc *esc, uint16_t addr, uint8_t *buf, size_t len)
{
	if (addr >= ESC_REG_PROCESS_RAM) {
		return esc_ram_read(esc, ESC_ECAT, addr, buf, len);
	}
	if ((size_t)addr + len > ESC_REGISTER_BYTES) {
		return 0;
	}
	memcpy(buf, esc->reg + addr, len);
	return 1;
}

static int write_physical(struct esc *esc, int64_t t_ns, uint16_t addr, const uint8_t *buf,
			  size_t len)
{
	return addr >= ESC_REG_PROCESS_RAM && esc_ram_write(esc, ESC_ECAT, t_ns, addr, buf, len);
}

/* What of an FMMU and a datagram is the same: in bytes of the logical space. */
struct overlap {
	size_t in_datagram;
	size_t in_fmmu;
	size_t len;
};

static int overlaps(const struct esc_fmmu *f, uint32_t start, size_t len, struct overlap *ret)
{
	uint64_t from = f->logical_start > start ? f->logical_start : start;
	uint64_t f_end = (uint64_t)f->logical_start + f->len;
	uint64_t d_end = (uint64_t)start + len;
	uint64_t to = f_end < d_end ? f_end : d_end;

	if (from >= to) {
		return 0;
	}
	*ret = (struct overlap){ .in_datagram = (size_t)(from - start),
				 .in_fmmu = (size_t)(from - f->logical_start),
				 .len = (size_t)(to - from) };
	return 1;
}

/* The mapped bits of byte @i of the FMMU's logical range. */
static uint8_t bit_mask(const struct esc_fmmu *f, size_t i)
{
	uint8_t mask = 0xff;

	if (i == 0) {
		mask = (uint8_t)(mask << f->logical_start_bit);
	}
	if (i + 1 == f->len) {
		mask &= (uint8_t)(0xff >> (7 - f->logical_end_bit));
	}
	return mask;
}

/* First mapped bit of the FMMU that lies in logical byte @i, and where it is in the slave. */
static size_t physical_bit(const struct esc_fmmu *f, size_t i, unsigned bit)
{
	return i * 8 + bit - f->logical_start_bit + f->physical_start_bit;
}

static size_t physical_bytes(const struct esc_fmmu *f)
{
	size_t bits = ((size_t)f->len - 1) * 8 + f->logical_end_bit + 1u - f->logical_start_bit;

	return (bits + f->physical_start_bit + 7) / 8;
}

static int read_bits(struct esc *esc, const struct esc_fmmu *f, const struct overlap *o, uint8_t *data)
{
	uint8_t physical[LOGICAL_BYTES_MAX + 2];
	size_t bytes = physical_bytes(f);

	if (bytes > sizeof(physical) || !read_physical(esc, f->physical_start, physical, bytes)) {
		return 0;
	}
	for (size_t i = 0; i < o->len; i++) {
		uint8_t mask = bit_mask(f, o->in_fmmu + i);

		for (unsigned bit = 0; bit < 8; bit++) {
			size_t p = physical_bit(f, o->in_fmmu + i, bit);

			if (!(mask >> bit & 1)) {
				continue;
			}
			data[i] = (uint8_t)((data[i] & ~(1u << bit)) |
					    (unsigned)(physical[p / 8] >> (p % 8) & 1) << bit);
		}
	}
	return 1;
}

static int write_bits(struct esc *esc, int64_t t_ns, const struct esc_fmmu *f,
		      const struct overlap *o, const uint8_t *data)
{
	uint8_t physical[LOGICAL_BYTES_MAX + 2];
	size_t bytes = physical_bytes(f);
	struct esc_sm *sm = esc_sm_at(esc, f->physical_start);

	if (bytes > sizeof(physical) ||
	    (size_t)f->physical_start + bytes > ESC_REG_PROCESS_RAM + sizeof(esc->ram)) {
		return 0;
	}
	/* Bits that are not mapped keep what was written last. */
	if (f->physical_start < ESC_REG_PROCESS_RAM) {
		return 0;
	}
	if (sm != NULL && !sm->is_mailbox) {
		size_t at = (size_t)(f->physical_start - sm->start);

		memcpy(physical,
		       esc->ram + sm->start - ESC_REG_PROCESS_RAM + (size_t)sm->newest * sm->len + at,
		       bytes);
	} else {
		memcpy(physical, esc->ram + f->physical_start - ESC_REG_PROCESS_RAM, bytes);
	}
	for (size_t i = 0; i < o->len; i++) {
		uint8_t mask = bit_mask(f, o->in_fmmu + i);

		for (unsigned bit = 0; bit < 8; bit++) {
			size_t p = physical_bit(f, o->in_fmmu + i, bit);

			if (!(mask >> bit & 1)) {
				continue;
			}
			physical[p / 8] = (uint8_t)((physical[p / 8] & ~(1u << (p % 8))) |
						    (unsigned)(data[i] >> bit & 1) << (p % 8));
		}
	}
	return write_physical(esc, t_ns, f->physical_start, physical, bytes);
}

void esc_fmmu_access(struct esc *esc, int64_t t_ns, struct ecat_datagram *dg)
{
	uint32_t start = ecat_logical_address(dg);
	uint8_t before[LOGICAL_BYTES_MAX];
	int is_read = dg->cmd == ECAT_CMD_LRD || dg->cmd == ECAT_CMD_LRW;
	int is_write = dg->cmd == ECAT_CMD_LWR || dg->cmd == ECAT_CMD_LRW;
	int did_read = 0;
	int did_write = 0;

	if (dg->data_len > sizeof(before)) {
		return;
	}
	/* What is written is what came in, not what an FMMU before has put there. */
	memcpy(before, dg->data, dg->data_len);
	for (unsigned n = 0; n < esc->features.fmmu_count; n++) {
		const struct esc_fmmu *f = &esc->fmmu[n];
		struct overlap o;
		uint16_t physical;

		if (!f->is_active || !overlaps(f, start, dg->data_len, &o)) {
			continue;
		}
		physical = (uint16_t)(f->physical_start + o.in_fmmu);
		if (is_write && (f->type & FMMU_WRITE)) {
			did_write |= f->is_bytewise
					     ? write_physical(esc, t_ns, physical,
							      before + o.in_datagram, o.len)
					     : write_bits(esc, t_ns, f, &o, before + o.in_datagram);
		}
		if (is_read && (f->type & FMMU_READ)) {
			did_read |= f->is_bytewise
					    ? read_physical(esc, physical, dg->data + o.in_datagram,
							    o.len)
					    : read_bits(esc, f, &o, dg->data + o.in_datagram);
		}
	}
	put_le16(dg->wkc, (uint16_t)(get_le16(dg->wkc) + did_read +
				     (dg->cmd == ECAT_CMD_LRW ? 2 : 1) * did_write));
}
