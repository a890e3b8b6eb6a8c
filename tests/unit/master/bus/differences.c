/* SPDX-License-Identifier: MIT */
#include "bus/differences.h"

#include "bus/compare.h"
#include "bus/pdo.h"
#include "harness/test.h"

enum { COUPLER = 0x044c2c52, OUT = 0x0b0c3052, IN = 0x03f03052 };

static struct config cfg;
static struct slave_info found[8];
static size_t found_count;
static struct differences list;

static void want(const char *name, uint32_t product)
{
	struct config_slave *slave = &cfg.slave[cfg.slave_count++];

	slave->vendor = 2;
	slave->product = product;
	slave->line = 10 + (int)cfg.slave_count;
	snprintf(slave->name, sizeof(slave->name), "%s", name);
}

static void find(uint32_t product)
{
	found[found_count++] = (struct slave_info){
		.vendor = 2, .product = product, .revision = 5, .serial = 77, .device = "EL"
	};
}

/* "missing 1 rear; unexpected @2; ": kind, slave, position, name, property. */
static const char *compare(void)
{
	static const char *const kinds[] = { "",           "missing",  "optional",
					     "unexpected", "identity", "place",
					     "lost",       "channel",  "unchecked" };
	static char text[1024];

	differences_free(&list);
	CHECK_EQ(differences_of_slaves(&cfg, found, NULL, found_count, &list), 0);
	text[0] = '\0';
	for (size_t i = 0; i < list.count; i++) {
		const struct difference *diff = &list.at[i];
		size_t used = strlen(text);

		used += (size_t)snprintf(text + used, sizeof(text) - used, "%s", kinds[diff->kind]);
		if (diff->item != DIFFERENCE_NOWHERE) {
			used += (size_t)snprintf(text + used, sizeof(text) - used, " %u %s",
						 diff->item, diff->name);
		}
		if (diff->position != DIFFERENCE_NOWHERE) {
			used += (size_t)snprintf(text + used, sizeof(text) - used, " @%u",
						 diff->position);
		}
		snprintf(text + used, sizeof(text) - used, "%s%s; ",
			 diff->property[0] != '\0' ? " " : "", diff->property);
	}
	differences_free(&list);
	return text;
}

static void begin(void)
{
	memset(&cfg, 0, sizeof(cfg));
	memset(found, 0, sizeof(found));
	found_count = 0;
	cfg.bus_presence = CONFIG_EXACT_SLAVES;
}

TEST(differences, a_bus_that_fits_has_none)
{
	begin();
	CHECK_STR(compare(), "");
	want("coupler", COUPLER);
	want("out", OUT);
	find(COUPLER);
	find(OUT);
	CHECK_STR(compare(), "");
	cfg.bus_presence = CONFIG_ANY_SLAVES;
	find(IN);
	CHECK_STR(compare(), "");
}

TEST(differences, all_are_reported_at_once)
{
	begin();
	want("coupler", COUPLER);
	want("out", OUT);
	want("in", IN);
	want("other", 0x99);
	find(COUPLER);
	find(0x1234);
	find(IN);
	CHECK_STR(compare(), "identity 1 out @1 device; missing 3 other; ");
	find(0x4321);
	find(0x5555);
	CHECK_STR(compare(),
		  "identity 1 out @1 device; identity 3 other @3 device; unexpected @4; ");
}

TEST(differences, every_property_of_the_right_device_is_one)
{
	begin();
	want("out", OUT);
	cfg.slave[0].revision = 6;
	cfg.slave[0].serial = 78;
	cfg.slave[0].alias = 3;
	cfg.slave[0].identification = 4;
	find(OUT);
	CHECK_STR(compare(), "identity 0 out @0 revision; identity 0 out @0 serial; "
			     "identity 0 out @0 alias; identity 0 out @0 identification; ");
	cfg.slave[0].revision_policy = CONFIG_REVISION_AT_LEAST;
	CHECK_EQ(differences_of_slaves(&cfg, found, NULL, 1, &list), 0);
	CHECK_STR(list.at[0].expected, "0x00000006 or newer");
	CHECK_STR(list.at[0].found, "0x00000005");
	CHECK_STR(list.at[1].expected, "78");
	CHECK_STR(list.at[1].found, "77");
	CHECK_EQ(list.at[0].line, 11);
	differences_free(&list);
}

TEST(differences, exchanged_slaves_are_in_the_wrong_place_and_not_missing)
{
	begin();
	want("coupler", COUPLER);
	want("out", OUT);
	want("in", IN);
	find(COUPLER);
	find(IN);
	find(OUT);
	CHECK_STR(compare(), "place 1 out @2; ");
}

TEST(differences, of_equal_slaves_the_last_one_is_missing)
{
	begin();
	want("first", OUT);
	want("second", OUT);
	want("third", OUT);
	find(OUT);
	find(OUT);
	CHECK_STR(compare(), "missing 2 third; ");
	found_count = 0;
	CHECK_STR(compare(), "missing 0 first; missing 1 second; missing 2 third; ");
}

TEST(differences, an_optional_slave_that_is_absent_is_a_note)
{
	begin();
	want("coupler", COUPLER);
	want("out", OUT);
	cfg.slave[1].is_optional = 1;
	find(COUPLER);
	CHECK_STR(compare(), "optional 1 out; ");
	CHECK_EQ(difference_is_note(&(struct difference){ .kind = DIFFERENCE_OPTIONAL }), 1);
	want("in", IN);
	CHECK_STR(compare(), "optional 1 out; missing 2 in; ");
	find(0x77);
	CHECK_STR(compare(), "optional 1 out; identity 2 in @1 device; ");
}

TEST(differences, one_too_many_in_the_middle_is_not_a_row_of_wrong_ones)
{
	begin();
	cfg.bus_presence = CONFIG_ANY_SLAVES;
	want("coupler", COUPLER);
	want("out", OUT);
	want("in", IN);
	find(COUPLER);
	find(0x1234);
	find(OUT);
	find(IN);
	find(0x4321);
	CHECK_STR(compare(), "unexpected @1; ");
}

/* Whatever is there: no difference but notes if and only if the slaves can be bound. */
TEST(differences, they_agree_with_what_binds)
{
	static const uint32_t products[] = { COUPLER, OUT, IN };
	int config[8];

	for (unsigned n = 0; n < 20000; n++) {
		unsigned bits = n * 2654435761u;
		unsigned real = 0;

		begin();
		cfg.bus_presence = bits & 1 ? CONFIG_EXACT_SLAVES : CONFIG_ANY_SLAVES;
		for (unsigned i = 0; i < (bits >> 1) % 5; i++) {
			want("", products[(bits >> (4 + 2 * i)) % 3]);
			cfg.slave[i].is_optional = (bits >> (14 + i)) & 1;
		}
		for (unsigned j = 0; j < (bits >> 20) % 5; j++) {
			find(products[(bits >> (21 + 2 * j)) % 3]);
		}
		differences_free(&list);
		CHECK_EQ(differences_of_slaves(&cfg, found, NULL, found_count, &list), 0);
		for (size_t i = 0; i < list.count; i++) {
			real += !difference_is_note(&list.at[i]);
		}
		if ((real == 0) != (compare_bind(&cfg, found, NULL, found_count, config) == 0)) {
			test_fail(__FILE__, __LINE__, "trial %u: %u differences: %s", n, real,
				  compare());
		}
	}
	differences_free(&list);
}

TEST(differences, an_output_must_be_an_output_channel)
{
	static const struct channel channels[] = {
		{ .name = "a.in", .direction = CHANNEL_INPUT },
		{ .name = "a.out", .direction = CHANNEL_OUTPUT },
	};

	begin();
	cfg.output_count = 3;
	snprintf(cfg.output[0].channel, LIMIT_NAME_BYTES, "a.out");
	snprintf(cfg.output[1].channel, LIMIT_NAME_BYTES, "a.in");
	snprintf(cfg.output[2].channel, LIMIT_NAME_BYTES, "a.none");
	cfg.output[2].line = 30;
	CHECK_EQ(differences_of_outputs(&cfg, channels, 2, &list), 0);
	CHECK_EQ(list.count, 2);
	CHECK_STR(list.at[0].name, "a.in");
	CHECK_STR(list.at[0].found, "an input channel");
	CHECK_STR(list.at[1].found, "no channel of this name");
	CHECK_EQ(list.at[1].line, 30);
	differences_free(&list);
}

/* --- PDOs --- */

static struct pdo_entry entry[16];
static size_t entry_count;

static void map(uint16_t pdo, const char *name, uint8_t sm, uint16_t index)
{
	struct pdo_entry *e = &entry[entry_count++];

	*e = (struct pdo_entry){ .pdo = pdo, .index = index, .subindex = 1, .bit_len = 16 };
	e->sm = sm;
	e->is_output = pdo < 0x1a00;
	snprintf(e->pdo_name, sizeof(e->pdo_name), "%s", name);
}

static struct config_pdo *list_pdo(uint16_t index, const char *pdo)
{
	struct config_pdo *item = &cfg.pdo[cfg.pdo_count++];

	*item = (struct config_pdo){ .slave_pos = 1, .index = index, .line = 7 };
	snprintf(item->pdo, sizeof(item->pdo), "%s", pdo);
	return item;
}

/* "expected/found; " of each difference. */
static const char *compare_pdos(void)
{
	static const struct slave_info slave = { .slave_pos = 1, .config_item = 3, .name = "ai" };
	static char text[512];

	CHECK_EQ(differences_of_pdos(&cfg, &slave, entry, entry_count, &list), 0);
	text[0] = '\0';
	for (size_t i = 0; i < list.count; i++) {
		const struct difference *diff = &list.at[i];
		size_t used = strlen(text);

		CHECK_EQ(diff->kind, DIFFERENCE_PDOS);
		CHECK_EQ(diff->item, 2);
		CHECK_EQ(diff->position, 1);
		CHECK_EQ(diff->line, 7);
		CHECK_STR(diff->name, "ai");
		CHECK_STR(diff->group, "analog");
		snprintf(text + used, sizeof(text) - used, "%s/%s; ", diff->expected, diff->found);
	}
	differences_free(&list);
	return text;
}

static void begin_pdos(void)
{
	begin();
	entry_count = 0;
	snprintf(cfg.slave[1].group, sizeof(cfg.slave[1].group), "analog");
	map(0x1600, "Control", 2, 0x7000);
	map(0x1a00, "Status", 3, 0x6000);
	map(0x1a00, "Status", 3, 0x6001);
	map(0x1a02, "Value", 3, 0x6002);
}

TEST(differences, pdos_that_are_assigned_as_listed_are_none)
{
	begin_pdos();
	CHECK_STR(compare_pdos(), ""); /* nothing is listed */
	list_pdo(0x1a00, "0x1a00");
	list_pdo(0, "Value");
	CHECK_STR(compare_pdos(), ""); /* outputs stay as they are */
	list_pdo(0x1600, "0x1600");
	CHECK_STR(compare_pdos(), "");
	cfg.pdo[0].slave_pos = 0; /* of another slave */
	CHECK_STR(compare_pdos(), "Value/0x1a00, 0x1a02; ");
}

TEST(differences, pdos_that_are_missing_too_many_or_in_another_order_are_shown)
{
	begin_pdos();
	list_pdo(0x1601, "0x1601");
	list_pdo(0x1a02, "0x1a02");
	list_pdo(0x1a00, "0x1a00");
	CHECK_STR(compare_pdos(), "0x1601/0x1600; 0x1a02, 0x1a00/0x1a00, 0x1a02; ");
	begin_pdos();
	list_pdo(0x1a00, "0x1a00");
	CHECK_STR(compare_pdos(), "0x1a00/0x1a00, 0x1a02; ");
	begin_pdos();
	list_pdo(0, "Nothing");
	CHECK_STR(compare_pdos(), "Nothing/0x1a00, 0x1a02; ");
	entry_count = 1;
	CHECK_STR(compare_pdos(), "Nothing/none with entries; ");
	entry_count = 0;
	CHECK_STR(compare_pdos(), "Nothing/none with entries; ");
}

TEST(differences, a_pdo_with_another_mapping_is_shown)
{
	struct config_pdo *item;

	begin_pdos();
	item = list_pdo(0x1a00, "0x1a00");
	list_pdo(0x1a02, "0x1a02");
	item->entry_count = 2;
	cfg.pdo_entry[0] = 0x60000110;
	cfg.pdo_entry[1] = 0x60010110;
	CHECK_STR(compare_pdos(), "");
	cfg.pdo_entry[1] = 0x60010108;
	CHECK_STR(compare_pdos(), "0x1a00 with other entries, 0x1a02/0x1a00, 0x1a02; ");
	item->entry_count = 1;
	CHECK_STR(compare_pdos(), "0x1a00 with other entries, 0x1a02/0x1a00, 0x1a02; ");
	cfg.pdo_entry[1] = 0x60010110;
	cfg.pdo_entry[2] = 0x60020110;
	item->entry_count = 3;
	CHECK_STR(compare_pdos(), "0x1a00 with other entries, 0x1a02/0x1a00, 0x1a02; ");
}
