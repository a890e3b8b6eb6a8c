/* SPDX-License-Identifier: MIT */
/* The catalogue of slaves: its entries, the text they are written in, the images made from them. */
#include "devices/catalogue.h"

#include <errno.h>

#include "devices/cia402.h"
#include "harness/test.h"
#include "wire/sii.h"

static struct slave_model model;
static char error[160];

#define HEAD "name \"n\"\nidentity 2 3 4\nesc et1200\nports ebus ebus none none\n"

static void refused(const char *text, const char *wanted)
{
	error[0] = '\0';
	CHECK_EQ(slave_model_parse("t", text, &model, error, sizeof(error)), -EBADMSG);
	CHECK_STR(error, wanted);
}

static void parse(const char *text)
{
	error[0] = '\0';
	if (slave_model_parse("t", text, &model, error, sizeof(error)) < 0) {
		test_fail(__FILE__, __LINE__, "%s", error);
	}
}

static void check_same_process_data(const struct sii *made, const struct sii *wanted)
{
	CHECK_EQ(made->sm_count, wanted->sm_count);
	CHECK_MEM(made->sm, wanted->sm, sizeof(made->sm));
	CHECK_EQ(made->pdo_count, wanted->pdo_count);
	CHECK_EQ(made->entry_count, wanted->entry_count);
	for (size_t i = 0; i < made->pdo_count; i++) {
		CHECK_EQ(made->pdo[i].index, wanted->pdo[i].index);
		CHECK_EQ(made->pdo[i].sm, wanted->pdo[i].sm);
		CHECK_EQ(made->pdo[i].is_tx, wanted->pdo[i].is_tx);
		CHECK_EQ(made->pdo[i].name, wanted->pdo[i].name);
		CHECK_EQ(made->pdo[i].bits, wanted->pdo[i].bits);
		CHECK_EQ(made->pdo[i].first_entry, wanted->pdo[i].first_entry);
	}
	CHECK_MEM(made->entry, wanted->entry, made->entry_count * sizeof(made->entry[0]));
}

TEST(catalogue, the_image_of_each_entry_says_what_the_entry_says)
{
	static uint8_t image[MODEL_SII_BYTES];
	static struct sii made;
	char name[SII_NAME_BYTES];

	CHECK(catalogue_count() >= 20);
	for (size_t i = 0; i < catalogue_count(); i++) {
		size_t len;

		catalogue_read(i, &model);
		len = slave_model_sii(&model, image);
		CHECK_EQ(sii_parse(image, len, &made, error, sizeof(error)), 0);
		CHECK_EQ(sii_checksum(image), image[14]);
		CHECK(len <= made.size_bytes);
		CHECK_EQ(made.size_bytes, model.sii.size_bytes);
		CHECK_EQ(made.pdi_control, model.sii.pdi_control);
		CHECK_EQ(made.vendor, model.sii.vendor);
		CHECK_EQ(made.product, model.sii.product);
		CHECK_EQ(made.revision, model.sii.revision);
		CHECK_EQ(made.mailbox_out_start, model.sii.mailbox_out_start);
		CHECK_EQ(made.mailbox_in_len, model.sii.mailbox_in_len);
		CHECK_EQ(made.mailbox_protocols, model.sii.mailbox_protocols);
		CHECK_EQ(made.coe_details, model.sii.coe_details);
		CHECK_EQ(made.dc_mode_count, model.dc_count);
		check_same_process_data(&made, &model.sii);
		sii_text(image, len, made.device_name, name);
		CHECK_STR(name, model.text[model.sii.device_name - 1]);
	}
}

TEST(catalogue, entries_are_found_by_name_and_wrong_names_get_near_ones)
{
	char near[64];

	CHECK_EQ(catalogue_find("el2828", &model), 0);
	CHECK_EQ(model.sii.product, 0x0b0c3052);
	CHECK_EQ(model.sii.pdo_count, 8);
	CHECK_EQ(catalogue_find("el282", &model), -ENOENT);
	catalogue_near("el282", near, sizeof(near));
	CHECK_STR(near, "el2828");
	catalogue_near("el3103", near, sizeof(near));
	CHECK_STR(near, "el3102, el3104");
	catalogue_near("something", near, sizeof(near));
	CHECK_STR(near, "");
}

TEST(catalogue, esc_features_come_from_the_entry_with_that_identity)
{
	const struct esc_features *terminal = catalogue_features(2, 0x0c203052); /* EL3104 */

	CHECK_EQ(terminal->type, 0x12);
	CHECK_EQ(terminal->features, 0x01fc);
	CHECK_EQ(terminal->port_descriptor, 0x4a);
	CHECK_EQ(catalogue_features(0x6a, 0x00414b44)->type, 0x04); /* AKD */
	CHECK(catalogue_features(2, 0x12345678) == &esc_et1100);
}

TEST(catalogue, channels_repeat_with_their_numbers_and_names)
{
	parse(HEAD "sm 0x1000 4 0 1 inputs\n"
		   "repeat 2 # of two\n"
		   "txpdo 0x1a00+2 0 \"Channel %\"\n"
		   "entry 0x6000+0x10:0x11 int \"Value\" signal -10 10 0x7fff\n"
		   "end\n");
	CHECK_EQ(model.sii.pdo_count, 2);
	CHECK_EQ(model.sii.pdo[1].index, 0x1a02);
	CHECK_STR(model.text[model.sii.pdo[1].name - 1], "Channel 2");
	CHECK_EQ(model.sii.entry[1].index, 0x6010);
	CHECK_EQ(model.sii.entry[1].bit_len, 16);
	CHECK_EQ(model.sii.entry[0].name, model.sii.entry[1].name);
	CHECK_EQ(model.input[1].channel, 1);
	CHECK_EQ(model.input[1].counts, 0x7fff);
}

TEST(catalogue, a_wrong_line_is_named_with_what_is_wrong_in_it)
{
	refused("", "t.txt:1: identity is missing");
	refused("identity 1 2 3\n\n", "t.txt:3: name is missing");
	refused("name \"n\"\nidentity 1 2\n", "t.txt:2: revision is missing");
	refused("name \"n\"\nidentity 1 2 x\n",
		"t.txt:2: revision: 'x' is not a number from 0 to 4294967295");
	refused("colour red\n", "t.txt:1: unknown key 'colour'");
	refused("name n\n", "t.txt:1: a text in \"...\" is missing");
	refused("name \"n\n\"\n", "t.txt:1: a text ends in its line, and is of ASCII");
	refused("name \"n\" m\n", "t.txt:1: unexpected text at the end of the line");
	refused("esc et1300\n", "t.txt:1: unknown ESC 'et1300'");
	refused("ports mii mii none none\n", "t.txt:1: \"esc\" comes before \"ports\"");
	refused("esc et1100\nports mii usb none none\n", "t.txt:2: unknown word 'usb'");
	refused("sm 0x10000 1 0 1 inputs\n",
		"t.txt:1: start: '0x10000' is not a number from 0 to 65535");
	refused("mailbox 0x1000 128 0x1080 128 coe xoe\n", "t.txt:1: unknown word 'xoe'");
	refused("unit 0xfd260000\n", "t.txt:1: a unit comes after the entry that it belongs to");
	refused("0123456789012345678901234567890123456789012345678901234567890123\n",
		"t.txt:1: a word has more than 63 bytes");
}

TEST(catalogue, process_data_that_does_not_fit_together_is_refused)
{
	refused("entry 0x6000:1 bool \"a\"\n",
		"t.txt:1: an entry comes after the PDO that it belongs to");
	refused("txpdo 0x1a00 0 \"a\"\n", "t.txt:1: SyncManager 0 is not one of this direction");
	refused("sm 0x1000 1 0 1 outputs\ntxpdo 0x1a00 0 \"a\"\n",
		"t.txt:2: SyncManager 0 is not one of this direction");
	refused("rxpdo 0x1600 - \"a\"\ntxpdo 0x1a00 - \"a\"\n",
		"t.txt:2: TxPDOs come before RxPDOs");
	refused("rxpdo 0x1600 - \"a\"\nentry 0x7000:1 int \"a\" count\n",
		"t.txt:2: only an input shows something");
	refused("txpdo 0x1a00 - \"a\"\nentry 0x6000 int \"a\"\n",
		"t.txt:2: '0x6000' is not INDEX:SUBINDEX");
	refused("txpdo 0x1a00 - \"a\"\nentry 0x6000:1 word \"a\"\n",
		"t.txt:2: unknown word 'word'");
	refused("txpdo 0x1a00 - \"a\"\nrepeat 64\ngap 1\nend\nrepeat 64\ngap 1\nend\n"
		"repeat 64\ngap 1\nend\nrepeat 64\ngap 1\nend\n",
		"t.txt:12: more than 255 entries in a PDO");
}

TEST(catalogue, a_repeat_has_one_end_and_no_other_repeat_in_it)
{
	refused("end\n", "t.txt:1: an end without a repeat");
	refused("repeat 2\nrepeat 2\n", "t.txt:2: a repeat within a repeat");
	refused("repeat 0\n", "t.txt:1: channels: '0' is not a number from 1 to 64");
	refused(HEAD "repeat 2\n", "t.txt:6: the repeat of line 5 has no end");
	refused("sm 0x1000+1 1 0 1 inputs\n",
		"t.txt:1: start: '0x1000+1' is not a number from 0 to 65535");
}

TEST(catalogue, more_texts_than_an_image_holds_are_refused)
{
	refused("repeat 64\nname \"a %\"\nend\nrepeat 64\nname \"b %\"\nend\n",
		"t.txt:5: more than 96 different texts");
}

TEST(cia402, a_drive_goes_to_operation_enabled_step_by_step_and_back_without_voltage)
{
	CHECK_EQ(cia402_statusword(0, 0x0f), 0x50);
	CHECK_EQ(cia402_statusword(0x50, 0x0f), 0x50); /* not without "ready to switch on" */
	CHECK_EQ(cia402_statusword(0x50, 0x06), 0x31);
	CHECK_EQ(cia402_statusword(0x31, 0x07), 0x33);
	CHECK_EQ(cia402_statusword(0x33, 0x0f), 0x37);
	CHECK_EQ(cia402_statusword(0x37, 0x0f), 0x37);
	CHECK_EQ(cia402_statusword(0x37, 0x07), 0x33);
	CHECK_EQ(cia402_statusword(0x37, 0x06), 0x31);
	CHECK_EQ(cia402_statusword(0x37, 0x00), 0x50);
}
