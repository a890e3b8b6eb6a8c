/* SPDX-License-Identifier: MIT */
/*
 * The catalogue of simulated slaves against the EEPROM images of real devices: where there is a
 * real image of an entry, the one that is made from the entry says the same. Not compared, because
 * a user of the bus does not depend on it, and for size: texts of groups, images and device names
 * (real ones are partly German), names of gaps, PDO flags, the SyncUnit category, serial numbers,
 * vendors' own categories.
 */
#include "devices/catalogue.h"

#include "base/bytes.h"
#include "capture.h"
#include "harness/test.h"
#include "wire/sii.h"

enum { GENERAL_EBUS = 12, GENERAL_PORTS = 16, DC_RECORD = 24, DC_NUMBERS = 18 };

struct image {
	const uint8_t *at;
	size_t len;
	struct sii sii;
};

static void parse(struct image *image)
{
	char error[160];

	CHECK_EQ(sii_parse(image->at, image->len, &image->sii, error, sizeof(error)), 0);
}

static void check_text(const struct image *made, unsigned made_number, const struct image *real,
		       unsigned real_number)
{
	char made_text[SII_NAME_BYTES];
	char real_text[SII_NAME_BYTES];

	sii_text(made->at, made->len, made_number, made_text);
	sii_text(real->at, real->len, real_number, real_text);
	CHECK_STR(made_text, real_text);
}

static void check_words(const struct image *made, const struct image *real)
{
	/* PDI, ESC configuration, pulse, alias, checksum; identity; mailboxes. */
	CHECK_MEM(made->at, real->at, 16);
	CHECK_EQ(made->sii.vendor, real->sii.vendor);
	CHECK_EQ(made->sii.product, real->sii.product);
	CHECK_EQ(made->sii.revision, real->sii.revision);
	CHECK_MEM(made->at + 0x28, real->at + 0x28, 18);
	CHECK_EQ(made->sii.size_bytes, real->sii.size_bytes);
	CHECK_EQ(made->sii.coe_details, real->sii.coe_details);
	check_text(made, made->sii.order_name, real, real->sii.order_name);
}

static void check_general(const struct image *made, const struct image *real)
{
	size_t offset[2];
	size_t bytes;

	CHECK_EQ(sii_find_category(made->at, made->len, SII_CATEGORY_GENERAL, &offset[0], &bytes),
		 0);
	CHECK_EQ(sii_find_category(real->at, real->len, SII_CATEGORY_GENERAL, &offset[1], &bytes),
		 0);
	CHECK_EQ(get_le16(made->at + offset[0] + GENERAL_EBUS),
		 get_le16(real->at + offset[1] + GENERAL_EBUS));
	CHECK_EQ(get_le16(made->at + offset[0] + GENERAL_PORTS),
		 get_le16(real->at + offset[1] + GENERAL_PORTS));
}

static void check_sms(const struct sii *made, const struct sii *real)
{
	CHECK_EQ(made->sm_count, real->sm_count);
	for (size_t i = 0; i < made->sm_count; i++) {
		CHECK_EQ(made->sm[i].start, real->sm[i].start);
		CHECK_EQ(made->sm[i].len, real->sm[i].len);
		CHECK_EQ(made->sm[i].control, real->sm[i].control);
		CHECK_EQ(made->sm[i].enable, real->sm[i].enable);
		CHECK_EQ(made->sm[i].type, real->sm[i].type);
	}
}

static void check_channels(const struct sii *made, const struct sii *real)
{
	CHECK_EQ(made->fmmu_count, real->fmmu_count);
	CHECK_MEM(made->fmmu, real->fmmu, sizeof(made->fmmu));
	check_sms(made, real);
}

static void check_entry(const struct image *made, const struct image *real, size_t n)
{
	const struct sii_entry *m = &made->sii.entry[n];
	const struct sii_entry *r = &real->sii.entry[n];

	CHECK_EQ(m->index, r->index);
	CHECK_EQ(m->subindex, r->subindex);
	CHECK_EQ(m->bit_len, r->bit_len);
	if (m->index != 0) {
		CHECK_EQ(m->data_type, r->data_type);
		check_text(made, m->name, real, r->name);
	}
}

static void check_pdos(const struct image *made, const struct image *real)
{
	CHECK_EQ(made->sii.pdo_count, real->sii.pdo_count);
	CHECK_EQ(made->sii.entry_count, real->sii.entry_count);
	for (size_t i = 0; i < made->sii.pdo_count; i++) {
		const struct sii_pdo *m = &made->sii.pdo[i];
		const struct sii_pdo *r = &real->sii.pdo[i];

		CHECK_EQ(m->index, r->index);
		CHECK_EQ(m->sm, r->sm);
		CHECK_EQ(m->is_tx, r->is_tx);
		CHECK_EQ(m->entry_count, r->entry_count);
		check_text(made, m->name, real, r->name);
	}
	for (size_t n = 0; n < made->sii.entry_count; n++) {
		check_entry(made, real, n);
	}
}

static void check_dc(const struct image *made, const struct image *real)
{
	size_t offset[2] = { 0, 0 };
	size_t bytes[2] = { 0, 0 };

	CHECK_EQ(made->sii.dc_mode_count, real->sii.dc_mode_count);
	(void)sii_find_category(made->at, made->len, SII_CATEGORY_DC, &offset[0], &bytes[0]);
	(void)sii_find_category(real->at, real->len, SII_CATEGORY_DC, &offset[1], &bytes[1]);
	CHECK_EQ(bytes[0], bytes[1]);
	for (size_t i = 0; i + DC_RECORD <= bytes[0]; i += DC_RECORD) {
		const uint8_t *m = made->at + offset[0] + i;
		const uint8_t *r = real->at + offset[1] + i;

		CHECK_MEM(m, r, DC_NUMBERS);
		check_text(made, m[DC_NUMBERS], real, r[DC_NUMBERS]);
	}
}

static void check_entry_against(const char *name, const char *file)
{
	static uint8_t bytes[MODEL_SII_BYTES];
	static struct slave_model model;
	static struct image made;
	static struct image real;
	struct bytes image = capture_load(file);

	CHECK_EQ(catalogue_find(name, &model), 0);
	made = (struct image){ .at = bytes, .len = slave_model_sii(&model, bytes) };
	real = (struct image){ .at = image.at, .len = image.len };
	parse(&made);
	parse(&real);
	printf("  %s against %s\n", name, file);
	check_words(&made, &real);
	check_general(&made, &real);
	check_channels(&made.sii, &real.sii);
	check_pdos(&made, &real);
	check_dc(&made, &real);
	capture_free(&image);
}

TEST(catalogue_images, couplers_and_digital_terminals_are_as_the_real_ones)
{
	check_entry_against("ek1100", "sii/ek1100.bin");
	check_entry_against("el1008", "sii/el1008.bin");
	check_entry_against("el2004", "sii/el2004.bin");
	check_entry_against("el2828", "sii/el2828.bin");
	check_entry_against("el2889", "sii/el2889.bin");
}

TEST(catalogue_images, terminals_with_a_mailbox_are_as_the_real_ones)
{
	check_entry_against("el2521", "sii/el2521-0000.bin");
	check_entry_against("el3204", "sii/el3204.bin");
	check_entry_against("el4002", "sii/el4002.bin");
}

TEST(catalogue_images, the_drive_is_as_the_real_one)
{
	check_entry_against("akd", "sii/akd.bin");
}

/* Of these there are only captures: identity, mailbox and channels as far as a master read them. */
static void check_entry_against_capture(const char *name, const char *file, uint16_t station,
					uint16_t position)
{
	static struct slave_model model;
	static struct image real;
	struct bytes capture = capture_load(file);
	struct bytes image = capture_learn_sii(&capture, station, position);
	char error[160];

	CHECK_EQ(catalogue_find(name, &model), 0);
	real = (struct image){ .at = image.at, .len = image.len };
	(void)sii_parse(real.at, real.len, &real.sii, error, sizeof(error));
	printf("  %s against %s\n", name, file);
	CHECK_EQ(model.sii.vendor, real.sii.vendor);
	CHECK_EQ(model.sii.product, real.sii.product);
	CHECK_EQ(model.sii.revision, real.sii.revision);
	CHECK_EQ(model.sii.mailbox_out_start, real.sii.mailbox_out_start);
	CHECK_EQ(model.sii.mailbox_out_len, real.sii.mailbox_out_len);
	CHECK_EQ(model.sii.mailbox_protocols, real.sii.mailbox_protocols);
	CHECK_EQ(model.sii.coe_details, real.sii.coe_details);
	CHECK(real.sii.sm_count > 0);
	check_sms(&model.sii, &real.sii);
	CHECK(real.sii.fmmu_count > 0);
	for (size_t i = 0; i < real.sii.fmmu_count; i++) {
		CHECK(real.sii.fmmu[i] == 0 || real.sii.fmmu[i] == model.sii.fmmu[i]);
	}
	capture_free(&image);
	capture_free(&capture);
}

TEST(catalogue_images, slaves_that_are_only_captured_are_as_their_masters_read_them)
{
	check_entry_against_capture("el1004", "captures/soem-ek1100-el1004.pcapng", 0x1002, 1);
	check_entry_against_capture("lan9252_evb", "captures/soem-single-lan9252.pcapng", 0x1001,
				    0);
	check_entry_against_capture("ek1914", "captures/ethercrab-ek1914-no-complete-access.pcapng",
				    0x1000, 0);
	check_entry_against_capture("el3004", "captures/ethercrab-ek1914-no-complete-access.pcapng",
				    0x1001, 1);
	check_entry_against_capture("el6910", "captures/ethercrab-el6910-mailbox.pcapng", 0x1001,
				    1);
}
