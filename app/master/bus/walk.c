/* SPDX-License-Identifier: MIT */
#include "bus/walk.h"

#include <errno.h>

#include "base/bytes.h"

enum {
	DL_LINK = 4, /* DL status: bit of port 0 */
	DL_COMMUNICATION = 9,
};

int walk_positions(struct bus *bus, struct walk *walk)
{
	struct access access[2 * WALK_POSITIONS + 1];
	uint8_t beyond[2];
	size_t n = 0;
	int r;

	for (size_t i = 0; i < walk->count; i++) {
		walk->at[i] = (struct position){ .slave = -1 };
		access[n++] = walk_access(ECAT_CMD_APRD, i, ESC_REG_STATION_ADDRESS,
					  walk->at[i].address, 2);
		access[n++] =
			walk_access(ECAT_CMD_APRD, i, ESC_REG_DL_STATUS, walk->at[i].dl_status, 2);
	}
	access[n] = walk_access(ECAT_CMD_APRD, walk->count, ESC_REG_STATION_ADDRESS, beyond, 2);
	r = registers_run(bus, access, n + 1);
	if (r < 0) {
		return r;
	}
	for (size_t i = 0; i < n; i++) {
		if (access[i].wkc != 1) {
			return -EAGAIN;
		}
	}
	return access[n].wkc == 0 ? 0 : -EAGAIN;
}

unsigned walk_claims(const struct walk *walk, uint16_t address)
{
	unsigned claims = 0;

	for (size_t i = 0; i < walk->count; i++) {
		claims += get_le16(walk->at[i].address) == address;
	}
	return claims;
}

/* Bit @bit + @step * port of DL status, for each port. */
static uint8_t ports_of(const struct position *at, unsigned bit, unsigned step)
{
	uint16_t status = get_le16(at->dl_status);
	uint8_t ports = 0;

	for (unsigned port = 0; port < ESC_PORTS; port++) {
		ports |= (uint8_t)((status >> (bit + step * port) & 1) << port);
	}
	return ports;
}

uint8_t walk_linked_ports(const struct position *at)
{
	return ports_of(at, DL_LINK, 1);
}

uint8_t walk_open_ports(const struct position *at)
{
	return ports_of(at, DL_COMMUNICATION, 2);
}
