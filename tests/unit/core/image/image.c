/* SPDX-License-Identifier: MIT */
#include "image/image.h"

#include <errno.h>
#include <math.h>

#include "base/prng.h"
#include "harness/test.h"

static struct channel make(enum channel_type type, uint32_t bit_offset, unsigned bit_len)
{
	return (struct channel){
		.type = (uint8_t)type,
		.bit_offset = bit_offset,
		.bit_len = (uint8_t)bit_len,
		.scale = 1.0,
	};
}

TEST(image, what_is_set_is_got_and_no_other_bit_moves)
{
	struct prng prng = { 1 };

	for (int round = 0; round < 20000; round++) {
		unsigned bit_len = 1 + (unsigned)prng_below(&prng, 64);
		struct channel ch =
			make(CHANNEL_UINT, (uint32_t)prng_below(&prng, 128 - bit_len + 1), bit_len);
		uint64_t mask = bit_len == 64 ? UINT64_MAX : (UINT64_C(1) << bit_len) - 1;
		uint64_t raw = prng_next(&prng);
		uint8_t before[16];
		uint8_t after[16];

		for (unsigned i = 0; i < sizeof(before); i++) {
			before[i] = (uint8_t)prng_next(&prng);
		}
		memcpy(after, before, sizeof(after));
		CHECK(image_channel_fits(&ch, sizeof(after)));
		image_set_raw(after, &ch, raw);
		CHECK(image_get_raw(after, &ch) == (raw & mask));
		for (unsigned bit = 0; bit < 128; bit++) {
			if (bit < ch.bit_offset || bit >= ch.bit_offset + bit_len) {
				CHECK_EQ(after[bit / 8] >> (bit % 8) & 1,
					 before[bit / 8] >> (bit % 8) & 1);
			}
		}
	}
}

TEST(image, a_channel_outside_the_image_does_not_fit)
{
	struct channel ch = make(CHANNEL_UINT, 120, 16);

	CHECK(!image_channel_fits(&ch, 16));
	CHECK(image_channel_fits(&ch, 17));
	ch = make(CHANNEL_UINT, UINT32_MAX, 64);
	CHECK(!image_channel_fits(&ch, 17));
	ch = make(CHANNEL_FLOAT, 0, 16);
	CHECK(!image_channel_fits(&ch, 16));
	ch = make(CHANNEL_BOOL, 0, 2);
	CHECK(!image_channel_fits(&ch, 16));
	ch = make(CHANNEL_UINT, 0, 0);
	CHECK(!image_channel_fits(&ch, 16));
}

TEST(image, signed_values_keep_their_sign)
{
	struct channel ch = make(CHANNEL_INT, 3, 5);
	uint8_t image[2] = { 0, 0 };
	uint64_t raw = 99;
	char text[32];

	CHECK_EQ(image_physical_to_raw(&ch, -16, &raw), 0);
	image_set_raw(image, &ch, raw);
	CHECK(image_get_physical(image, &ch) == -16.0);
	image_raw_format(&ch, raw, text, sizeof(text));
	CHECK_STR(text, "-16");
	raw = 99;
	CHECK_EQ(image_physical_to_raw(&ch, -17, &raw), -ERANGE);
	CHECK_EQ(image_physical_to_raw(&ch, 16, &raw), -ERANGE);
	CHECK_EQ(image_physical_to_raw(&ch, (double)NAN, &raw), -EINVAL);
	CHECK_EQ(raw, 99);
	CHECK_EQ(image_raw_parse(&ch, "-16", &raw), 0);
	CHECK_EQ(raw, 0x10);
	CHECK_EQ(image_raw_parse(&ch, "-17", &raw), -ERANGE);
	CHECK_EQ(image_raw_parse(&ch, "16", &raw), -ERANGE);
}

TEST(image, a_64_bit_time_is_exact_as_text)
{
	struct channel ch = make(CHANNEL_UINT, 0, 64);
	uint64_t raw = 0;
	char text[32];

	CHECK_EQ(image_raw_parse(&ch, "18446744073709551615", &raw), 0);
	CHECK(raw == UINT64_MAX);
	image_raw_format(&ch, raw, text, sizeof(text));
	CHECK_STR(text, "18446744073709551615");
	CHECK_EQ(image_raw_parse(&ch, "18446744073709551616", &raw), -ERANGE);
	CHECK_EQ(image_raw_parse(&ch, "0x10", &raw), 0);
	CHECK_EQ(raw, 16);
	raw = 5;
	CHECK_EQ(image_raw_parse(&ch, "", &raw), -EINVAL);
	CHECK_EQ(image_raw_parse(&ch, "1x", &raw), -EINVAL);
	CHECK_EQ(image_raw_parse(&ch, "--1", &raw), -EINVAL);
	CHECK_EQ(image_raw_parse(&ch, "-1", &raw), -ERANGE);
	CHECK_EQ(raw, 5);
}

TEST(image, a_bool_takes_the_words_people_write)
{
	struct channel ch = make(CHANNEL_BOOL, 0, 1);
	uint64_t raw = 9;

	CHECK_EQ(image_raw_parse(&ch, "on", &raw), 0);
	CHECK_EQ(raw, 1);
	CHECK_EQ(image_raw_parse(&ch, "False", &raw), 0);
	CHECK_EQ(raw, 0);
	CHECK_EQ(image_raw_parse(&ch, "2", &raw), -EINVAL);
	CHECK_EQ(image_raw_parse(&ch, "0.4", &raw), -EINVAL);
}

TEST(image, a_bool_is_0_or_1_and_neither_rounded_nor_limited)
{
	const double wrong[] = { 0.4, 0.5, 0.6, 0.001, 0.999, 2, -1, -0.4, INFINITY, (double)NAN };
	struct channel ch = make(CHANNEL_BOOL, 0, 1);
	uint64_t raw = 9;

	for (size_t i = 0; i < sizeof(wrong) / sizeof(wrong[0]); i++) {
		CHECK_EQ(image_physical_to_raw(&ch, wrong[i], &raw), -EINVAL);
	}
	CHECK_EQ(raw, 9);
	CHECK_EQ(image_physical_to_raw(&ch, 1, &raw), 0);
	CHECK_EQ(raw, 1);
	CHECK_EQ(image_physical_to_raw(&ch, 0, &raw), 0);
	CHECK_EQ(raw, 0);
	ch.scale = 0.2; /* (0.3 - 0.1) / 0.2 is a little less than 1 in doubles */
	ch.offset = 0.1;
	CHECK_EQ(image_physical_to_raw(&ch, 0.3, &raw), 0);
	CHECK_EQ(raw, 1);
}

TEST(image, a_scaled_value_goes_there_and_back)
{
	struct channel ch = make(CHANNEL_UINT, 0, 12);
	uint64_t raw = 0;

	ch.scale = 3.3 / 4095;
	CHECK_EQ(image_physical_to_raw(&ch, 1.65, &raw), 0);
	CHECK_EQ(raw, 2048);
	CHECK(fabs(image_raw_to_physical(&ch, raw) - 1.65) < ch.scale);
	CHECK_EQ(image_physical_to_raw(&ch, 3.31, &raw), -ERANGE);
}
