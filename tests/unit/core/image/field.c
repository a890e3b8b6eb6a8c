/* SPDX-License-Identifier: MIT */
/* Fields of every length at every bit, against a reference that goes bit by bit. */
#include "image/field.h"

#include <stdlib.h>
#include <string.h>

#include "base/prng.h"
#include "harness/test.h"

enum { ROUNDS = 16 };

static int bit_at(const uint8_t *image, uint32_t bit)
{
	return image[bit / 8] >> (bit % 8) & 1;
}

static uint64_t slow_get(const uint8_t *image, const struct channel *ch)
{
	uint64_t raw = 0;

	for (unsigned i = 0; i < ch->bit_len; i++) {
		raw |= (uint64_t)bit_at(image, ch->bit_offset + i) << i;
	}
	return raw;
}

static void slow_set(uint8_t *image, const struct channel *ch, uint64_t raw)
{
	for (unsigned i = 0; i < ch->bit_len; i++) {
		uint32_t bit = ch->bit_offset + i;

		image[bit / 8] = (uint8_t)(image[bit / 8] & ~(1u << bit % 8));
		image[bit / 8] = (uint8_t)(image[bit / 8] | (raw >> i & 1) << bit % 8);
	}
}

static uint64_t some_value(struct prng *prng, int round)
{
	return round == 0 ? 0 : round == 1 ? UINT64_MAX : prng_next(prng);
}

/* An image that ends where the field ends: a sanitizer sees what is touched behind it. */
static void check_field(struct prng *prng, const struct channel *ch)
{
	struct image_field f = image_field_of(ch);
	size_t bytes = (ch->bit_offset + ch->bit_len + 7) / 8;
	uint8_t *image = malloc(bytes);
	uint8_t *wanted = malloc(bytes);

	CHECK(image != NULL && wanted != NULL);
	for (int round = 0; round < ROUNDS; round++) {
		uint64_t raw = some_value(prng, (round + 2) % ROUNDS);

		for (size_t i = 0; i < bytes; i++) {
			image[i] = (uint8_t)some_value(prng, round);
		}
		memcpy(wanted, image, bytes);
		CHECK(image_field_get(image, f) == slow_get(image, ch));
		slow_set(wanted, ch, raw);
		image_field_set(image, f, raw);
		CHECK(memcmp(image, wanted, bytes) == 0);
		CHECK(image_field_get(image, f) == slow_get(wanted, ch));
	}
	free(image);
	free(wanted);
}

TEST(field, all_lengths_at_all_bits_are_as_the_reference_has_them)
{
	struct prng prng = { 7 };

	for (unsigned bit_len = 1; bit_len <= 64; bit_len++) {
		for (uint32_t bit_offset = 0; bit_offset < 24; bit_offset++) {
			check_field(&prng, &(struct channel){ .bit_offset = bit_offset,
							      .bit_len = (uint8_t)bit_len });
		}
	}
}

TEST(field, only_whole_octets_of_a_power_of_two_are_one_load)
{
	unsigned whole = 0;

	for (unsigned bit_len = 1; bit_len <= 64; bit_len++) {
		for (uint32_t bit_offset = 0; bit_offset < 16; bit_offset++) {
			struct image_field f = image_field_of(&(struct channel){
				.bit_offset = bit_offset, .bit_len = (uint8_t)bit_len });

			CHECK(f.whole == 0 || (f.whole * 8u == bit_len && bit_offset % 8 == 0));
			whole += f.whole != 0;
		}
	}
	CHECK_EQ(whole, 2 * 4); /* 8, 16, 32, 64 bits, at two of the offsets */
}
