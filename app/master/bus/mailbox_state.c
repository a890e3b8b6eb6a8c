/* SPDX-License-Identifier: MIT */
/*
 * The states of the mailboxes in the cyclic frames: the slaves whose SII names an FMMU for it map
 * one bit, "SM1 is full" of 0x080D, behind the process image, where an LRD datagram of its own
 * reads all of them. It is neither process data nor counted in their working counter. A slave with
 * such a bit is not polled while the bits are whole and new; all others are, and all are while one
 * of those slaves is missing.
 */
#include "bus/bus_internal.h"
#include "bus/exchange.h"
#include "bus/registers.h"

enum {
	FMMU_MAILBOX_STATE = 3, /* SII, category 40 */
	FMMU_READ = 1,
	SM_IN_STATUS = ESC_REG_SM + ESC_SM_BYTES + 5,
	STATUS_FULL_BIT = 3,
};

/* The FMMU that the SII names for it and that the process data does not take; -1: none. */
static int find_fmmu(const struct bus *bus, size_t pos, unsigned fmmu_count)
{
	const struct bus_slave *sl = &bus->slave[pos];
	const ec_slavet *soem = &bus->soem_slave[soem_index(pos)];
	size_t offset;
	size_t bytes;

	if (sii_find_category(sl->sii, sl->sii_len, SII_CATEGORY_FMMU, &offset, &bytes) < 0) {
		return -1;
	}
	for (size_t i = 0; i < bytes && i < EC_MAXFMMU && i < fmmu_count; i++) {
		if (sl->sii[offset + i] == FMMU_MAILBOX_STATE && !soem->FMMU[i].FMMUactive) {
			return (int)i;
		}
	}
	return -1;
}

static int is_candidate(const struct bus *bus, size_t pos)
{
	return bus->soem_slave[soem_index(pos)].mbx_l > 0 &&
	       (bus->slave[pos].esc_features & ESC_FEATURE_FMMU_BYTES) == 0;
}

static struct access fprd(const struct bus *bus, size_t pos, uint16_t reg, void *data, uint16_t len)
{
	return (struct access){ .cmd = ECAT_CMD_FPRD,
				.adp = bus->slave[pos].info.station_addr,
				.reg = reg,
				.len = len,
				.data = data };
}

static ec_fmmut fmmu_of_bit(uint32_t logical_start, unsigned bit)
{
	return (ec_fmmut){ .LogStart = htoel(logical_start + bit / 8),
			   .LogLength = htoes(1),
			   .LogStartbit = (uint8)(bit % 8),
			   .LogEndbit = (uint8)(bit % 8),
			   .PhysStart = htoes(SM_IN_STATUS),
			   .PhysStartBit = STATUS_FULL_BIT,
			   .FMMUtype = FMMU_READ,
			   .FMMUactive = 1 };
}

int bus_mailbox_state_map(struct bus *bus, uint32_t logical_start, unsigned *ret_count)
{
	static struct access access[LIMIT_SLAVES];
	static uint8_t count[LIMIT_SLAVES];
	unsigned bits = 0;
	size_t n = 0;
	int r;

	for (size_t i = 0; i < bus->slave_count; i++) {
		access[i] = fprd(bus, i, ESC_REG_FMMU_COUNT, &count[i], 1);
		bus->slave[i].mailbox_bit = -1;
	}
	r = registers_run(bus, access, bus->slave_count);
	for (size_t i = 0; i < bus->slave_count && r >= 0; i++) {
		ec_slavet *soem = &bus->soem_slave[soem_index(i)];
		int fmmu = access[i].wkc == 1 && is_candidate(bus, i) ? find_fmmu(bus, i, count[i])
								      : -1;

		if (fmmu < 0) {
			continue;
		}
		soem->FMMU[fmmu] = fmmu_of_bit(logical_start, bits);
		bus->slave[i].mailbox_bit = (int)bits++;
		access[n] = fprd(bus, i, (uint16_t)(ESC_REG_FMMU + fmmu * ESC_FMMU_BYTES),
				 &soem->FMMU[fmmu], ESC_FMMU_BYTES);
		access[n++].cmd = ECAT_CMD_FPWR;
	}
	*ret_count = bits;
	return r < 0 || n == 0 ? r : registers_run(bus, access, n);
}

void bus_mailbox_state_follow(struct bus *bus, const struct exchange *ex)
{
	struct exchange_mailboxes state;

	if (ex == NULL || exchange_mailboxes(ex, &state) == 0) {
		return;
	}
	for (size_t i = 0; i < bus->slave_count; i++) {
		int bit = bus->slave[i].mailbox_bit;

		if (bit >= 0) {
			mailbox_status_hint(bus->mailbox, (uint16_t)i,
					    (int)(state.word[bit / 64] >> (bit % 64) & 1),
					    state.sent);
		}
	}
}
