/* SPDX-License-Identifier: MIT */
/*
 * Where a channel is in the process image, and the one way to its bits: cycle, recorder, DDS and
 * CLI read and write through these. A field of whole octets is one load or store, any other one is
 * one word, shifted and masked. The image has no alignment (base/bytes.h). The field must lie
 * inside the image (image_channel_fits()); no byte outside it is touched. Context: any, RT-safe.
 */
#ifndef IMAGE_FIELD_H
#define IMAGE_FIELD_H

#include <assert.h>
#include <stdint.h>

#include "base/bytes.h"
#include "base/sample.h"

struct image_field {
	uint32_t byte;   /* its first */
	uint8_t shift;   /* its lowest bit in that */
	uint8_t bit_len; /* 1 to 64 */
	uint8_t whole;   /* 1, 2, 4, 8: it is these octets; 0: neither whole ones nor so many */
};

static inline struct image_field image_field_of(const struct channel *ch)
{
	struct image_field f = { .byte = ch->bit_offset / 8,
				 .shift = ch->bit_offset % 8,
				 .bit_len = ch->bit_len };
	unsigned octets = ch->bit_len / 8;

	assert(ch->bit_len >= 1 && ch->bit_len <= 64);
	if (f.shift == 0 && ch->bit_len % 8 == 0 && (octets & (octets - 1)) == 0) {
		f.whole = (uint8_t)octets;
	}
	return f;
}

/** The same, for fields that are not whole octets. */
uint64_t image_bits_get(const uint8_t *image, struct image_field f);
void image_bits_set(uint8_t *image, struct image_field f, uint64_t raw);

/** The field's bits, zero-extended to 64. */
static inline uint64_t image_field_get(const uint8_t *image, struct image_field f)
{
	const uint8_t *p = image + f.byte;

	if (f.whole == 2) {
		return get_le16(p);
	}
	switch (f.whole) {
	case 1:
		return *p;
	case 4:
		return get_le32(p);
	case 8:
		return get_le64(p);
	default:
		return image_bits_get(image, f);
	}
}

/** Write them; bits of @raw above the field's are ignored. */
static inline void image_field_set(uint8_t *image, struct image_field f, uint64_t raw)
{
	uint8_t *p = image + f.byte;

	switch (f.whole) {
	case 1:
		*p = (uint8_t)raw;
		break;
	case 2:
		put_le16(p, (uint16_t)raw);
		break;
	case 4:
		put_le32(p, (uint32_t)raw);
		break;
	case 8:
		put_le64(p, raw);
		break;
	default:
		image_bits_set(image, f, raw);
		break;
	}
}

#endif
