/* SPDX-License-Identifier: MIT */
/*
 * SII contents of all slaves, read at the same time: a frame has the next EEPROM access of each. A
 * word that was not read is an error. Everything is read until two reads in a row agree, and each
 * slave's own EEPROM is read, whatever its identity says.
 */
#include <errno.h>
#include <stdlib.h>
#include <string.h>

#include "base/bytes.h"
#include "bus/bus_internal.h"
#include "bus/eeprom.h"
#include "bus/registers.h"

enum {
	PASSES = 5, /* reads of the same words; the last two must agree */
	CATEGORY_HEADER_BYTES = 4,
};

#define COMMAND_NS NS_PER_S /* for one command, busy and repeated */
#define POLL_NS (100 * NS_PER_US)

enum reader_phase { READ_HEADER, READ_CATEGORIES, READ_DONE };

/* The words from @from to @end are read now. */
struct sii_reader {
	struct eeprom_command command;
	enum reader_phase phase;
	uint8_t header[SII_CATEGORIES_BYTE];
	uint8_t *image; /* header, then as large as the size word says */
	size_t limit;
	size_t category; /* where the next category begins */
	size_t from;
	size_t at;
	size_t end;
	unsigned passes; /* of this span so far */
	int has_changed; /* in this pass */
};

static int is_needed(uint16_t category)
{
	return category == SII_CATEGORY_STRINGS || category == SII_CATEGORY_GENERAL ||
	       category == SII_CATEGORY_FMMU || category == SII_CATEGORY_SM ||
	       category == SII_CATEGORY_TXPDO || category == SII_CATEGORY_RXPDO ||
	       category == SII_CATEGORY_DC;
}

static void next_command(struct bus *bus, size_t pos, struct sii_reader *rd)
{
	eeprom_begin(&rd->command, EEPROM_OP_READ, bus->slave[pos].info.station_addr,
		     (uint32_t)(rd->at / 2), mono_add(bus_now(bus), (span_t){ COMMAND_NS }));
}

static void begin_span(struct sii_reader *rd, size_t from, size_t end)
{
	rd->from = from;
	rd->at = from;
	rd->end = end < rd->limit ? end : rd->limit;
	rd->passes = 0;
	rd->has_changed = 0;
}

/* --- the walk --- */

static void finish(struct bus_slave *sl, struct sii_reader *rd, size_t len)
{
	sl->sii = rd->image;
	sl->sii_len = len;
	rd->phase = READ_DONE;
}

/* The header of the category at rd->category is in the image. */
static void on_category(struct bus_slave *sl, struct sii_reader *rd)
{
	size_t at = rd->category;
	uint16_t type = get_le16(rd->image + at);
	size_t body_end = at + CATEGORY_HEADER_BYTES + 2 * (size_t)get_le16(rd->image + at + 2);

	if (type == SII_CATEGORY_END) {
		finish(sl, rd, at + CATEGORY_HEADER_BYTES);
		return;
	}
	if (body_end + CATEGORY_HEADER_BYTES > rd->limit) {
		finish(sl, rd, rd->limit); /* sii_parse() finds that it runs past the end */
		return;
	}
	rd->category = body_end;
	begin_span(rd, is_needed(type) ? at + CATEGORY_HEADER_BYTES : body_end,
		   body_end + CATEGORY_HEADER_BYTES);
}

/* Nothing behind a header that is blank or damaged can be trusted (bus/scan.c reports it). */
static int is_walkable(const uint8_t *header, uint16_t status)
{
	uint32_t vendor = get_le32(header + SII_VENDOR_BYTE);

	return vendor != 0 && vendor != UINT32_MAX &&
	       (sii_is_checksum_right(header) || (status & EEPROM_EMULATED) != 0);
}

static int on_header(struct bus *bus, struct bus_slave *sl, struct sii_reader *rd)
{
	size_t limit = sii_stated_bytes(rd->header);

	rd->image = calloc(1, limit);
	if (rd->image == NULL) {
		return bus_fail(bus, -ENOMEM, "no memory for %zu bytes of SII", limit);
	}
	memcpy(rd->image, rd->header, sizeof(rd->header));
	rd->limit = limit;
	sl->eeprom_status = rd->command.status;
	if (!is_walkable(rd->header, sl->eeprom_status)) {
		finish(sl, rd, SII_CATEGORIES_BYTE);
		return 0;
	}
	rd->phase = READ_CATEGORIES;
	rd->category = SII_CATEGORIES_BYTE;
	begin_span(rd, SII_CATEGORIES_BYTE, SII_CATEGORIES_BYTE + CATEGORY_HEADER_BYTES);
	return 0;
}

/* --- words --- */

static void store(struct sii_reader *rd)
{
	uint8_t *to = (rd->phase == READ_HEADER ? rd->header : rd->image) + rd->at;
	size_t len = 2u * (size_t)rd->command.words;

	if (len > rd->end - rd->at) {
		len = rd->end - rd->at;
	}
	rd->has_changed |= memcmp(to, rd->command.data, len) != 0;
	memcpy(to, rd->command.data, len);
	rd->at += len;
}

/* A command is done: the next one. 0 or -errno with a line. */
static int on_words(struct bus *bus, size_t pos, struct sii_reader *rd)
{
	int r = 0;

	store(rd);
	if (rd->at == rd->end) {
		rd->passes++;
		if (rd->passes == 1 || rd->has_changed) {
			if (rd->passes == PASSES) {
				return bus_fail_slave(
					bus, pos, -EIO,
					"its EEPROM cannot be read: words 0x%04zx to 0x%04zx "
					"differ from one read to the next",
					rd->from / 2, rd->end / 2 - 1);
			}
			rd->at = rd->from;
			rd->has_changed = 0;
		} else if (rd->phase == READ_HEADER) {
			r = on_header(bus, &bus->slave[pos], rd);
		} else {
			on_category(&bus->slave[pos], rd);
		}
	}
	if (r == 0 && rd->phase != READ_DONE) {
		next_command(bus, pos, rd);
	}
	return r;
}

/* --- all slaves --- */

struct sii_readers {
	struct sii_reader reader[LIMIT_SLAVES];
	struct access access[LIMIT_SLAVES * EEPROM_ACCESSES];
	size_t first[LIMIT_SLAVES]; /* of a slave's accesses */
};

static size_t prepare_all(const struct bus *bus, struct sii_readers *rs)
{
	size_t count = 0;

	for (size_t i = 0; i < bus->slave_count; i++) {
		rs->first[i] = count;
		if (rs->reader[i].phase != READ_DONE) {
			count += eeprom_prepare(&rs->reader[i].command, &rs->access[count]);
		}
	}
	return count;
}

/* How many commands are done, or -errno with a line. */
static int take_all(struct bus *bus, struct sii_readers *rs)
{
	mono_t now = bus_now(bus);
	int done = 0;

	for (size_t i = 0; i < bus->slave_count; i++) {
		struct sii_reader *rd = &rs->reader[i];
		int r;

		if (rd->phase == READ_DONE) {
			continue;
		}
		r = eeprom_take(&rd->command, &rs->access[rs->first[i]], now);
		if (r < 0) {
			return bus_fail_slave(
				bus, i, -EIO,
				"its EEPROM cannot be read at word 0x%04x: %s (0x0502 is 0x%04x)",
				rd->command.word, eeprom_error_text(r), rd->command.status);
		}
		if (r == 0) {
			r = on_words(bus, i, rd);
			done++;
		}
		if (r < 0) {
			return r;
		}
	}
	return done;
}

static int read_all(struct bus *bus, struct sii_readers *rs)
{
	size_t count;

	while ((count = prepare_all(bus, rs)) > 0) {
		int r = registers_run(bus, rs->access, count);

		if (r < 0) {
			return bus_fail(bus, r, "the EEPROMs cannot be read: frames are lost (%s)",
					strerror(-r));
		}
		r = take_all(bus, rs);
		if (r < 0) {
			return r;
		}
		if (r == 0 && line_sleep(bus->line, (span_t){ POLL_NS }) < 0) {
			return bus_fail(bus, -ECANCELED, "told to stop");
		}
	}
	return 0;
}

int bus_sii_load(struct bus *bus)
{
	struct sii_readers *rs = calloc(1, sizeof(*rs));
	int r;

	if (rs == NULL) {
		return bus_fail(bus, -ENOMEM, "no memory to read the EEPROMs");
	}
	bus_sii_free(bus);
	for (size_t i = 0; i < bus->slave_count; i++) {
		rs->reader[i].limit = SII_CATEGORIES_BYTE;
		begin_span(&rs->reader[i], 0, SII_CATEGORIES_BYTE);
		next_command(bus, i, &rs->reader[i]);
	}
	r = read_all(bus, rs);
	for (size_t i = 0; i < bus->slave_count; i++) {
		if (rs->reader[i].phase != READ_DONE) {
			free(rs->reader[i].image);
		}
	}
	free(rs);
	return r;
}
