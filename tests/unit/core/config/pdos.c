/* SPDX-License-Identifier: MIT */
/* slaves[].pdos[] in the file. */
#include "harness/test.h"
#include "parsing.h"

#define ITEM(text) "slaves:\n- pdos:\n  - " text "\n"

static struct config cfg;

TEST(config_pdos, by_index_or_by_name_alone_or_with_entries)
{
	parse_ok("slaves:\n- {}\n- pdos:\n"
		 "  - 0x1A01\n"
		 "  - AI Compact Channel 2\n"
		 "  - { pdo: 0x1600, entries: \"0x6040:00 16, gap 8,0x607a:1a 32\" }\n",
		 &cfg);
	CHECK_EQ(cfg.pdo_count, 3);
	CHECK_EQ(cfg.pdo[0].slave_pos, 1);
	CHECK_EQ(cfg.pdo[0].index, 0x1a01);
	CHECK_EQ(cfg.pdo[0].entry_count, 0);
	CHECK_EQ(cfg.pdo[0].line, 4);
	CHECK_EQ(cfg.pdo[1].index, 0);
	CHECK_STR(cfg.pdo[1].pdo, "AI Compact Channel 2");
	CHECK_EQ(cfg.pdo[2].index, 0x1600);
	CHECK_EQ(cfg.pdo[2].entry_count, 3);
	CHECK_EQ(cfg.pdo_entry[cfg.pdo[2].entry_first], 0x60400010);
	CHECK_EQ(cfg.pdo_entry[cfg.pdo[2].entry_first + 1], 0x00000008);
	CHECK_EQ(cfg.pdo_entry[cfg.pdo[2].entry_first + 2], 0x607a1a20);
}

TEST(config_pdos, what_is_no_pdo_is_refused)
{
	parse_fails(ITEM("0x1000"), "t.yaml:3: slaves[0].pdos[0].pdo: 0x1000 is no PDO: 0x1600 to "
				    "0x17ff are RxPDOs, 0x1a00 to 0x1bff TxPDOs");
	parse_fails(ITEM("\"\""), "t.yaml:3: slaves[0].pdos[0].pdo: is empty");
	parse_fails(ITEM("{ entries: gap 1 }"), "t.yaml:3: slaves[0].pdos[0].pdo: is missing");
}

TEST(config_pdos, entries_of_another_form_are_refused)
{
	static const char *const wrong[] = { "0x6040:00", "0x6040 16", "6040:00 16", "gap",
					     "0x0:00 8",  "gap 0",     "gap 256" };

	for (size_t i = 0; i < sizeof(wrong) / sizeof(wrong[0]); i++) {
		char text[128];
		char line[192];

		snprintf(text, sizeof(text), ITEM("{ pdo: 0x1600, entries: \"%s\" }"), wrong[i]);
		snprintf(line, sizeof(line),
			 "t.yaml:3: slaves[0].pdos[0].entries: expected entries such as "
			 "\"0x6040:00 16, gap 8\", not \"%s\"",
			 wrong[i]);
		parse_fails(text, line);
	}
	parse_fails(ITEM("{ pdo: 0x1600, entries: gap 8 gap 8 }"),
		    "t.yaml:3: slaves[0].pdos[0].entries: expected a comma before \"gap 8\"");
}
