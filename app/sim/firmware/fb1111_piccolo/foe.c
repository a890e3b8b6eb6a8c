/* SPDX-License-Identifier: MIT */
#include "foe.h"

#include <string.h>

enum foe_layout { FOE_HEADER = 6, FOE_NUMBER = 2, FOE_PACKET_MAX = MAILBOX_DATA_MAX - FOE_HEADER };

enum foe_operation { FOE_READ = 1, FOE_WRITE, FOE_DATA, FOE_ACK, FOE_ERROR, FOE_BUSY };

#define FOE_DISK_FULL UINT32_C(0x8003)
#define FOE_ILLEGAL UINT32_C(0x8004)
#define FOE_PACKET_NUMBER UINT32_C(0x8005)
#define FOE_BOOTSTRAP_ONLY UINT32_C(0x8008)
#define FOE_CHECKSUM UINT32_C(0x800c)
#define FOE_FIRMWARE UINT32_C(0x800d)
#define FOE_NO_FILE UINT32_C(0x800f)
#define FOE_NO_HEADER UINT32_C(0x8010)
#define FOE_FLASH UINT32_C(0x8011)

static uint16_t least(uint16_t a, uint16_t b)
{
	return a < b ? a : b;
}

uint32_t piccolo_crc32(uint32_t crc, const octet_t *data, uint32_t len)
{
	uint32_t i;
	unsigned bit;

	crc = ~crc;
	for (i = 0; i < len; i++) {
		crc ^= data[i];
		for (bit = 0; bit < 8; bit++) {
			crc = crc >> 1 ^ ((crc & 1u) ? UINT32_C(0xedb88320) : 0u);
		}
	}
	return ~crc & UINT32_C(0xffffffff);
}

void piccolo_foe_reset(struct piccolo *p)
{
	memset(&p->update, 0, sizeof(p->update));
}

int piccolo_foe_has_image(const struct piccolo *p)
{
	return p->update.is_complete;
}

/* --- answers --- */

static uint16_t put_number(octet_t *answer, enum foe_operation operation, uint32_t number)
{
	answer[0] = OCTET(operation);
	answer[1] = 0;
	octets_put32(answer + FOE_NUMBER, number);
	return FOE_HEADER;
}

static uint16_t put_error(struct piccolo *p, octet_t *answer, uint32_t code, const char *text)
{
	uint16_t len = (uint16_t)strlen(text);
	uint16_t i;

	piccolo_foe_reset(p);
	(void)put_number(answer, FOE_ERROR, code);
	for (i = 0; i < len; i++) {
		answer[FOE_HEADER + i] = OCTET((unsigned char)text[i]);
	}
	return (uint16_t)(FOE_HEADER + len);
}

/* --- the image --- */

/* Once the header is whole: 0, or why the file is refused. */
static uint32_t check_header(struct piccolo *p, const char **ret_text)
{
	struct piccolo_update *u = &p->update;
	static const octet_t magic[4] = { 'P', 'I', 'C', '1' };
	unsigned i;

	for (i = 0; i < 4; i++) {
		if (u->header[IMAGE_MAGIC + i] != magic[i]) {
			*ret_text = "no FB1111-Piccolo image";
			return FOE_NO_HEADER;
		}
	}
	if (octets_get32(u->header + IMAGE_PRODUCT) != PICCOLO_PRODUCT_CODE) {
		*ret_text = "image of another product";
		return FOE_FIRMWARE;
	}
	if (octets_get32(u->header + IMAGE_LENGTH) > PICCOLO_FLASH_OCTETS - IMAGE_HEADER) {
		*ret_text = "image longer than the flash";
		return FOE_DISK_FULL;
	}
	return 0;
}

static uint32_t take_octets(struct piccolo *p, const octet_t *data, uint16_t len,
			    const char **ret_text)
{
	struct piccolo_update *u = &p->update;
	uint16_t in_header =
		least(len, u->received < IMAGE_HEADER ? (uint16_t)(IMAGE_HEADER - u->received) : 0);
	uint32_t code;
	uint16_t i;

	for (i = 0; i < in_header; i++) {
		u->header[u->received + i] = data[i];
	}
	if (in_header > 0 && u->received + in_header == IMAGE_HEADER) {
		code = check_header(p, ret_text);
		if (code != 0) {
			return code;
		}
	}
	if (len > PICCOLO_FLASH_OCTETS - u->received) {
		*ret_text = "file longer than the flash";
		return FOE_DISK_FULL;
	}
	u->crc = piccolo_crc32(u->crc, data + in_header, (uint32_t)(len - in_header));
	if (p->hal.flash_write(p->hal.ctx, u->received, data, len) != 0) {
		*ret_text = "flash cannot be written";
		return FOE_FLASH;
	}
	u->received += len;
	return 0;
}

static uint32_t check_whole(const struct piccolo *p, const char **ret_text)
{
	const struct piccolo_update *u = &p->update;

	if (u->received < IMAGE_HEADER) {
		*ret_text = "no FB1111-Piccolo image";
		return FOE_NO_HEADER;
	}
	if (u->received != IMAGE_HEADER + octets_get32(u->header + IMAGE_LENGTH) ||
	    u->crc != octets_get32(u->header + IMAGE_CRC)) {
		*ret_text = "length or CRC-32 wrong";
		return FOE_CHECKSUM;
	}
	return 0;
}

/* --- requests --- */

static uint16_t open_write(struct piccolo *p, octet_t *answer)
{
	if (p->al.state != PICCOLO_BOOT) {
		return put_error(p, answer, FOE_BOOTSTRAP_ONLY, "firmware is written in BOOT");
	}
	piccolo_foe_reset(p);
	p->update.is_open = 1;
	p->hal.flash_erase(p->hal.ctx);
	return put_number(answer, FOE_ACK, 0);
}

static uint16_t take_data(struct piccolo *p, const octet_t *request, uint16_t len, octet_t *answer)
{
	struct piccolo_update *u = &p->update;
	uint32_t packet = octets_get32(request + FOE_NUMBER);
	const char *text = "";
	uint32_t code;

	if (u->packet != 0 && packet == u->packet) {
		return put_number(answer, FOE_ACK, packet); /* the answer was lost */
	}
	if (!u->is_open) {
		return put_error(p, answer, FOE_ILLEGAL, "no file is open");
	}
	if (packet != u->packet + 1) {
		return put_error(p, answer, FOE_PACKET_NUMBER, "packet number");
	}
	if (p->hal.flash_is_busy(p->hal.ctx)) {
		return put_number(answer, FOE_BUSY, 0); /* done 0 of 0: not known */
	}
	code = take_octets(p, request + FOE_HEADER, (uint16_t)(len - FOE_HEADER), &text);
	if (code == 0 && len - FOE_HEADER < FOE_PACKET_MAX) { /* the last */
		code = check_whole(p, &text);
		u->is_open = 0;
		u->is_complete = OCTET(code == 0);
	}
	if (code != 0) {
		return put_error(p, answer, code, text);
	}
	u->packet = packet;
	return put_number(answer, FOE_ACK, packet);
}

enum piccolo_mailbox_error piccolo_foe(struct piccolo *p, const octet_t *request, uint16_t len,
				       octet_t *answer, uint16_t *ret_len)
{
	if (len < FOE_HEADER) {
		return MAILBOX_SIZE_TOO_SHORT;
	}
	*ret_len = 0;
	switch (request[0]) {
	case FOE_WRITE:
		*ret_len = open_write(p, answer);
		return MAILBOX_OK;
	case FOE_DATA:
		*ret_len = take_data(p, request, len, answer);
		return MAILBOX_OK;
	case FOE_READ:
		*ret_len = put_error(p, answer, FOE_NO_FILE, "no file can be read");
		return MAILBOX_OK;
	case FOE_ERROR: /* the master gives up */
		piccolo_foe_reset(p);
		return MAILBOX_OK;
	case FOE_ACK: /* of a read that was refused */
	case FOE_BUSY:
		return MAILBOX_OK;
	default: /* an octet of the wire */
		return MAILBOX_SERVICE_NOT_SUPPORTED;
	}
}
