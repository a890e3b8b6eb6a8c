/* SPDX-License-Identifier: MIT */
#include "image/field.h"

#include "base/bytes.h"

enum { WORD_OCTETS = 8 };

/* Octets that the field touches: 1 to 9. */
static unsigned octets_of(struct image_field f)
{
	return (f.shift + f.bit_len + 7u) / 8;
}

static uint64_t mask_of(struct image_field f)
{
	return UINT64_MAX >> (64 - f.bit_len);
}

uint64_t image_bits_get(const uint8_t *image, struct image_field f)
{
	const uint8_t *p = image + f.byte;
	unsigned octets = octets_of(f);

	if (octets <= WORD_OCTETS) {
		return get_le(p, octets) >> f.shift & mask_of(f);
	}
	return (get_le64(p) >> f.shift | (uint64_t)p[WORD_OCTETS] << (64 - f.shift)) & mask_of(f);
}

void image_bits_set(uint8_t *image, struct image_field f, uint64_t raw)
{
	uint8_t *p = image + f.byte;
	unsigned octets = octets_of(f);
	uint64_t mask = mask_of(f);
	unsigned in_word = octets < WORD_OCTETS ? octets : WORD_OCTETS;

	raw &= mask;
	if (octets == 1) {
		*p = (uint8_t)((*p & ~(mask << f.shift)) | raw << f.shift);
		return;
	}
	put_le(p, in_word, (get_le(p, in_word) & ~(mask << f.shift)) | raw << f.shift);
	if (octets > WORD_OCTETS) {
		unsigned high = 64u - f.shift; /* bits of the field in the word before */

		p[WORD_OCTETS] = (uint8_t)((p[WORD_OCTETS] & ~(mask >> high)) | raw >> high);
	}
}
