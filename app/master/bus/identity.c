/* SPDX-License-Identifier: MIT */
#include "bus/identity.h"

#include <errno.h>
#include <string.h>

#include "base/bytes.h"
#include "bus/bus_internal.h"
#include "bus/registers.h"

enum {
	STATUS_READS_8_BYTES = 1 << 6,
	STATUS_COMMAND_READ = 1 << 8,
	STATUS_CHECKSUM_ERROR = 1 << 11,
	STATUS_NOT_LOADED = 1 << 12,
	STATUS_NO_ACKNOWLEDGE = 1 << 13,
	STATUS_BUSY = 1 << 15,
	WORD_ALIAS = 4,
	WORD_VENDOR = 8, /* then product, revision, serial, two words each */
	IDENTITY_BYTES = 16,
	POLLS_MAX = 20,
	INTERFACE_BYTES = 14, /* 0x0502: control and status, address, data */
	COMMAND_BYTES = 6,
};

#define IDENTIFICATION_NS (200 * NS_PER_MS)

static int run_on(struct bus *bus, enum ecat_cmd cmd, uint16_t station, uint16_t reg, void *data,
		  uint16_t len)
{
	struct access access = { .cmd = cmd, .adp = station, .reg = reg, .len = len, .data = data };
	int r = registers_run(bus, &access, 1);

	return r < 0 ? r : access.wkc == 1 ? 0 : -EAGAIN;
}

static int status_error(uint16_t status)
{
	if ((status & STATUS_BUSY) != 0) {
		return -EAGAIN;
	}
	if ((status & STATUS_NO_ACKNOWLEDGE) != 0) {
		return -EREMOTEIO;
	}
	return (status & (STATUS_CHECKSUM_ERROR | STATUS_NOT_LOADED)) != 0 ? -EBADMSG : 0;
}

/* From the PDI, if another master has given it to that. */
static int take_interface(struct bus *bus, uint16_t station, uint16_t *ret_status)
{
	uint8_t force = 2;
	uint8_t own = 0;
	uint8_t status[2] = { 0 };
	int r = run_on(bus, ECAT_CMD_FPWR, station, ESC_REG_EEPROM_CONFIG, &force, 1);

	if (r == 0) {
		r = run_on(bus, ECAT_CMD_FPWR, station, ESC_REG_EEPROM_CONFIG, &own, 1);
	}
	if (r == 0) {
		r = run_on(bus, ECAT_CMD_FPRD, station, ESC_REG_EEPROM_CONTROL, status,
			   sizeof(status));
	}
	if (r == 0) {
		*ret_status = get_le16(status);
		r = status_error(*ret_status);
	}
	return r;
}

static int read_words(struct bus *bus, uint16_t station, uint16_t word, uint8_t *ret, size_t len)
{
	uint8_t io[INTERFACE_BYTES] = { 0 };
	int r;

	put_le16(io, STATUS_COMMAND_READ);
	put_le16(io + 2, word);
	r = run_on(bus, ECAT_CMD_FPWR, station, ESC_REG_EEPROM_CONTROL, io, COMMAND_BYTES);
	for (unsigned i = 0; i < POLLS_MAX && r == 0; i++) {
		r = run_on(bus, ECAT_CMD_FPRD, station, ESC_REG_EEPROM_CONTROL, io, sizeof(io));
		if (r == 0 && (get_le16(io) & STATUS_BUSY) == 0) {
			r = status_error(get_le16(io));
			if (r == 0 && get_le32(io + 2) == word) {
				memcpy(ret, io + COMMAND_BYTES, len);
				return 0;
			}
			return r < 0 ? r : -EAGAIN;
		}
	}
	return r < 0 ? r : -EAGAIN;
}

int bus_identity_read(struct bus *bus, uint16_t station, struct bus_identity *ret)
{
	uint8_t words[IDENTITY_BYTES] = { 0 };
	uint8_t alias[4] = { 0 };
	uint16_t status = 0;
	size_t len = 4;
	int r = take_interface(bus, station, &status);

	if ((status & STATUS_READS_8_BYTES) != 0) {
		len = 8;
	}
	for (size_t at = 0; at < sizeof(words) && r == 0; at += len) {
		r = read_words(bus, station, (uint16_t)(WORD_VENDOR + at / 2), words + at, len);
	}
	if (r == 0) {
		r = read_words(bus, station, WORD_ALIAS, alias, sizeof(alias));
	}
	if (r < 0) {
		return r;
	}
	if (get_le32(words) == 0 || get_le32(words) == UINT32_MAX) {
		return -ENODATA;
	}
	*ret = (struct bus_identity){ .vendor = get_le32(words),
				      .product = get_le32(words + 4),
				      .revision = get_le32(words + 8),
				      .serial = get_le32(words + 12),
				      .alias = get_le16(alias) };
	return 0;
}

int bus_is_same_device(const struct bus_slave *sl, const struct bus_identity *found)
{
	return sl->info.vendor == found->vendor && sl->info.product == found->product &&
	       sl->info.revision == found->revision &&
	       (sl->info.serial == 0 || sl->info.serial == found->serial) &&
	       sl->info.alias == found->alias;
}

static int read_al(struct bus *bus, size_t pos, uint16_t *ret_status, uint16_t *ret_code)
{
	uint8_t al[6] = { 0 };
	int r = register_read(bus, pos, ESC_REG_AL_STATUS, al, sizeof(al));

	*ret_status = get_le16(al);
	*ret_code = get_le16(al + 4);
	return r;
}

static int write_control(struct bus *bus, size_t pos, unsigned control)
{
	uint8_t word[2];

	put_le16(word, (uint16_t)control);
	return register_write(bus, pos, ESC_REG_AL_CONTROL, word, sizeof(word));
}

uint16_t bus_identification_read(struct bus *bus, size_t pos)
{
	mono_t give_up = mono_add(bus_now(bus), (span_t){ IDENTIFICATION_NS });
	uint16_t status = 0;
	uint16_t id = 0;
	int is_asked = 0;

	while (bus_now(bus).ns < give_up.ns) {
		if (read_al(bus, pos, &status, &id) < 0 || (status & AL_ERROR) != 0) {
			break;
		}
		if ((status & AL_ID_REQUEST) != 0) {
			write_control(bus, pos, status & AL_STATE_MASK);
			return id;
		}
		if (!is_asked) {
			is_asked = write_control(bus, pos,
						 (status & AL_STATE_MASK) | AL_ID_REQUEST) == 0;
		}
		if (line_sleep(bus->line, (span_t){ NS_PER_MS }) < 0) {
			break;
		}
	}
	if (is_asked) {
		write_control(bus, pos, status & AL_STATE_MASK);
	}
	return 0;
}
