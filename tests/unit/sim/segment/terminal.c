/* SPDX-License-Identifier: MIT */
#include "terminal.h"

#include "base/bytes.h"
#include "devices/sii_device.h"
#include "harness/test.h"
#include "wire/al.h"
#include "wire/esc_reg.h"
#include "wire/sii.h"

enum { STATION = BENCH_STATION, WAIT_NS = 2000000, BOX_BYTES = 128, TYPE_COE = 3 };

static uint16_t box_bytes;
static uint8_t request_counter;

struct writer {
	uint8_t *bytes;
	size_t pos;
	size_t category;
};

static void put(struct writer *w, uint64_t value, size_t len)
{
	for (size_t i = 0; i < len; i++) {
		w->bytes[w->pos++] = (uint8_t)(value >> (8 * i));
	}
}

static void begin(struct writer *w, uint16_t type)
{
	w->category = w->pos;
	put(w, type, 4);
}

static void end(struct writer *w)
{
	w->pos += (w->pos - w->category) % 2;
	put_le16(w->bytes + w->category + 2, (uint16_t)((w->pos - w->category - 4) / 2));
}

static void put_sm(struct writer *w, uint16_t start, uint16_t len, uint8_t control, uint8_t type)
{
	put(w, start, 2);
	put(w, len, 2);
	put(w, control, 2);
	put(w, 1, 1);
	put(w, type, 1);
}

static void put_pdo(struct writer *w, uint16_t index, uint8_t sm, uint8_t entries)
{
	put(w, index, 2);
	put(w, entries, 1);
	put(w, sm, 1);
	put(w, 0, 4);
}

static void put_entry(struct writer *w, uint16_t index, uint8_t subindex, uint8_t bits)
{
	put(w, index, 2);
	put(w, subindex, 1);
	put(w, 0, 2);
	put(w, bits, 1);
	put(w, 0, 2);
}

static void put_categories(struct writer *w, const char *name)
{
	begin(w, SII_CATEGORY_STRINGS);
	put(w, 1, 1);
	put(w, strlen(name), 1);
	memcpy(w->bytes + w->pos, name, strlen(name));
	w->pos += strlen(name);
	end(w);
	begin(w, SII_CATEGORY_GENERAL);
	put(w, 0x01000000, 4); /* the device's name is string 1 */
	put(w, 0x0100, 8);
	put(w, 0, 8);
	end(w);
	begin(w, SII_CATEGORY_SM);
	put_sm(w, TERMINAL_MAILBOX_OUT, BOX_BYTES, 0x26, 1);
	put_sm(w, TERMINAL_MAILBOX_IN, BOX_BYTES, 0x22, 2);
	put_sm(w, TERMINAL_OUTPUTS, TERMINAL_OUTPUT_BYTES, 0x64, 3);
	put_sm(w, TERMINAL_INPUTS, TERMINAL_INPUT_BYTES, 0x20, 4);
	end(w);
	begin(w, SII_CATEGORY_TXPDO);
	put_pdo(w, 0x1a00, 3, 2);
	put_entry(w, 0x6000, 1, 16);
	put_entry(w, 0x6000, 2, 16);
	put_pdo(w, 0x1a01, 0xff, 1);
	put_entry(w, 0x6010, 1, 8);
	end(w);
	begin(w, SII_CATEGORY_RXPDO);
	put_pdo(w, 0x1600, 2, 1);
	put_entry(w, 0x7000, 1, 16);
	put_pdo(w, 0x1601, 2, 2);
	put_entry(w, 0x7010, 1, 1);
	put_entry(w, 0, 0, 7);
	end(w);
	put(w, SII_CATEGORY_END, 2);
}

size_t terminal_sii(uint8_t *sii, const char *name)
{
	struct writer w = { .bytes = sii, .pos = SII_CATEGORIES_BYTE };

	memset(sii, 0, TERMINAL_SII_BYTES);
	sii[0] = 5; /* SPI */
	sii[14] = sii_checksum(sii);
	put_le32(sii + 0x10, 0x00c0ffee);
	put_le32(sii + 0x14, 0x12345678);
	put_le32(sii + 0x18, 0x00010002);
	put_le32(sii + 0x1c, 4711);
	put_le16(sii + 0x28, TERMINAL_MAILBOX_OUT);
	put_le16(sii + 0x2a, BOX_BYTES);
	put_le16(sii + 0x2c, TERMINAL_MAILBOX_IN);
	put_le16(sii + 0x2e, BOX_BYTES);
	put_le16(sii + 0x38, SII_MAILBOX_COE | SII_MAILBOX_FOE);
	put_categories(&w, name);
	return w.pos;
}

struct bench *terminal_create(uint16_t mailbox_bytes)
{
	uint8_t sii[TERMINAL_SII_BYTES];
	size_t bytes = terminal_sii(sii, "Made-up terminal");
	struct sim_device *device = sii_device_create(sii, bytes);

	CHECK(device != NULL);
	box_bytes = mailbox_bytes;
	request_counter = 0;
	return bench_create(&(struct bench_slave){ .pdi = 5, .device = device }, 1);
}

uint16_t terminal_request(struct bench *b, uint16_t control)
{
	bench_write16(b, STATION, ESC_REG_AL_CONTROL, control);
	bench_wait(b, WAIT_NS);
	return bench_read16(b, STATION, ESC_REG_AL_STATUS);
}

uint16_t terminal_code(struct bench *b)
{
	return bench_read16(b, STATION, ESC_REG_AL_STATUS_CODE);
}

void terminal_to_preop(struct bench *b, uint16_t mailbox_bytes)
{
	box_bytes = mailbox_bytes;
	bench_sm(b, STATION, 0, TERMINAL_MAILBOX_OUT, mailbox_bytes, 0x26);
	bench_sm(b, STATION, 1, TERMINAL_MAILBOX_IN, mailbox_bytes, 0x22);
	CHECK_EQ(terminal_request(b, AL_PREOP), AL_PREOP);
}

void terminal_to_safeop(struct bench *b)
{
	bench_sm(b, STATION, 2, TERMINAL_OUTPUTS, TERMINAL_OUTPUT_BYTES, 0x64);
	bench_sm(b, STATION, 3, TERMINAL_INPUTS, TERMINAL_INPUT_BYTES, 0x20);
	CHECK_EQ(terminal_request(b, AL_SAFEOP), AL_SAFEOP);
}

/* --- mailbox --- */

uint16_t terminal_put(struct bench *b, uint8_t type, uint8_t counter, const void *data, size_t len)
{
	uint8_t box[BOX_BYTES] = { 0 };

	CHECK(len + 6 <= box_bytes);
	put_le16(box, (uint16_t)len);
	box[5] = (uint8_t)(type | counter << 4);
	memcpy(box + 6, data, len);
	return bench_send(b, ECAT_CMD_FPWR, STATION, TERMINAL_MAILBOX_OUT, box, box_bytes);
}

int terminal_take(struct bench *b, uint8_t *ret_header, uint8_t *data, size_t capacity)
{
	uint8_t box[BOX_BYTES] = { 0 };
	size_t len;

	bench_wait(b, WAIT_NS);
	if (bench_send(b, ECAT_CMD_FPRD, STATION, TERMINAL_MAILBOX_IN, box, box_bytes) != 1) {
		return -1;
	}
	len = get_le16(box);
	CHECK(len <= capacity && len + 6 <= box_bytes);
	*ret_header = box[5];
	memcpy(data, box + 6, len);
	return (int)len;
}

int terminal_sdo(struct bench *b, uint8_t command, uint16_t index, uint8_t subindex, uint32_t value,
		 uint8_t *answer)
{
	uint8_t request[10] = { 0x00, 0x20, command };
	uint8_t header;

	put_le16(request + 3, index);
	request[5] = subindex;
	put_le32(request + 6, value);
	request_counter = (uint8_t)(request_counter % 7 + 1);
	CHECK_EQ(terminal_put(b, TYPE_COE, request_counter, request, sizeof(request)), 1);
	return terminal_take(b, &header, answer, BOX_BYTES);
}
