/* SPDX-License-Identifier: MIT */
#include "bus/channel_rules.h"

#include <errno.h>
#include <math.h>

#include "harness/test.h"
#include "image/image.h"

enum { ROOM = 6 };

static struct config cfg;
static struct slave_info slave;
static struct channel channel[ROOM];
static char error[512];

static struct config_channel *rule(const char *match)
{
	struct config_channel *item = &cfg.channel[cfg.channel_count++];

	*item = (struct config_channel){ .min = -INFINITY, .max = INFINITY, .slave_pos = 1 };
	item->line = 10 + (int)cfg.channel_count;
	snprintf(item->match, sizeof(item->match), "%s", match);
	return item;
}

static struct channel made(const char *name, uint16_t index, uint8_t subindex, uint8_t bits)
{
	struct channel ch = { .slave_pos = 1,
			      .index = index,
			      .subindex = subindex,
			      .type = bits == 1 ? CHANNEL_BOOL : CHANNEL_UINT,
			      .bit_len = bits,
			      .scale = 1 };

	snprintf(ch.name, sizeof(ch.name), "rear.%s", name);
	return ch;
}

static struct channel_rules_of begin(void)
{
	memset(&cfg, 0, sizeof(cfg));
	snprintf(cfg.path, sizeof(cfg.path), "f.yaml");
	slave = (struct slave_info){ .name = "rear", .slave_pos = 1 };
	channel[0] = made("ai_1", 0x6000, 1, 16);
	channel[1] = made("ai_2", 0x6010, 1, 16);
	channel[2] = made("status", 0x6010, 2, 1);
	channel[3] = made("count", 0x6020, 1, 32);
	return (struct channel_rules_of){
		.cfg = &cfg, .slave = &slave, .channel = channel, .count = 4
	};
}

static const char *check(const struct channel_rules_of *of)
{
	error[0] = '\0';
	CHECK_EQ(channel_rules_check(of, error, sizeof(error)), error[0] == '\0' ? 0 : -EINVAL);
	return error;
}

TEST(channel_rules, name_unit_scale_and_range_are_those_of_the_file)
{
	struct channel_rules_of of = begin();
	struct config_channel *item = rule("ai_1");

	snprintf(item->name, sizeof(item->name), "pressure");
	snprintf(item->unit, sizeof(item->unit), "bar");
	item->scale = 0.5;
	item->offset = -1;
	item->min = 0;
	CHECK_STR(check(&of), "");
	CHECK_EQ(channel_rules_apply(&of), 0);
	CHECK_STR(channel[0].name, "rear.pressure");
	CHECK_STR(channel[0].unit, "bar");
	CHECK(image_raw_to_physical(&channel[0], 4) == 1);
	CHECK(image_has_range(&channel[0]));
	CHECK(image_is_outside(&channel[0], -0.1) && !image_is_outside(&channel[0], 1e9));
	CHECK(image_is_outside(&channel[0], NAN));
	CHECK_STR(channel[1].name, "rear.ai_2");
	CHECK(!image_has_range(&channel[1]) && !image_is_outside(&channel[1], NAN));
}

TEST(channel_rules, what_an_item_does_not_give_remains)
{
	struct channel_rules_of of = begin();

	channel[0].scale = 0.25;
	channel[0].offset = 3;
	snprintf(channel[0].unit, sizeof(channel[0].unit), "V");
	rule("ai_*");
	CHECK_STR(check(&of), "");
	CHECK_EQ(channel_rules_apply(&of), 0);
	CHECK_STR(channel[0].name, "rear.ai_1");
	CHECK_STR(channel[0].unit, "V");
	CHECK(channel[0].scale == 0.25 && channel[0].offset == 3);
	CHECK_EQ(channel[0].type, CHANNEL_UINT);
}

TEST(channel_rules, a_pattern_an_object_and_the_whole_name_are_understood)
{
	struct channel_rules_of of = begin();

	snprintf(rule("ai_?")->unit, LIMIT_UNIT_BYTES, "V");
	snprintf(rule("rear.ai_2")->unit, LIMIT_UNIT_BYTES, "A");
	snprintf(rule("0x6020:01")->name, LIMIT_NAME_BYTES, "turns");
	CHECK_STR(check(&of), "");
	CHECK_EQ(channel_rules_apply(&of), 0);
	CHECK_STR(channel[0].unit, "V");
	CHECK_STR(channel[1].unit, "A");
	CHECK_STR(channel[3].name, "rear.turns");
}

TEST(channel_rules, items_mean_names_of_the_device_also_when_names_are_exchanged)
{
	struct channel_rules_of of = begin();

	snprintf(rule("ai_1")->name, LIMIT_NAME_BYTES, "ai_2");
	snprintf(rule("ai_2")->name, LIMIT_NAME_BYTES, "ai_1");
	CHECK_STR(check(&of), "");
	CHECK_EQ(channel_rules_apply(&of), 0);
	CHECK_STR(channel[0].name, "rear.ai_2");
	CHECK_STR(channel[1].name, "rear.ai_1");
}

TEST(channel_rules, an_item_that_meets_nothing_is_refused_with_the_channels_there_are)
{
	struct channel_rules_of of = begin();

	rule("ai_1");
	rule("adc");
	CHECK_STR(check(&of), "f.yaml:12: slave 1 (rear): channels: adc: no such channel; there "
			      "are: ai_1, ai_2, status, count");
	of.count = 0;
	CHECK_STR(check(&of), "f.yaml:11: slave 1 (rear): channels: ai_1: no such channel; there "
			      "are: none");
}

TEST(channel_rules, one_name_is_for_one_channel)
{
	struct channel_rules_of of = begin();

	snprintf(rule("ai_*")->name, LIMIT_NAME_BYTES, "u");
	CHECK_STR(check(&of), "f.yaml:11: slave 1 (rear): channels: ai_*: meets 2 channels, which "
			      "cannot all be named u");
	of = begin();
	snprintf(rule("ai_1")->name, LIMIT_NAME_BYTES, "status");
	CHECK_STR(check(&of), "f.yaml:11: slave 1 (rear): channels: ai_1: another channel of this "
			      "slave has the name status");
}

TEST(channel_rules, a_type_must_have_the_width_that_is_there)
{
	struct channel_rules_of of = begin();

	rule("count")->type = CONFIG_CHANNEL_FLOAT;
	rule("ai_1")->type = CONFIG_CHANNEL_INT;
	CHECK_STR(check(&of), "");
	CHECK_EQ(channel_rules_apply(&of), 0);
	CHECK(image_raw_to_physical(&channel[3], 0x3f800000) == 1);
	CHECK(image_raw_to_physical(&channel[0], 0xffff) == -1);
	of = begin();
	rule("ai_1")->type = CONFIG_CHANNEL_FLOAT;
	CHECK_STR(check(&of), "f.yaml:11: slave 1 (rear): channels: ai_1: ai_1 has 16 bits: it "
			      "cannot be a FLOAT");
	of = begin();
	rule("ai_1")->type = CONFIG_CHANNEL_BOOL;
	CHECK_STR(check(&of),
		  "f.yaml:11: slave 1 (rear): channels: ai_1: ai_1 has 16 bits: it cannot be a "
		  "BOOL");
}

TEST(channel_rules, a_name_of_63_characters_is_not_cut_and_a_longer_one_is_refused)
{
	struct channel_rules_of of = begin();
	struct config_channel *item = rule("ai_1");

	memset(item->name, 'x', 58);
	CHECK_STR(check(&of), "");
	CHECK_EQ(channel_rules_apply(&of), 0);
	CHECK_EQ(strlen(channel[0].name), 63);
	of = begin();
	memset(rule("ai_1")->name, 'x', 59);
	CHECK(strstr(check(&of), "is longer than 63 characters") != NULL);
}
