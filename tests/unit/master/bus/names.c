/* SPDX-License-Identifier: MIT */
#include "bus/names.h"

#include "harness/test.h"

static void check_sanitised(const char *text, const char *wanted)
{
	char name[PDO_NAME_BYTES];

	name_sanitise(text, name, sizeof(name));
	CHECK_STR(name, wanted);
}

TEST(names, text_becomes_lower_snake_case)
{
	check_sanitised("Channel 1.Output", "channel_1_output");
	check_sanitised("  __Wert / V!! ", "wert_v");
	check_sanitised("adc", "adc");
	check_sanitised("", "");
	check_sanitised("\xff\x80--", "");
	check_sanitised("01234567890123456789012345678901234567890123456789012345678901234567",
			"012345678901234567890123456789012345678901234567890123456789012");
}

static struct pdo_entry entry(const char *pdo, const char *name, uint16_t index, uint8_t subindex)
{
	struct pdo_entry e = { .index = index, .subindex = subindex, .bit_len = 1 };

	snprintf(e.pdo_name, sizeof(e.pdo_name), "%s", pdo);
	snprintf(e.name, sizeof(e.name), "%s", name);
	return e;
}

TEST(names, a_name_is_cut_only_where_the_channel_has_no_room)
{
	static const char text[] = "RTD Inputs Channel 1.Status Sensor Wire Broken Or Short";
	const struct pdo_entry e[] = { entry("", text, 0x6000, 3) };
	char name[1][PDO_NAME_BYTES];

	name_entries(e, 1, 63 - 6, name);
	CHECK_STR(name[0], "rtd_inputs_channel_1_status_sensor_wire_broken_or_short");
	name_entries(e, 1, 21, name);
	CHECK_STR(name[0], "rtd_inputs_channel_1");
}

TEST(names, slave_is_named_after_its_device_and_place)
{
	char name[32];

	name_slave("FB1111-Piccolo", 1, 0, name, sizeof(name));
	CHECK_STR(name, "piccolo0");
	name_slave("EL2828 8Ch. Dig. Output 24V, 2A", 0, 1, name, sizeof(name));
	CHECK_STR(name, "el2828_1");
	name_slave("Drive", 0, 12, name, sizeof(name));
	CHECK_STR(name, "drive12");
	name_slave("???", 0, 3, name, sizeof(name));
	CHECK_STR(name, "slave3");
}

TEST(names, entries_take_the_pdo_in_front_only_where_they_share_a_name)
{
	const struct pdo_entry e[] = {
		entry("Channel 1", "Output", 0x3001, 1),
		entry("Channel 2", "Output", 0x3002, 1),
		entry("Status", "Ready", 0x3003, 1),
		entry("", "", 0, 0),
		entry("", "", 0x3004, 0x11),
	};
	char name[5][PDO_NAME_BYTES];

	name_entries(e, 5, 32, name);
	CHECK_STR(name[0], "channel_1_output");
	CHECK_STR(name[1], "channel_2_output");
	CHECK_STR(name[2], "ready");
	CHECK_STR(name[4], "x3004_11");
}

TEST(names, index_and_number_make_the_last_ones_differ)
{
	const struct pdo_entry e[] = {
		entry("Inputs", "Value", 0x6000, 1),
		entry("Inputs", "Value", 0x6000, 2),
		entry("Inputs", "Value", 0x6000, 2),
		entry("Inputs", "Value", 0x6000, 2),
	};
	char name[4][PDO_NAME_BYTES];

	name_entries(e, 4, 32, name);
	for (int i = 0; i < 4; i++) {
		for (int k = 0; k < i; k++) {
			CHECK(strcmp(name[i], name[k]) != 0);
		}
	}
	CHECK_STR(name[0], "inputs_value_6000_01");
}

TEST(names, modules_without_pdo_names_are_distinguished_by_their_slots)
{
	const struct pdo_entry e[] = {
		entry("", "Channel 1 Data", 0x6000, 1), entry("", "Channel 2 Data", 0x6000, 2),
		entry("", "Channel 1 Data", 0x7010, 1), entry("", "Channel 1 Data", 0x63f0, 1),
		entry("", "Status", 0xf100, 1),         entry("", "Status", 0x6030, 5),
		entry("", "Value", 0x6040, 1),          entry("", "Value", 0x7040, 1),
	};
	char name[8][PDO_NAME_BYTES];

	name_entries(e, 8, 32, name);
	CHECK_STR(name[0], "slot1_channel_1_data");
	CHECK_STR(name[1], "channel_2_data");
	CHECK_STR(name[2], "slot2_channel_1_data");
	CHECK_STR(name[3], "slot64_channel_1_data");
	CHECK_STR(name[4], "status");
	CHECK_STR(name[5], "slot4_status");
	/* A module with inputs and outputs of one name. */
	CHECK_STR(name[6], "slot5_value_6040_01");
	CHECK_STR(name[7], "slot5_value_7040_01");
}
