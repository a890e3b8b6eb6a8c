/* SPDX-License-Identifier: MIT */
/* The diagnosis registers of an ESC, decoded (ET1100 data sheet, section II). */
#include <errno.h>
#include <string.h>

#include "base/bytes.h"
#include "bus/bus_internal.h"
#include "bus/esc_access.h"
#include "bus/registers.h"

enum {
	WATCHDOG_BASE_NS = 40,
	PORT_LINK = 4, /* DL status: bit of port 0 */
	LOOP_CLOSED = 8,
	COMMUNICATION = 9,
	PORT_EBUS = 2, /* of a port's two bits in the descriptor */
};

/* As they are read, in one frame. */
struct raw {
	uint8_t chip[10]; /* 0x0000 */
	uint8_t dl_status[2];
	uint8_t al_status[6]; /* and the code at 4 */
	uint8_t errors[14];   /* 0x0300 */
	uint8_t links[ESC_PORTS];
	uint8_t divider[2];
	uint8_t time_pdi[2];
	uint8_t time_pd[2];
	uint8_t alive[1];
	uint8_t expirations[2];
	uint8_t eeprom[2];
};

enum { CHIP, DL, AL, ERRORS, LINKS, DIVIDER, TIME_PDI, TIME_PD, ALIVE, EXPIRED, EEPROM, ACCESSES };

static void take_ports(const struct raw *raw, struct esc_diagnosis *ret)
{
	for (unsigned i = 0; i < ESC_PORTS; i++) {
		ret->port[i] = (struct esc_port_diagnosis){
			.is_link = ret->dl_status >> (PORT_LINK + i) & 1,
			.is_loop_closed = ret->dl_status >> (LOOP_CLOSED + 2 * i) & 1,
			.is_communicating = ret->dl_status >> (COMMUNICATION + 2 * i) & 1,
			.is_ebus = (raw->chip[ESC_REG_PORT_DESCRIPTOR] >> 2 * i & 3) == PORT_EBUS,
			.invalid_frames = raw->errors[(size_t)2 * i],
			.rx_errors = raw->errors[(size_t)2 * i + 1],
			.forwarded_errors = raw->errors[2 * ESC_PORTS + i],
			.lost_links = raw->links[i],
		};
	}
}

static void take_watchdog(const struct raw *raw, const struct access *ac, struct esc_diagnosis *ret)
{
	int64_t unit_ns = (get_le16(raw->divider) + INT64_C(2)) * WATCHDOG_BASE_NS;

	ret->has_watchdog = ac[DIVIDER].wkc == 1 && ac[TIME_PD].wkc == 1;
	ret->watchdog_pd_ns = unit_ns * get_le16(raw->time_pd);
	ret->watchdog_pdi_ns = unit_ns * get_le16(raw->time_pdi);
	ret->is_watchdog_alive = raw->alive[0] & 1;
	ret->has_expirations = ac[EXPIRED].wkc == 1;
	ret->expirations_pd = raw->expirations[0];
	ret->expirations_pdi = raw->expirations[1];
}

static void take(const struct raw *raw, const struct access *ac, struct esc_diagnosis *ret)
{
	ret->type = raw->chip[ESC_REG_TYPE];
	ret->revision = raw->chip[ESC_REG_REVISION];
	ret->build = get_le16(raw->chip + ESC_REG_BUILD);
	ret->features = get_le16(raw->chip + ESC_REG_FEATURES);
	ret->dl_status = get_le16(raw->dl_status);
	ret->al_status = get_le16(raw->al_status);
	ret->al_status_code = get_le16(raw->al_status + 4);
	ret->is_pdi_operational = ret->dl_status & 1;
	ret->is_pdi_watchdog_alive = ret->dl_status >> 1 & 1;
	ret->is_enhanced_link = ret->dl_status >> 2 & 1;
	ret->has_processing_errors = ac[ERRORS].wkc == 1;
	ret->processing_errors = raw->errors[(size_t)3 * ESC_PORTS];
	ret->pdi_errors = raw->errors[3 * ESC_PORTS + 1];
	ret->has_eeprom = ac[EEPROM].wkc == 1;
	ret->eeprom_status = get_le16(raw->eeprom);
	ret->is_eeprom_emulated = (ret->eeprom_status & EEPROM_EMULATED) != 0;
	take_ports(raw, ret);
	take_watchdog(raw, ac, ret);
}

static struct access access_of(uint16_t reg, void *data, size_t len)
{
	return (struct access){
		.cmd = ECAT_CMD_FPRD, .reg = reg, .len = (uint16_t)len, .data = data
	};
}

/* 0 or -errno with a line; the first access must have been answered by one slave. */
static int run(struct bus *bus, size_t pos, struct access *access, size_t count)
{
	for (size_t i = 0; i < count; i++) {
		access[i].adp = bus->slave[pos].info.station_addr;
	}
	if (registers_run(bus, access, count) < 0) {
		return bus_fail_slave(bus, pos, -EIO, "no frame came back");
	}
	if (access[0].wkc != 1) {
		return bus_fail_slave(bus, pos, access[0].wkc == 0 ? -ENXIO : -EBADMSG,
				      "%u slaves answer at its station address", access[0].wkc);
	}
	return 0;
}

int esc_diagnosis_read(struct bus *bus, size_t pos, struct esc_diagnosis *ret, char *error)
{
	struct raw raw = { 0 };
	struct access ac[ACCESSES] = {
		[CHIP] = access_of(ESC_REG_TYPE, raw.chip, sizeof(raw.chip)),
		[DL] = access_of(ESC_REG_DL_STATUS, raw.dl_status, sizeof(raw.dl_status)),
		[AL] = access_of(ESC_REG_AL_STATUS, raw.al_status, sizeof(raw.al_status)),
		[ERRORS] = access_of(ESC_REG_RX_ERROR_COUNTER, raw.errors, sizeof(raw.errors)),
		[LINKS] = access_of(ESC_REG_LOST_LINK_COUNTER, raw.links, sizeof(raw.links)),
		[DIVIDER] = access_of(ESC_REG_WATCHDOG_DIVIDER, raw.divider, sizeof(raw.divider)),
		[TIME_PDI] =
			access_of(ESC_REG_WATCHDOG_TIME_PDI, raw.time_pdi, sizeof(raw.time_pdi)),
		[TIME_PD] = access_of(ESC_REG_WATCHDOG_TIME_PD, raw.time_pd, sizeof(raw.time_pd)),
		[ALIVE] = access_of(ESC_REG_WATCHDOG_STATUS_PD, raw.alive, sizeof(raw.alive)),
		[EXPIRED] = access_of(ESC_REG_WATCHDOG_COUNTER_PD, raw.expirations,
				      sizeof(raw.expirations)),
		[EEPROM] = access_of(ESC_REG_EEPROM_CONTROL, raw.eeprom, sizeof(raw.eeprom)),
	};
	int r;

	bus->error = error;
	if (pos >= bus->slave_count) {
		return bus_fail(bus, -ENODEV, "no slave at position %zu: there are %zu", pos,
				bus->slave_count);
	}
	r = run(bus, pos, ac, ACCESSES);
	if (r == 0) {
		*ret = (struct esc_diagnosis){ 0 };
		take(&raw, ac, ret);
	}
	return r;
}

int esc_errors_reset(struct bus *bus, size_t pos, char *error)
{
	uint8_t zeros[14] = { 0 };
	struct access ac[] = {
		{ .cmd = ECAT_CMD_FPWR,
		  .reg = ESC_REG_RX_ERROR_COUNTER,
		  .len = sizeof(zeros),
		  .data = zeros },
		{ .cmd = ECAT_CMD_FPWR,
		  .reg = ESC_REG_LOST_LINK_COUNTER,
		  .len = ESC_PORTS,
		  .data = zeros },
		{ .cmd = ECAT_CMD_FPWR,
		  .reg = ESC_REG_WATCHDOG_COUNTER_PD,
		  .len = 2,
		  .data = zeros },
	};
	int r;

	bus->error = error;
	if (pos >= bus->slave_count) {
		return bus_fail(bus, -ENODEV, "no slave at position %zu: there are %zu", pos,
				bus->slave_count);
	}
	r = run(bus, pos, ac, sizeof(ac) / sizeof(ac[0]));
	if (r == 0) {
		error_counters_restart(&bus->slave[pos].errors);
	}
	return r;
}
