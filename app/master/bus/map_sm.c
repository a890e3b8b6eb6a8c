/* SPDX-License-Identifier: MIT */
/*
 * SyncManagers from mapped bits: how long each is, whether it fits where the SII puts it. If
 * the two descriptions of a fixed mapping differ, the one by CoE is used and the other reported.
 */
#include <errno.h>

#include "bus/bus_internal.h"
#include "wire/esc_reg.h"

enum {
	SM_TYPE_OUTPUTS = 3,
	SM_TYPE_INPUTS = 4,
	SM_MODE_MASK = 0x03,
	SM_MODE_BUFFERED = 0x00,
	SM_BUFFERS = 3,
	SM_FIRST_BEHIND_MAILBOX = 2,
};

/* Bits of one slave by SyncManager. */
struct sm_bits {
	uint32_t bits[EC_MAXSM];
	uint8_t is_output[EC_MAXSM];
	uint8_t is_used[EC_MAXSM];
};

static uint32_t bytes_of(uint32_t bits)
{
	return (bits + 7) / 8;
}

static int sum_bits(struct bus *bus, size_t pos, struct sm_bits *ret)
{
	const struct bus_slave *sl = &bus->slave[pos];

	*ret = (struct sm_bits){ 0 };
	for (size_t i = 0; i < sl->pdo_count; i++) {
		const struct pdo_entry *e = &bus->pdo[sl->pdo_first + i];

		if (ret->is_used[e->sm] && ret->is_output[e->sm] != e->is_output) {
			return bus_fail_slave(bus, pos, -EPROTO, "SM%u has inputs and outputs",
					      e->sm);
		}
		ret->is_used[e->sm] = 1;
		ret->is_output[e->sm] = e->is_output;
		ret->bits[e->sm] += e->bit_len;
	}
	return 0;
}

static uint32_t sm_room(const ec_smt *sm, uint32_t bytes)
{
	return (etohl(sm->SMflags) & SM_MODE_MASK) == SM_MODE_BUFFERED ? bytes * SM_BUFFERS : bytes;
}

/* Buffers must not run into the next one; digital outputs live below the process RAM and have one
 * buffer. */
static int check_room(struct bus *bus, size_t pos, unsigned n, uint32_t bytes)
{
	const ec_slavet *soem = &bus->soem_slave[soem_index(pos)];
	uint32_t start = etohs(soem->SM[n].StartAddr);
	uint32_t room = start >= ESC_REG_PROCESS_RAM ? sm_room(&soem->SM[n], bytes) : bytes;

	for (unsigned k = 0; k < EC_MAXSM; k++) {
		uint32_t other = etohs(soem->SM[k].StartAddr);

		if (k != n && other > start && other < start + room) {
			return bus_fail_slave(
				bus, pos, -EPROTO,
				"%u bytes are mapped to SM%u at 0x%04x, which needs %u, but "
				"SM%u begins at 0x%04x",
				bytes, n, start, room, k, other);
		}
	}
	return 0;
}

/* A slave with a fixed mapping gives its length twice: in its SII and in its object dictionary. The
 * dictionary is what its firmware exchanges; the SII is often wrong. */
static void compare_with_sii(struct bus *bus, size_t pos, unsigned n, uint32_t bytes)
{
	const ec_slavet *soem = &bus->soem_slave[soem_index(pos)];
	uint32_t sii_bytes = etohs(soem->SM[n].SMlength);
	int is_variable = (soem->CoEdetails & (ECT_COEDET_PDOASSIGN | ECT_COEDET_PDOCONFIG)) != 0;

	if (!bus->slave[pos].is_mapped_by_coe || is_variable || sii_bytes == 0 ||
	    sii_bytes == bytes) {
		return;
	}
	bus_emit_event(bus, &bus->listener,
		       (struct event){ .id = EVENT_SM_LENGTH,
				       .slave_pos = (uint16_t)pos,
				       .arg = { (int32_t)n, (int32_t)bytes },
				       .value = sii_bytes });
}

static int set_sm(struct bus *bus, size_t pos, unsigned n, const struct sm_bits *sb)
{
	ec_slavet *soem = &bus->soem_slave[soem_index(pos)];
	uint32_t bytes = bytes_of(sb->bits[n]);
	int r;

	if (bytes > 0) {
		if (soem->SM[n].StartAddr == 0) {
			return bus_fail_slave(
				bus, pos, -EPROTO,
				"%u bytes are mapped to SM%u, which its SII does not have", bytes,
				n);
		}
		compare_with_sii(bus, pos, n, bytes);
		r = check_room(bus, pos, n, bytes);
		if (r < 0) {
			return r;
		}
		soem->SM[n].SMflags = htoel(etohl(soem->SM[n].SMflags) | ~EC_SMENABLEMASK);
	} else {
		soem->SM[n].SMflags = htoel(etohl(soem->SM[n].SMflags) & EC_SMENABLEMASK);
	}
	soem->SM[n].SMlength = htoes((uint16)bytes);
	soem->SMtype[n] = bytes == 0 ? 0 : sb->is_output[n] ? SM_TYPE_OUTPUTS : SM_TYPE_INPUTS;
	return 0;
}

/* Bits of a direction as SOEM is to map them: several SMs begin at a byte each. */
static uint32_t direction_bits(const struct sm_bits *sb, int is_output)
{
	uint32_t bytes = 0;
	uint32_t bits = 0;
	unsigned used = 0;

	for (unsigned n = 0; n < EC_MAXSM; n++) {
		if (sb->is_used[n] && sb->is_output[n] == is_output && sb->bits[n] > 0) {
			bits += sb->bits[n];
			bytes += bytes_of(sb->bits[n]);
			used++;
		}
	}
	return used > 1 ? bytes * 8 : bits;
}

int bus_map_sm(struct bus *bus, size_t pos, uint32_t *total_bytes)
{
	ec_slavet *soem = &bus->soem_slave[soem_index(pos)];
	uint32_t out;
	uint32_t in;
	struct sm_bits sb;
	int r = sum_bits(bus, pos, &sb);

	for (unsigned n = soem->mbx_l > 0 ? SM_FIRST_BEHIND_MAILBOX : 0; n < EC_MAXSM && r >= 0;
	     n++) {
		r = set_sm(bus, pos, n, &sb);
	}
	if (r < 0) {
		return r;
	}
	out = direction_bits(&sb, 1);
	in = direction_bits(&sb, 0);
	*total_bytes += bytes_of(out) + bytes_of(in);
	if (*total_bytes > LIMIT_IMAGE_BYTES) {
		return bus_fail_slave(bus, pos, -E2BIG,
				      "the process image exceeds LIMIT_IMAGE_BYTES (%d)",
				      LIMIT_IMAGE_BYTES);
	}
	soem->Obits = (uint16)out;
	soem->Ibits = (uint16)in;
	return 0;
}
