/* SPDX-License-Identifier: MIT */
/* What follows from the modules of a WAGO node. */
#include "devices/wago_node.h"

#include <errno.h>

#include "devices/catalogue.h"
#include "devices/wago_750_354.h"
#include "harness/test.h"
#include "wire/sii.h"

static struct wago_node *node_of(const unsigned *numbers, size_t count)
{
	static struct wago_node node;
	const struct wago_module *modules[WAGO_MODULES_MAX + 1];

	for (size_t i = 0; i < count; i++) {
		modules[i] = wago_module_find(numbers[i]);
		CHECK(modules[i] != NULL);
	}
	CHECK_EQ(wago_node_init(&node, modules, count), 0);
	return &node;
}

static void check_pdos(const struct wago_node *node, const uint16_t *index, size_t count)
{
	CHECK_EQ(node->sii.pdo_count, count);
	for (size_t i = 0; i < count; i++) {
		CHECK_EQ(node->sii.pdo[i].index, index[i]);
	}
}

TEST(wago_node, node_with_four_modules_has_fourteen_bytes_each_way)
{
	static const uint16_t pdos[] = { 0x16ff, 0x1601, 0x1603, 0x1701,
					 0x1aff, 0x1a00, 0x1a02, 0x1b01 };
	const struct wago_node *node = node_of((const unsigned[]){ 457, 557, 430, 530 }, 4);

	CHECK_EQ(node->bytes[0], 14);
	CHECK_EQ(node->bytes[1], 14);
	check_pdos(node, pdos, 8);
	CHECK_EQ(node->slot[0].first_bit, 32);
	CHECK_EQ(node->slot[2].first_bit, 96);
}

/* What is published of a real node with these two modules: 48 bits each way, these PDOs. */
TEST(wago_node, a_node_of_430_and_530_has_six_bytes_each_way)
{
	static const uint16_t pdos[] = { 0x16ff, 0x1601, 0x1701, 0x1aff, 0x1a00, 0x1b01 };
	const struct wago_node *node = node_of((const unsigned[]){ 430, 530 }, 2);

	CHECK_EQ(node->bytes[0], 6);
	CHECK_EQ(node->bytes[1], 6);
	check_pdos(node, pdos, 6);
	CHECK_EQ(node->slot[0].first_bit, 32);
	CHECK_EQ(node->slot[1].first_bit, 32);
}

TEST(wago_node, analog_modules_come_before_digital_ones_wherever_they_stand)
{
	static const uint16_t pdos[] = { 0x16ff, 0x1603, 0x1600, 0x1701,
					 0x1aff, 0x1a02, 0x1a01, 0x1b01 };

	check_pdos(node_of((const unsigned[]){ 530, 430, 457, 557 }, 4), pdos, 8);
}

TEST(wago_node, whole_words_need_no_padding)
{
	static const uint16_t pdos[] = { 0x16ff, 0x1aff, 0x1a00, 0x1a01 };
	const struct wago_node *node = node_of((const unsigned[]){ 430, 430 }, 2);

	check_pdos(node, pdos, 4);
	CHECK_EQ(node->bytes[0], 6);
	CHECK_EQ(node->bytes[1], 4);
	CHECK_EQ(node->slot[1].first_bit, 40);
}

TEST(wago_node, a_coupler_alone_has_its_headers)
{
	const struct wago_node *node = node_of(NULL, 0);

	CHECK_EQ(node->bytes[0], WAGO_HEADER_BYTES);
	CHECK_EQ(node->bytes[1], WAGO_HEADER_BYTES);
	CHECK_EQ(node->sii.pdo_count, 2);
}

TEST(wago_node, sixty_four_modules_fit_and_one_more_does_not)
{
	const struct wago_module *modules[WAGO_MODULES_MAX + 1];
	static struct wago_node node;

	for (size_t i = 0; i <= WAGO_MODULES_MAX; i++) {
		modules[i] = wago_module_find(557);
	}
	CHECK_EQ(wago_node_init(&node, modules, WAGO_MODULES_MAX + 1), -E2BIG);
	CHECK_EQ(wago_node_init(&node, modules, WAGO_MODULES_MAX), 0);
	CHECK_EQ(node.bytes[1], 4 + 64 * 8);
	CHECK_EQ(node.sii.pdo[WAGO_MODULES_MAX].index, 0x163f);
	CHECK_EQ(node.sii.entry[node.sii.pdo[WAGO_MODULES_MAX].first_entry].index, 0x73f0);
}

TEST(wago_node, its_eeprom_says_what_real_ones_say)
{
	static uint8_t image[MODEL_SII_BYTES];
	static struct sii sii;
	char text[SII_NAME_BYTES];
	size_t len = catalogue_image("wago_750_354", image, &sii);

	CHECK_EQ(sii_checksum(image), image[14]);
	CHECK_EQ(sii.vendor, 0x21);
	CHECK_EQ(sii.product, 0x07500354);
	CHECK_EQ(sii.revision, 2);
	CHECK_EQ(sii.mailbox_protocols, SII_MAILBOX_COE);
	CHECK_EQ(sii.coe_details, 0x33);
	CHECK_EQ(sii.mailbox_out_start, 0x1000);
	CHECK_EQ(sii.mailbox_in_start, 0x1400);
	CHECK_EQ(sii.mailbox_in_len, 512);
	CHECK_EQ(sii.sm_count, 4);
	CHECK_EQ(sii.sm[2].start, 0x1800);
	CHECK_EQ(sii.sm[2].control, 0x64);
	CHECK_EQ(sii.sm[3].start, 0x2400);
	CHECK_EQ(sii.sm[3].control, 0x00);
	CHECK_EQ(sii.pdo_count, 0);
	CHECK_EQ(sii.dc_mode[1].assign_activate, 0x0300);
	sii_text(image, len, sii.device_name, text);
	CHECK_STR(text, "WAGO Series 750 Bus Coupler");
}

static int by_name(const char *name)
{
	struct segment_slave_spec spec = { .device = NULL };
	int r = wago_750_354_by_name(0, name, &spec);

	if (r == 0) {
		spec.device->ops->destroy(spec.device);
	}
	return r;
}

TEST(wago_node, a_name_lists_its_modules)
{
	char many[400] = "wago_750_354";

	CHECK_EQ(by_name("wago_750_354"), 0);
	CHECK_EQ(by_name("wago_750_354+430+530"), 0);
	CHECK_EQ(by_name("wago_750_354+"), -EINVAL);
	CHECK_EQ(by_name("wago_750_354+431"), -EINVAL);
	CHECK_EQ(by_name("wago_750_354+430-530"), -EINVAL);
	CHECK_EQ(by_name("wago_750_354+4300000000000000000000"), -EINVAL);
	for (int i = 0; i <= WAGO_MODULES_MAX; i++) {
		strcat(many, "+430");
	}
	CHECK_EQ(by_name(many), -E2BIG);
	CHECK_EQ(wago_750_354_is_name("wago_750_354+x"), 1);
	CHECK_EQ(wago_750_354_is_name("wago_750_3540"), 0);
	CHECK_EQ(wago_750_354_is_name("wago"), 0);
}
