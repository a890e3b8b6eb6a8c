/* SPDX-License-Identifier: MIT */
#include "bus/esc_access.h"

#include <errno.h>
#include <string.h>

#include "bus/bus_internal.h"
#include "bus/registers.h"

enum { ADDRESS_SPACE = 0x10000 };

/* What the master sets itself, or needs unchanged, while the bus is in operation. */
static const struct {
	uint32_t from;
	uint32_t end;
	const char *name;
} guarded[] = {
	{ ESC_REG_STATION_ADDRESS, ESC_REG_STATION_ALIAS + 2, "station address and alias" },
	{ ESC_REG_WRITE_ENABLE, ESC_REG_ESC_WRITE_PROTECT + 1, "write protection" },
	{ ESC_REG_RESET_ECAT, ESC_REG_RESET_PDI + 1, "reset" },
	{ ESC_REG_DL_CONTROL, ESC_REG_DL_CONTROL + 4, "DL control" },
	{ ESC_REG_AL_CONTROL, ESC_REG_AL_CONTROL + 2, "AL control" },
	{ ESC_REG_WATCHDOG_DIVIDER, ESC_REG_WATCHDOG_TIME_PD + 2, "watchdogs" },
	{ ESC_REG_EEPROM_CONFIG, ESC_REG_MII_CONTROL, "EEPROM interface" },
	{ ESC_REG_FMMU, ESC_REG_SM, "FMMUs" },
	{ ESC_REG_SM, ESC_REG_DC_RECEIVE_TIME_PORT, "SyncManagers" },
	{ ESC_REG_DC_RECEIVE_TIME_PORT, ESC_REG_DC_SYNC1_CYCLE + 4, "DC and SYNC unit" },
	{ ESC_REG_DIGITAL_OUTPUTS, ESC_REG_DIGITAL_OUTPUTS + 4, "digital outputs" },
	{ ESC_REG_PROCESS_RAM, ADDRESS_SPACE, "process RAM" },
};

const char *esc_access_guarded(uint16_t reg, size_t len)
{
	for (size_t i = 0; i < sizeof(guarded) / sizeof(guarded[0]); i++) {
		if (reg < guarded[i].end && reg + len > guarded[i].from) {
			return guarded[i].name;
		}
	}
	return NULL;
}

static int check(struct bus *bus, size_t pos, uint16_t reg, size_t len)
{
	if (pos >= bus->slave_count) {
		return bus_fail(bus, -ENODEV, "no slave at position %zu: there are %zu", pos,
				bus->slave_count);
	}
	if (len == 0 || len > ESC_ACCESS_BYTES || reg + len > ADDRESS_SPACE) {
		return bus_fail_slave(bus, pos, -EINVAL,
				      "0x%04x, %zu bytes: expected 1 to %d bytes up to 0xffff", reg,
				      len, ESC_ACCESS_BYTES);
	}
	return 0;
}

static int run(struct bus *bus, size_t pos, struct access *access)
{
	int r;

	access->adp = bus->slave[pos].info.station_addr;
	r = registers_run(bus, access, 1);
	if (r < 0) {
		return bus_fail_slave(bus, pos, -EIO, "0x%04x: no frame came back", access->reg);
	}
	if (access->wkc > 1) {
		return bus_fail_slave(bus, pos, -EBADMSG,
				      "0x%04x: %u slaves answer at its station address",
				      access->reg, access->wkc);
	}
	return access->wkc == 1 ? 0
				: bus_fail_slave(bus, pos, -ENXIO,
						 "0x%04x does not answer: no such register, or it "
						 "cannot be accessed now",
						 access->reg);
}

int esc_access_read(struct bus *bus, size_t pos, uint16_t reg, uint8_t *ret_data, size_t len,
		    char *error)
{
	uint8_t data[ESC_ACCESS_BYTES] = { 0 };
	int r;

	bus->error = error;
	r = check(bus, pos, reg, len);
	if (r == 0) {
		r = run(bus, pos,
			&(struct access){ .cmd = ECAT_CMD_FPRD,
					  .reg = reg,
					  .len = (uint16_t)len,
					  .data = data });
	}
	if (r == 0) {
		memcpy(ret_data, data, len);
	}
	return r;
}

/* NOLINTNEXTLINE(readability-function-size): the interface of esc_access.h */
int esc_access_write(struct bus *bus, size_t pos, uint16_t reg, const uint8_t *data, size_t len,
		     enum esc_guard guard, char *error)
{
	uint8_t copy[ESC_ACCESS_BYTES];
	const char *name = esc_access_guarded(reg, len);
	int r;

	bus->error = error;
	r = check(bus, pos, reg, len);
	if (r < 0) {
		return r;
	}
	if (name != NULL && guard == ESC_GUARDED &&
	    (bus->target == AL_SAFEOP || bus->target == AL_OP)) {
		return bus_fail_slave(bus, pos, -EPERM,
				      "0x%04x: %s: not written while the bus is in operation, "
				      "unless forced",
				      reg, name);
	}
	memcpy(copy, data, len);
	return run(bus, pos,
		   &(struct access){
			   .cmd = ECAT_CMD_FPWR, .reg = reg, .len = (uint16_t)len, .data = copy });
}
