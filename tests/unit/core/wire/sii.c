/* SPDX-License-Identifier: MIT */
#include "wire/sii.h"

#include <errno.h>

#include "base/bytes.h"
#include "harness/test.h"

enum { IMAGE_BYTES = 512 };

/* An image of one's own, category by category. */
struct image {
	uint8_t bytes[IMAGE_BYTES];
	size_t len;
};

static struct image begin(void)
{
	struct image im = { .len = SII_CATEGORIES_BYTE };

	memset(im.bytes, 0xff, sizeof(im.bytes));
	memset(im.bytes, 0, SII_CATEGORIES_BYTE);
	put_le32(im.bytes + 0x10, 0x1234);
	put_le32(im.bytes + 0x14, 0x5678);
	return im;
}

static void add(struct image *im, uint16_t type, const uint8_t *body, size_t words)
{
	put_le16(im->bytes + im->len, type);
	put_le16(im->bytes + im->len + 2, (uint16_t)words);
	memcpy(im->bytes + im->len + 4, body, 2 * words);
	im->len += 4 + 2 * words;
}

static int parse(const struct image *im, size_t len, struct sii *ret)
{
	char error[160] = "";
	int r = sii_parse(im->bytes, len, ret, error, sizeof(error));

	CHECK((r < 0) == (error[0] != '\0'));
	CHECK(strchr(error, '\n') == NULL);
	return r;
}

static struct image small_slave(void)
{
	static const uint8_t strings[] = { 2, 3, 'O', 'n', 'e', 4, 'T', '\x01', 'w', 'o' };
	static const uint8_t general[32] = { [2] = 1, [3] = 2, [5] = 0x21 };
	static const uint8_t fmmu[] = { 1, 2, 3, 0xff };
	static const uint8_t sm[] = { 0x00, 0x11, 2, 0, 0x64, 0, 1, 3,
				      0x80, 0x11, 4, 0, 0x20, 0, 1, 4 };
	static const uint8_t tx[] = { 0x00, 0x1a, 2, 1, 0,    0,    0, 0, 0x00, 0x60, 1, 0,
				      6,    12,   0, 0, 0x00, 0x00, 0, 0, 0,    4,    0, 0 };
	static const uint8_t rx[] = { 0x00, 0x16, 1, 0, 0, 0, 0, 0, 0x00, 0x70, 1, 0, 6, 16, 0, 0 };
	struct image im = begin();

	add(&im, SII_CATEGORY_STRINGS, strings, sizeof(strings) / 2);
	add(&im, SII_CATEGORY_GENERAL, general, sizeof(general) / 2);
	add(&im, SII_CATEGORY_FMMU, fmmu, sizeof(fmmu) / 2);
	add(&im, SII_CATEGORY_SM, sm, sizeof(sm) / 2);
	add(&im, SII_CATEGORY_TXPDO, tx, sizeof(tx) / 2);
	add(&im, SII_CATEGORY_RXPDO, rx, sizeof(rx) / 2);
	return im;
}

TEST(sii, a_small_slave_is_read_whole)
{
	struct image im = small_slave();
	char text[SII_NAME_BYTES];
	struct sii sii;

	CHECK_EQ(parse(&im, im.len + 2, &sii), 0);
	CHECK_EQ(sii.vendor, 0x1234);
	CHECK_EQ(sii.product, 0x5678);
	CHECK_EQ(sii.coe_details, 0x21);
	CHECK_EQ(sii.fmmu_count, 3);
	CHECK_EQ(sii.sm_count, 2);
	CHECK_EQ(sii.sm[1].start, 0x1180);
	CHECK_EQ(sii.sm[1].type, 4);
	CHECK_EQ(sii.pdo_count, 2);
	CHECK_EQ(sii.pdo[0].is_tx, 1);
	CHECK_EQ(sii.pdo[0].bits, 16);
	CHECK_EQ(sii.pdo[1].bits, 16);
	CHECK_EQ(sii.entry[1].index, 0);
	sii_text(im.bytes, im.len + 2, sii.order_name, text);
	CHECK_STR(text, "One");
	sii_text(im.bytes, im.len + 2, sii.device_name, text);
	CHECK_STR(text, "T_wo");
	sii_text(im.bytes, im.len + 2, 3, text);
	CHECK_STR(text, "");
	sii_text(im.bytes, im.len + 2, 0, text);
	CHECK_STR(text, "");
}

TEST(sii, an_image_cut_anywhere_is_refused_with_a_reason_or_read)
{
	struct image im = small_slave();
	struct sii sii;

	for (size_t len = 0; len <= im.len + 2; len++) {
		CHECK_EQ(parse(&im, len, &sii), len == im.len + 2 ? 0 : -EBADMSG);
		CHECK(sii.sm_count <= 2 && sii.pdo_count <= 2);
	}
}

TEST(sii, a_blank_eeprom_is_reported_as_blank)
{
	struct image im;
	char error[160];
	struct sii sii;

	memset(im.bytes, 0xff, sizeof(im.bytes));
	CHECK_EQ(sii_parse(im.bytes, sizeof(im.bytes), &sii, error, sizeof(error)), -EBADMSG);
	CHECK(strstr(error, "blank") != NULL);
}

TEST(sii, categories_without_end_end_at_the_images_end)
{
	struct image im = begin();
	struct sii sii;
	size_t offset = 77;
	size_t bytes = 77;

	/* Zeros are empty categories of type 0: the walk must continue, and end. */
	memset(im.bytes + SII_CATEGORIES_BYTE, 0, IMAGE_BYTES - SII_CATEGORIES_BYTE);
	CHECK_EQ(parse(&im, IMAGE_BYTES, &sii), -EBADMSG);
	CHECK_EQ(sii_find_category(im.bytes, IMAGE_BYTES, SII_CATEGORY_SM, &offset, &bytes),
		 -EBADMSG);
	CHECK_EQ(offset, 77);
}

TEST(sii, a_category_past_the_end_keeps_what_precedes_it)
{
	struct image im = small_slave();
	struct sii sii;

	put_le16(im.bytes + im.len, SII_CATEGORY_DC);
	put_le16(im.bytes + im.len + 2, 0x7fff);
	CHECK_EQ(parse(&im, IMAGE_BYTES, &sii), -EBADMSG);
	CHECK_EQ(sii.sm_count, 2);
	CHECK_EQ(sii.pdo_count, 2);
}

TEST(sii, a_pdo_with_more_entries_than_its_category_holds_is_refused)
{
	static const uint8_t tx[8] = { 0x00, 0x1a, 200, 1 };
	struct image im = begin();
	struct sii sii;

	add(&im, SII_CATEGORY_TXPDO, tx, sizeof(tx) / 2);
	CHECK_EQ(parse(&im, IMAGE_BYTES, &sii), -EBADMSG);
	CHECK_EQ(sii.entry_count, 0);
}

TEST(sii, a_string_that_runs_past_its_category_is_empty)
{
	static const uint8_t strings[] = { 2, 1, 'a', 200 };
	struct image im = begin();
	char text[SII_NAME_BYTES];

	add(&im, SII_CATEGORY_STRINGS, strings, sizeof(strings) / 2);
	sii_text(im.bytes, IMAGE_BYTES, 1, text);
	CHECK_STR(text, "a");
	sii_text(im.bytes, IMAGE_BYTES, 2, text);
	CHECK_STR(text, "");
}

TEST(sii, the_checksum_is_that_of_the_data_sheets_polynomial)
{
	/* Configuration words of real devices and the byte that follows them there. */
	static const struct {
		uint8_t words[14];
		uint8_t crc;
	} real[] = {
		{ { 0x00, 0x0d }, 0x46 },
		{ { 0x04, 0x01, 0, 0, 0, 0, 0xff }, 0xe2 },
		{ { 0x05, 0x0e, 0x03, 0x06, 0x10, 0x27 }, 0xd7 },
		{ { 0x80, 0x02 }, 0xc6 },
	};

	for (size_t i = 0; i < sizeof(real) / sizeof(real[0]); i++) {
		CHECK_EQ(sii_checksum(real[i].words), real[i].crc);
	}
}
