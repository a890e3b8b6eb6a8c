/* SPDX-License-Identifier: MIT */
/* Start-up SDOs in the file: transition, complete access, comment, and the form of one line. */
#include <string.h>

#include "harness/test.h"
#include "parsing.h"

#define ITEM(text) "slaves:\n- sdo:\n  - " text "\n"

static struct config cfg;

static const struct config_sdo *parse_one(const char *text)
{
	parse_ok(text, &cfg);
	CHECK_EQ(cfg.sdo_count, 1);
	return &cfg.sdo[0];
}

static void check_octets(const struct config_sdo *sdo, const char *wanted, size_t len)
{
	uint8_t buffer[8];

	CHECK_EQ(sdo->bytes, len);
	CHECK(memcmp(config_sdo_data(&cfg, sdo, buffer), wanted, len) == 0);
}

TEST(config_startup, long_form_has_transition_complete_access_and_comment)
{
	const struct config_sdo *sdo =
		parse_one(ITEM("{ transition: SO, index: 0x1c12, complete: true, type: OCTETS, "
			       "value: 01 00 0A1b, comment: outputs }"));

	CHECK_EQ(sdo->transition, CONFIG_TRANSITION_SO);
	CHECK_EQ(sdo->index, 0x1c12);
	CHECK_EQ(sdo->is_complete, 1);
	CHECK_STR(sdo->comment, "outputs");
	check_octets(sdo, "\x01\x00\x0a\x1b", 4);
}

TEST(config_startup, without_a_transition_it_is_ps)
{
	const struct config_sdo *sdo = parse_one(ITEM("{ index: 0x8000, type: UINT, value: 258 }"));

	CHECK_EQ(sdo->transition, CONFIG_TRANSITION_PS);
	CHECK_EQ(sdo->is_complete, 0);
	CHECK_STR(sdo->comment, "");
	check_octets(sdo, "\x02\x01", 2);
}

TEST(config_startup, a_line_is_the_same_as_the_long_form)
{
	const struct config_sdo *sdo =
		parse_one(ITEM("\"IP 0x8000:1a uint = 0x102  # filter #2\""));

	CHECK_EQ(sdo->transition, CONFIG_TRANSITION_IP);
	CHECK_EQ(sdo->index, 0x8000);
	CHECK_EQ(sdo->subindex, 0x1a);
	CHECK_EQ(sdo->bytes, 2);
	CHECK_EQ(sdo->value, 0x102);
	CHECK_STR(sdo->comment, "filter #2");
	CHECK_EQ(sdo->line, 3);
}

TEST(config_startup, a_line_needs_only_object_type_and_value)
{
	const struct config_sdo *sdo = parse_one(ITEM("0x8000 REAL=0.5"));

	CHECK_EQ(sdo->transition, CONFIG_TRANSITION_PS);
	CHECK_EQ(sdo->subindex, 0);
	CHECK_EQ(sdo->value, 0x3f000000);
}

TEST(config_startup, without_a_type_the_value_waits_for_that_of_the_slave)
{
	const struct config_sdo *sdo = parse_one(ITEM("\"0x8000:06 = -12  # filter\""));

	CHECK_EQ(sdo->type, CONFIG_SDO_AUTO);
	CHECK_EQ(sdo->subindex, 6);
	CHECK_STR(sdo->comment, "filter");
	check_octets(sdo, "-12", 3);
	sdo = parse_one(ITEM("{ index: 0x8000, value: 1.5 }"));
	CHECK_EQ(sdo->type, CONFIG_SDO_AUTO);
	check_octets(sdo, "1.5", 3);
	parse_fails(
		ITEM("PS 0x1c12 complete = 01 00"),
		"t.yaml:3: slaves[0].sdo[0].complete: requires subindex 0 or 1, and type OCTETS "
		"for the whole object");
}

TEST(config_startup, lines_of_octets_and_texts)
{
	parse_ok("slaves:\n- sdo:\n"
		 "  - PS 0x1c13:00 complete OCTETS = 01 00 00 1a\n"
		 "  - \"OS 0x2000:0x05 STRING = a#b c # why\"\n"
		 "  - SO 0x3000:2 DINT = -1\n",
		 &cfg);
	CHECK_EQ(cfg.sdo_count, 3);
	CHECK_EQ(cfg.sdo[0].is_complete, 1);
	check_octets(&cfg.sdo[0], "\x01\x00\x00\x1a", 4);
	CHECK_EQ(cfg.sdo[1].transition, CONFIG_TRANSITION_OS);
	CHECK_EQ(cfg.sdo[1].subindex, 5);
	check_octets(&cfg.sdo[1], "a#b c", 5);
	check_octets(&cfg.sdo[2], "\xff\xff\xff\xff", 4);
}

TEST(config_startup, a_line_of_another_form_is_shown_with_one_of_the_right_form)
{
	static const char *const wrong[] = {
		"PS 8000:01 UINT = 1", "PS 0x8000:01 1",         "PS 0x8000:001 UINT = 1",
		"PS 0x8000 UINT 1",    "PS 0x8000:01 UINT = ",   "PS UINT = 1",
		"0x8000: UINT = 1",    "0x8000:01 UINT INT = 1", "PS",
	};

	for (size_t i = 0; i < sizeof(wrong) / sizeof(wrong[0]); i++) {
		char text[128];
		char line[256];

		snprintf(text, sizeof(text), ITEM("\"%s\""), wrong[i]);
		snprintf(line, sizeof(line),
			 "t.yaml:3: slaves[0].sdo[0]: expected a line such as \"PS 0x8000:01 UINT "
			 "= 3  # comment\", not \"%s\"",
			 wrong[i]);
		parse_fails(text, line);
	}
}

TEST(config_startup, what_is_wrong_in_a_line_is_named_as_in_the_long_form)
{
	parse_fails(
		ITEM("SP 0x8000:01 UINT = 1"),
		"t.yaml:3: slaves[0].sdo[0].transition: expected one of IP|PS|SO|OS, not \"SP\"");
	parse_fails(ITEM("0x18000:01 UINT = 1"),
		    "t.yaml:3: slaves[0].sdo[0].index: 0x18000 is out of range: 1 to 0xffff");
	parse_fails(ITEM("0x8000:01 UINT = 70000"),
		    "t.yaml:3: slaves[0].sdo[0].value: 70000 does not fit into UINT");
	parse_fails(ITEM("0x8000:01 OCTETS = 1"),
		    "t.yaml:3: slaves[0].sdo[0].value: expected OCTETS in hexadecimal, such as 01 "
		    "00 0a ff");
	parse_fails(ITEM("0x8000:02 complete OCTETS = 01"),
		    "t.yaml:3: slaves[0].sdo[0].complete: requires subindex 0 or 1, and type "
		    "OCTETS for the whole object");
	parse_fails(ITEM("0x8000 complete UINT = 1"),
		    "t.yaml:3: slaves[0].sdo[0].complete: requires subindex 0 or 1, and type "
		    "OCTETS for the whole object");
}
