/* SPDX-License-Identifier: MIT */
#include "bus/identity.h"

#include <errno.h>
#include <string.h>

#include "base/bytes.h"
#include "bus/bus_internal.h"
#include "bus/registers.h"

enum {
	WORD_ALIAS = 4,
	WORD_VENDOR = 8, /* then product, revision, serial, two words each */
};

#define IDENTIFICATION_NS (200 * NS_PER_MS)

void identity_begin(struct identity_reader *reader, uint16_t station, mono_t give_up)
{
	*reader = (struct identity_reader){ .result = 1 };
	eeprom_begin(&reader->command, EEPROM_OP_READ, station, WORD_VENDOR, give_up);
}

/* All words are there; the command has the alias. */
static int finish(struct identity_reader *reader)
{
	const uint8_t *words = reader->words;

	if (get_le32(words) == 0 || get_le32(words) == UINT32_MAX) {
		return -ENODATA;
	}
	reader->identity = (struct bus_identity){ .vendor = get_le32(words),
						  .product = get_le32(words + 4),
						  .revision = get_le32(words + 8),
						  .serial = get_le32(words + 12),
						  .alias = get_le16(reader->command.data) };
	return 0;
}

/* A command is done. */
static int take_words(struct identity_reader *reader)
{
	struct eeprom_command *cmd = &reader->command;

	if ((cmd->status & (EEPROM_CHECKSUM_ERROR | EEPROM_NOT_LOADED)) != 0) {
		return -EBADMSG;
	}
	if (reader->len == sizeof(reader->words)) {
		return finish(reader);
	}
	memcpy(reader->words + reader->len, cmd->data, (size_t)2 * cmd->words);
	reader->len += (size_t)2 * cmd->words;
	eeprom_read_next(cmd, reader->len == sizeof(reader->words)
				      ? WORD_ALIAS
				      : (uint32_t)(WORD_VENDOR + reader->len / 2));
	return 1;
}

void identity_step(struct bus *bus, struct identity_reader *const *reader, size_t count)
{
	struct access access[IDENTITY_READERS * EEPROM_ACCESSES];
	size_t first[IDENTITY_READERS];
	size_t n = 0;
	int r;

	for (size_t i = 0; i < count; i++) {
		first[i] = n;
		if (reader[i]->result == 1) {
			n += eeprom_prepare(&reader[i]->command, &access[n]);
		}
	}
	r = registers_run(bus, access, n);
	for (size_t i = 0; i < count; i++) {
		struct identity_reader *rd = reader[i];

		if (rd->result != 1) {
			continue;
		}
		if (r < 0) {
			rd->result = bus_now(bus).ns < rd->command.give_up.ns ? 1 : -ETIME;
			continue;
		}
		rd->result = eeprom_take(&rd->command, &access[first[i]], bus_now(bus));
		if (rd->result == 0) {
			rd->result = take_words(rd);
		}
	}
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
