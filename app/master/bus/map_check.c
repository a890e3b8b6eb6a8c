/* SPDX-License-Identifier: MIT */
/*
 * Who takes the working counter of the process data while every AL status says OP (T27): a slave
 * whose SyncManager or FMMU is not as bus_map() programmed it. One frame or two a call; the slaves
 * have their turn one group after the other, and a slave that was found stays the first.
 */
#include <stdio.h>
#include <string.h>

#include "bus/bus_internal.h"
#include "bus/registers.h"

enum {
	CHECKED_PER_CALL = 12,
	REGIONS = EC_MAXSM + EC_MAXFMMU,
	SM_TYPE_OUTPUTS = 3, /* in SOEM's table, and everything from here on */
	SM_CONTROL = 4,
	SM_ACTIVATE = 6,
	SM_PDI_CONTROL = 7,
	FMMU_ACTIVATE = 12,
	IS_ON = 0x01,
};

/* One SyncManager or FMMU: what it is to be and what the slave has. */
struct region {
	size_t pos;
	const char *kind;
	unsigned number;
	uint16_t reg;
	uint16_t len;
	const uint8_t *expected;
	uint8_t found[ESC_FMMU_BYTES];
};

static size_t add_regions(struct bus *bus, size_t pos, struct region *ret)
{
	const ec_slavet *soem = &bus->soem_slave[soem_index(pos)];
	size_t n = 0;

	for (unsigned i = 0; i < EC_MAXSM; i++) {
		if (soem->SMtype[i] >= SM_TYPE_OUTPUTS && soem->SM[i].StartAddr != 0) {
			ret[n++] = (struct region){
				.pos = pos,
				.kind = "SM",
				.number = i,
				.reg = (uint16_t)(ESC_REG_SM + i * ESC_SM_BYTES),
				.len = ESC_SM_BYTES,
				.expected = (const uint8_t *)&soem->SM[i],
			};
		}
	}
	for (unsigned i = 0; i < EC_MAXFMMU; i++) {
		if (soem->FMMU[i].FMMUactive) {
			ret[n++] = (struct region){
				.pos = pos,
				.kind = "FMMU",
				.number = i,
				.reg = (uint16_t)(ESC_REG_FMMU + i * ESC_FMMU_BYTES),
				.len = ESC_FMMU_BYTES,
				.expected = (const uint8_t *)&soem->FMMU[i],
			};
		}
	}
	return n;
}

/* What is wrong with @g in @ret_text; 0: nothing. */
static int judge(const struct region *g, char *ret_text, size_t text_bytes)
{
	int is_sm = g->len == ESC_SM_BYTES;
	unsigned at = is_sm ? SM_ACTIVATE : FMMU_ACTIVATE;
	size_t compared = is_sm ? SM_CONTROL + 1 : FMMU_ACTIVATE;

	if (g->found[at] % 2 != g->expected[at] % 2) {
		snprintf(ret_text, text_bytes, "its %s%u is switched %s (register 0x%04x)", g->kind,
			 g->number, g->found[at] & IS_ON ? "on" : "off", g->reg + at);
	} else if (is_sm && (g->found[SM_PDI_CONTROL] & IS_ON)) {
		snprintf(ret_text, text_bytes,
			 "its application has switched off SM%u (register 0x%04x)", g->number,
			 (unsigned)(g->reg + SM_PDI_CONTROL));
	} else if (memcmp(g->found, g->expected, compared) != 0) {
		snprintf(ret_text, text_bytes, "its %s%u is not as programmed (register 0x%04x)",
			 g->kind, g->number, g->reg);
	} else {
		return 0;
	}
	return 1;
}

int bus_map_check(struct bus *bus, char *ret_text, size_t text_bytes)
{
	struct region region[CHECKED_PER_CALL * REGIONS];
	struct access access[CHECKED_PER_CALL * REGIONS];
	size_t slaves = bus->slave_count < CHECKED_PER_CALL ? bus->slave_count : CHECKED_PER_CALL;
	size_t n = 0;
	char what[96];
	int r;

	ret_text[0] = '\0';
	for (size_t i = 0; i < slaves; i++) {
		n += add_regions(bus, (bus->next_checked + i) % bus->slave_count, region + n);
	}
	for (size_t i = 0; i < n; i++) {
		access[i] = (struct access){ .cmd = ECAT_CMD_FPRD,
					     .adp = bus->slave[region[i].pos].info.station_addr,
					     .reg = region[i].reg,
					     .len = region[i].len,
					     .data = region[i].found };
	}
	bus->error = NULL;
	bus->is_looking = 1;
	r = registers_run(bus, access, n);
	bus->is_looking = 0;
	if (r < 0) {
		return 0;
	}
	for (size_t i = 0; i < n; i++) {
		if (access[i].wkc == 1 && judge(&region[i], what, sizeof(what))) {
			bus->next_checked = region[i].pos;
			snprintf(ret_text, text_bytes, "slave %zu (%s): %s", region[i].pos,
				 bus->slave[region[i].pos].info.name, what);
			return 1;
		}
	}
	bus->next_checked =
		bus->slave_count > 0 ? (bus->next_checked + slaves) % bus->slave_count : 0;
	return 0;
}
