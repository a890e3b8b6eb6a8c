/* SPDX-License-Identifier: MIT */
/*
 * Counts the slaves, brings them to INIT with their defaults, and gives them station addresses.
 * What SOEM's ecx_config_init() did before its SII part, in fewer frames: each step goes to all
 * slaves at the same time.
 */
#include <errno.h>
#include <string.h>

#include "base/bytes.h"
#include "bus/bus_internal.h"
#include "bus/registers.h"

enum {
	STATION_FIRST = 0x1001,
	DL_ECAT_FRAMES_ONLY = 0x0001,
	LOOP_CLOSED_SHIFT = 8, /* of DL status; 2 bits a port: closed, communicating */
	PORT_OPEN = 2,
	PORT_MASK = 3,
	EEPROM_FORCE = 2,
	SPEED_COUNTER_START = 0x1000,
	FILTERS = 0x0c00, /* 0x0934, 0x0935 */
	IRQ_MASK = 0x0004,
};

#define INIT_NS (2 * NS_PER_S)

static uint16_t auto_increment(size_t pos)
{
	return (uint16_t)-(int)pos;
}

/* --- counting --- */

/* By BRD of the type register: its WKC, or -errno. */
static int count_slaves(struct bus *bus)
{
	uint8_t type[2];
	struct access access = {
		.cmd = ECAT_CMD_BRD, .reg = ESC_REG_TYPE, .len = sizeof(type), .data = type
	};
	int r = registers_run(bus, &access, 1);

	return r < 0 ? r : access.wkc;
}

/* --- defaults --- */

static struct access broadcast(uint16_t reg, uint8_t *data, uint16_t len)
{
	return (struct access){ .cmd = ECAT_CMD_BWR, .reg = reg, .len = len, .data = data };
}

/* The station alias does not address; netX slaves need the request for INIT twice. */
static int reset_states(struct bus *bus)
{
	uint8_t off[1] = { 0 };
	uint8_t init[2] = { AL_INIT | AL_ERROR, 0 };
	struct access access[] = {
		broadcast(ESC_REG_DL_CONTROL + 3, off, sizeof(off)),
		broadcast(ESC_REG_AL_CONTROL, init, sizeof(init)),
		broadcast(ESC_REG_AL_CONTROL, init, sizeof(init)),
	};

	return registers_run(bus, access, sizeof(access) / sizeof(access[0]));
}

static int set_defaults(struct bus *bus)
{
	uint8_t zeros[48] = { 0 };
	uint8_t irq[2];
	uint8_t speed[2];
	uint8_t filters[2];
	uint8_t init[2] = { AL_INIT | AL_ERROR, 0 };
	uint8_t force[1] = { EEPROM_FORCE };
	struct access access[] = {
		broadcast(ESC_REG_DL_CONTROL + 1, zeros, 1),
		broadcast(ESC_REG_ECAT_EVENT_MASK, irq, sizeof(irq)),
		broadcast(ESC_REG_RX_ERROR_COUNTER, zeros, 8),
		broadcast(ESC_REG_FMMU, zeros, 3 * ESC_FMMU_BYTES),
		broadcast(ESC_REG_SM, zeros, 4 * ESC_SM_BYTES),
		broadcast(ESC_REG_DC_ACTIVATION, zeros, 1),
		broadcast(ESC_REG_DC_SYSTEM_TIME, zeros, 4),
		broadcast(ESC_REG_DC_SPEED_COUNTER_START, speed, sizeof(speed)),
		broadcast(ESC_REG_DC_TIME_FILTER, filters, sizeof(filters)),
		broadcast(ESC_REG_DL_CONTROL + 3, zeros, 1),
		broadcast(ESC_REG_AL_CONTROL, init, sizeof(init)),
		broadcast(ESC_REG_EEPROM_CONFIG, force, sizeof(force)),
		broadcast(ESC_REG_EEPROM_CONFIG, zeros, 1),
	};

	put_le16(irq, IRQ_MASK);
	put_le16(speed, SPEED_COUNTER_START);
	put_le16(filters, FILTERS);
	return registers_run(bus, access, sizeof(access) / sizeof(access[0]));
}

/* --- addresses --- */

/* The first slave drops frames that are not EtherCAT. */
static int give_addresses(struct bus *bus, struct access *access, uint8_t (*buf)[2])
{
	static uint8_t first[2] = { DL_ECAT_FRAMES_ONLY, 0 };
	static uint8_t others[2] = { 0, 0 };
	size_t count = 0;

	for (size_t i = 0; i < bus->slave_count; i++) {
		put_le16(buf[i], (uint16_t)(STATION_FIRST + i));
		access[count++] = (struct access){ .cmd = ECAT_CMD_APWR,
						   .adp = auto_increment(i),
						   .reg = ESC_REG_STATION_ADDRESS,
						   .len = 2,
						   .data = buf[i] };
		access[count++] = (struct access){ .cmd = ECAT_CMD_APWR,
						   .adp = auto_increment(i),
						   .reg = ESC_REG_DL_CONTROL,
						   .len = 2,
						   .data = i == 0 ? first : others };
	}
	return registers_run(bus, access, count);
}

static int check_addresses(struct bus *bus, struct access *access, uint8_t (*buf)[2])
{
	int r;

	for (size_t i = 0; i < bus->slave_count; i++) {
		access[i] = (struct access){ .cmd = ECAT_CMD_APRD,
					     .adp = auto_increment(i),
					     .reg = ESC_REG_STATION_ADDRESS,
					     .len = 2,
					     .data = buf[i] };
	}
	r = registers_run(bus, access, bus->slave_count);
	for (size_t i = 0; i < bus->slave_count && r >= 0; i++) {
		if (access[i].wkc != 1 || get_le16(buf[i]) != STATION_FIRST + i) {
			return bus_fail_slave(bus, i, -EIO,
					      "it does not take its station address 0x%04zx",
					      STATION_FIRST + i);
		}
	}
	return r;
}

/* --- what the chips say --- */

static uint8_t open_ports(uint16_t dl_status)
{
	uint8_t ports = 0;

	for (unsigned i = 0; i < ESC_PORTS; i++) {
		if ((dl_status >> (LOOP_CLOSED_SHIFT + 2 * i) & PORT_MASK) == PORT_OPEN) {
			ports |= (uint8_t)(1u << i);
		}
	}
	return ports;
}

static int read_chips(struct bus *bus)
{
	for (size_t i = 0; i < bus->slave_count; i++) {
		ec_slavet *soem = &bus->soem_slave[soem_index(i)];
		struct bus_slave *sl = &bus->slave[i];
		uint8_t dl_status[2] = { 0 };
		uint16_t station = (uint16_t)(STATION_FIRST + i);
		struct access access[] = {
			{ .cmd = ECAT_CMD_FPRD,
			  .adp = station,
			  .reg = ESC_REG_DL_STATUS,
			  .len = 2,
			  .data = dl_status },
		};
		int r = registers_run(bus, access, 1);

		if (r < 0) {
			return r;
		}
		sl->clock.ports = open_ports(get_le16(dl_status));
		soem->activeports = sl->clock.ports;
	}
	return 0;
}

/* A slave that is not in INIT in time is reported by the change to PRE-OP. */
static int wait_for_init(struct bus *bus, struct access *access, uint8_t (*buf)[2])
{
	mono_t give_up = mono_add(bus_now(bus), (span_t){ INIT_NS });

	for (;;) {
		size_t left = 0;
		int r;

		for (size_t i = 0; i < bus->slave_count; i++) {
			access[i] = (struct access){ .cmd = ECAT_CMD_FPRD,
						     .adp = (uint16_t)(STATION_FIRST + i),
						     .reg = ESC_REG_AL_STATUS,
						     .len = 2,
						     .data = buf[i] };
		}
		r = registers_run(bus, access, bus->slave_count);
		if (r < 0) {
			return r;
		}
		for (size_t i = 0; i < bus->slave_count; i++) {
			left += access[i].wkc != 1 || (buf[i][0] & AL_STATE_MASK) != AL_INIT;
		}
		if (left == 0 || bus_now(bus).ns >= give_up.ns) {
			return 0;
		}
		r = line_sleep(bus->line, (span_t){ NS_PER_MS });
		if (r < 0) {
			return r;
		}
	}
}

static void reset_tables(struct bus *bus, size_t count)
{
	memset(bus->soem_slave, 0, sizeof(bus->soem_slave));
	memset(bus->group, 0, sizeof(bus->group));
	for (unsigned i = 0; i < EC_MAXGROUP; i++) {
		bus->group[i].logstartaddr = i << EC_LOGGROUPOFFSET;
	}
	bus_sii_free(bus);
	memset(bus->slave, 0, sizeof(bus->slave));
	bus->slave_count = count;
	bus->soem_slave_count = (int)count;
	for (size_t i = 0; i < count; i++) {
		bus->slave[i].info.slave_pos = (uint16_t)i;
		bus->slave[i].info.station_addr = (uint16_t)(STATION_FIRST + i);
		bus->slave[i].info.counter_channel = -1;
		bus->soem_slave[soem_index(i)].configadr = (uint16)(STATION_FIRST + i);
	}
}

static int set_up(struct bus *bus)
{
	static struct access access[2 * LIMIT_SLAVES];
	static uint8_t buf[LIMIT_SLAVES][2];
	int r = set_defaults(bus);

	if (r >= 0) {
		r = give_addresses(bus, access, buf);
	}
	if (r >= 0) {
		r = check_addresses(bus, access, buf);
	}
	if (r >= 0) {
		r = read_chips(bus);
	}
	return r < 0 ? r : wait_for_init(bus, access, buf);
}

int bus_enumerate(struct bus *bus)
{
	int count = -ECANCELED;
	int r;

	reset_tables(bus, 0);
	if (reset_states(bus) != -ECANCELED) {
		count = count_slaves(bus);
	}
	if (count <= 0) {
		return count == -ETIMEDOUT ? 0 : count;
	}
	if (count > LIMIT_SLAVES) {
		return -E2BIG;
	}
	reset_tables(bus, (size_t)count);
	r = set_up(bus);
	return r < 0 ? r : count;
}
