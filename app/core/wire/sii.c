/* SPDX-License-Identifier: MIT */
#include "wire/sii.h"

#include <errno.h>
#include <stdio.h>
#include <string.h>

#include "base/bytes.h"

enum {
	CHECKSUM_BYTES = 14,
	CHECKSUM_OFF = 0x88a4,
	KBIT_BYTES = 128,
	GENERAL_BYTES = 14,
	CATEGORY_HEADER_BYTES = 4,
	PDO_HEADER_BYTES = 8,
	PDO_ENTRY_BYTES = 8,
	SM_BYTES = 8,
	DC_MODE_BYTES = 24,
	GENERAL_FLAGS = 11, /* offset in the general category */
};

uint8_t sii_checksum(const uint8_t *image)
{
	uint8_t crc = 0xff;

	for (size_t i = 0; i < CHECKSUM_BYTES; i++) {
		crc ^= image[i];
		for (unsigned bit = 0; bit < 8; bit++) {
			crc = (uint8_t)(crc & 0x80 ? (unsigned)crc << 1 ^ 0x07
						   : (unsigned)crc << 1);
		}
	}
	return crc;
}

int sii_is_checksum_right(const uint8_t *image)
{
	return image[SII_CHECKSUM_BYTE] == sii_checksum(image) ||
	       get_le16(image + SII_CHECKSUM_BYTE) == CHECKSUM_OFF;
}

size_t sii_stated_bytes(const uint8_t *image)
{
	uint16_t kbit = get_le16(image + SII_SIZE_BYTE);
	size_t bytes = ((size_t)kbit + 1) * KBIT_BYTES;

	if (kbit == UINT16_MAX || bytes <= SII_CATEGORIES_BYTE) {
		return SII_UNSTATED_BYTES;
	}
	return bytes < SII_LIMIT_BYTES ? bytes : SII_LIMIT_BYTES;
}

/* One step of the walk: 1 with a category, 0 at the end, -EBADMSG. */
static int next_category(const uint8_t *image, size_t image_bytes, size_t *pos, uint16_t *ret_type,
			 size_t *ret_offset, size_t *ret_bytes)
{
	size_t body_bytes;

	if (*pos + 2 <= image_bytes && get_le16(image + *pos) == SII_CATEGORY_END) {
		return 0;
	}
	if (*pos + CATEGORY_HEADER_BYTES > image_bytes) {
		return -EBADMSG;
	}
	body_bytes = 2u * (size_t)get_le16(image + *pos + 2);
	if (body_bytes > image_bytes - *pos - CATEGORY_HEADER_BYTES) {
		return -EBADMSG;
	}
	*ret_type = get_le16(image + *pos);
	*ret_offset = *pos + CATEGORY_HEADER_BYTES;
	*ret_bytes = body_bytes;
	*pos += CATEGORY_HEADER_BYTES + body_bytes;
	return 1;
}

int sii_find_category(const uint8_t *image, size_t image_bytes, uint16_t wanted, size_t *ret_offset,
		      size_t *ret_bytes)
{
	size_t pos = SII_CATEGORIES_BYTE;
	uint16_t type;
	size_t offset;
	size_t bytes;
	int r;

	while ((r = next_category(image, image_bytes, &pos, &type, &offset, &bytes)) == 1) {
		if (type == wanted) {
			*ret_offset = offset;
			*ret_bytes = bytes;
			return 0;
		}
	}
	return r < 0 ? r : -ENOENT;
}

void sii_text(const uint8_t *image, size_t image_bytes, unsigned number,
	      char ret_text[SII_NAME_BYTES])
{
	size_t offset;
	size_t bytes;
	size_t at = 1;

	ret_text[0] = '\0';
	if (number == 0 ||
	    sii_find_category(image, image_bytes, SII_CATEGORY_STRINGS, &offset, &bytes) < 0 ||
	    bytes < 1 || number > image[offset]) {
		return;
	}
	for (unsigned n = 1; at < bytes; n++) {
		size_t len = image[offset + at++];

		if (len > bytes - at) {
			return;
		}
		if (n == number) {
			size_t kept = len < SII_NAME_BYTES - 1 ? len : SII_NAME_BYTES - 1;

			for (size_t i = 0; i < kept; i++) {
				uint8_t c = image[offset + at + i];

				ret_text[i] = c >= 0x20 && c < 0x7f ? (char)c : '_';
			}
			ret_text[kept] = '\0';
			return;
		}
		at += len;
	}
}

static void parse_general(const uint8_t *p, size_t bytes, struct sii *sii)
{
	if (bytes < 8) {
		return;
	}
	sii->group_name = p[0];
	sii->order_name = p[2];
	sii->device_name = p[3];
	sii->coe_details = p[5];
	sii->general_flags = bytes > GENERAL_FLAGS ? p[GENERAL_FLAGS] : 0;
	sii->foe_details = p[6];
	sii->eoe_details = p[7];
	sii->has_general = 1;
	if (bytes >= GENERAL_BYTES) {
		sii->soe_channels = p[8];
		sii->ebus_ma = (int16_t)get_le16(p + 12);
	}
}

static void parse_sm(const uint8_t *p, size_t bytes, struct sii *sii)
{
	for (; bytes >= SM_BYTES && sii->sm_count < SII_LIMIT_SM;
	     bytes -= SM_BYTES, p += SM_BYTES) {
		sii->sm[sii->sm_count++] = (struct sii_sm){
			.start = get_le16(p),
			.len = get_le16(p + 2),
			.control = p[4],
			.enable = p[6],
			.type = p[7],
		};
	}
}

static void parse_fmmu(const uint8_t *p, size_t bytes, struct sii *sii)
{
	for (size_t i = 0; i < bytes && sii->fmmu_count < SII_LIMIT_FMMU; i++) {
		if (p[i] == 0xff) {
			continue; /* unused, or padding to a word */
		}
		sii->fmmu[sii->fmmu_count++] = p[i];
	}
}

static int parse_pdo(const uint8_t *p, size_t bytes, int is_tx, struct sii *sii)
{
	while (bytes >= PDO_HEADER_BYTES) {
		size_t entries = p[2];
		struct sii_pdo *pdo = &sii->pdo[sii->pdo_count];

		if (entries * PDO_ENTRY_BYTES > bytes - PDO_HEADER_BYTES ||
		    sii->pdo_count == SII_LIMIT_PDO ||
		    sii->entry_count + entries > SII_LIMIT_ENTRIES) {
			return -EBADMSG;
		}
		*pdo = (struct sii_pdo){ .index = get_le16(p),
					 .sm = p[3],
					 .is_tx = (uint8_t)is_tx,
					 .name = p[5],
					 .first_entry = (uint16_t)sii->entry_count,
					 .entry_count = (uint16_t)entries };
		sii->pdo_count++;
		p += PDO_HEADER_BYTES;
		bytes -= PDO_HEADER_BYTES;
		for (size_t i = 0; i < entries;
		     i++, p += PDO_ENTRY_BYTES, bytes -= PDO_ENTRY_BYTES) {
			sii->entry[sii->entry_count++] = (struct sii_entry){ .index = get_le16(p),
									     .subindex = p[2],
									     .name = p[3],
									     .data_type = p[4],
									     .bit_len = p[5] };
			pdo->bits += p[5];
		}
	}
	return 0;
}

static void parse_dc(const uint8_t *p, size_t bytes, struct sii *sii)
{
	for (; bytes >= DC_MODE_BYTES && sii->dc_mode_count < SII_LIMIT_DC_MODES;
	     bytes -= DC_MODE_BYTES, p += DC_MODE_BYTES) {
		sii->dc_mode[sii->dc_mode_count++] = (struct sii_dc_mode){
			.sync0_cycle_ns = get_le32(p),
			.sync0_shift_ns = (int32_t)get_le32(p + 4),
			.sync1_shift_ns = (int32_t)get_le32(p + 8),
			.sync1_factor = (int16_t)get_le16(p + 12),
			.assign_activate = get_le16(p + 14),
			.sync0_factor = (int16_t)get_le16(p + 16),
			.name = p[18],
		};
	}
}

static int parse_category(uint16_t type, const uint8_t *p, size_t bytes, struct sii *sii)
{
	switch (type) {
	case SII_CATEGORY_GENERAL:
		parse_general(p, bytes, sii);
		return 0;
	case SII_CATEGORY_FMMU:
		parse_fmmu(p, bytes, sii);
		return 0;
	case SII_CATEGORY_SM:
		parse_sm(p, bytes, sii);
		return 0;
	case SII_CATEGORY_TXPDO:
		return parse_pdo(p, bytes, 1, sii);
	case SII_CATEGORY_RXPDO:
		return parse_pdo(p, bytes, 0, sii);
	case SII_CATEGORY_DC:
		parse_dc(p, bytes, sii);
		return 0;
	default:
		return 0;
	}
}

static void parse_words(const uint8_t *image, struct sii *sii)
{
	sii->pdi_control = get_le16(image);
	sii->alias = get_le16(image + SII_ALIAS_BYTE);
	sii->vendor = get_le32(image + SII_VENDOR_BYTE);
	sii->product = get_le32(image + SII_PRODUCT_BYTE);
	sii->revision = get_le32(image + SII_REVISION_BYTE);
	sii->serial = get_le32(image + SII_SERIAL_BYTE);
	sii->boot_out_start = get_le16(image + 0x28);
	sii->boot_out_len = get_le16(image + 0x2a);
	sii->boot_in_start = get_le16(image + 0x2c);
	sii->boot_in_len = get_le16(image + 0x2e);
	sii->mailbox_out_start = get_le16(image + 0x30);
	sii->mailbox_out_len = get_le16(image + 0x32);
	sii->mailbox_in_start = get_le16(image + 0x34);
	sii->mailbox_in_len = get_le16(image + 0x36);
	sii->mailbox_protocols = get_le16(image + 0x38);
	sii->size_bytes = ((uint32_t)get_le16(image + SII_SIZE_BYTE) + 1) * KBIT_BYTES;
}

int sii_parse(const uint8_t *image, size_t image_bytes, struct sii *ret, char *error,
	      size_t error_bytes)
{
	size_t pos = SII_CATEGORIES_BYTE;
	uint16_t type = 0;
	size_t offset;
	size_t bytes;
	int r;

	memset(ret, 0, sizeof(*ret));
	if (image_bytes < SII_CATEGORIES_BYTE) {
		snprintf(error, error_bytes, "SII: %zu bytes, at least %d are needed", image_bytes,
			 SII_CATEGORIES_BYTE);
		return -EBADMSG;
	}
	parse_words(image, ret);
	if (ret->vendor == UINT32_MAX && ret->product == UINT32_MAX) {
		snprintf(error, error_bytes, "SII: blank (all bytes 0xff)");
		return -EBADMSG;
	}
	while ((r = next_category(image, image_bytes, &pos, &type, &offset, &bytes)) == 1) {
		if (parse_category(type, image + offset, bytes, ret) < 0) {
			snprintf(error, error_bytes,
				 "SII: category %u at byte 0x%zx: a PDO runs past its end", type,
				 offset - CATEGORY_HEADER_BYTES);
			return -EBADMSG;
		}
	}
	if (r < 0) {
		snprintf(error, error_bytes,
			 "SII: the category at byte 0x%zx runs past the end (%zu bytes)", pos,
			 image_bytes);
	}
	return r;
}
