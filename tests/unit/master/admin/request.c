/* SPDX-License-Identifier: MIT */
#include <errno.h>

#include "admin/command.h"
#include "harness/test.h"
#include "unit/master/admin/target.h"

static int parse(const struct admin_request *rq, struct admin_request *ret, char *why)
{
	return admin_request_parse(rq, sizeof(*rq), ret, why);
}

TEST(admin, a_request_of_the_wrong_length_is_refused_and_the_output_untouched)
{
	struct admin_request rq = fake_request(ADMIN_PING);
	struct admin_request got = { .verb = 77 };
	char why[ADMIN_TEXT_BYTES] = "";

	CHECK_EQ(admin_request_parse(&rq, sizeof(rq) - 1, &got, why), -EMSGSIZE);
	CHECK_EQ(admin_request_parse(&rq, sizeof(rq) + 1, &got, why), -EMSGSIZE);
	CHECK_EQ(admin_request_parse(&rq, 0, &got, why), -EMSGSIZE);
	CHECK_EQ(got.verb, 77);
	CHECK(why[0] != '\0');
}

TEST(admin, a_request_without_the_magic_is_not_ours)
{
	struct admin_request rq = fake_request(ADMIN_PING);
	struct admin_request got = { .verb = 77 };
	char why[ADMIN_TEXT_BYTES];

	rq.magic ^= 1;
	CHECK_EQ(parse(&rq, &got, why), -EPROTO);
	CHECK_EQ(got.verb, 77);
}

TEST(admin, unknown_verbs_and_reserved_bits_are_refused)
{
	struct admin_request rq = fake_request(0);
	struct admin_request got;
	char why[ADMIN_TEXT_BYTES];

	CHECK_EQ(parse(&rq, &got, why), -EINVAL);
	rq.verb = 99;
	CHECK_EQ(parse(&rq, &got, why), -EINVAL);
	CHECK_STR(why, "unknown verb 99");
	rq.verb = ADMIN_PING;
	rq.reserved = 1;
	CHECK_EQ(parse(&rq, &got, why), -EINVAL);
	rq.reserved = 0;
	memset(rq.name, 'x', sizeof(rq.name));
	CHECK_EQ(parse(&rq, &got, why), -EINVAL);
	CHECK_STR(why, "the name does not end");
}

TEST(admin, data_and_timeouts_beyond_their_limits_are_refused)
{
	struct admin_request rq = fake_request(ADMIN_SDO_WRITE);
	struct admin_request got;
	char why[ADMIN_TEXT_BYTES];

	rq.data_len = ADMIN_DATA_BYTES;
	rq.data_total = ADMIN_TRANSFER_BYTES;
	rq.timeout_ms = ADMIN_TIMEOUT_MS_MAX;
	CHECK_EQ(parse(&rq, &got, why), 0);
	rq.data_total++;
	CHECK_EQ(parse(&rq, &got, why), -EINVAL);
	CHECK_STR(why, "1024 of 16777217 bytes of data: a message has up to 1024, a request up to "
		       "16777216");
	rq.data_total--;
	rq.timeout_ms++;
	CHECK_EQ(parse(&rq, &got, why), -EINVAL);
	CHECK_STR(why, "timeout of 3600001 ms: at most 3600000 ms are taken");
}

TEST(admin, a_set_takes_1_to_64_items_with_whole_printable_names)
{
	struct admin_request rq = fake_request(ADMIN_SET);
	struct admin_request got;
	char why[ADMIN_TEXT_BYTES];

	CHECK_EQ(parse(&rq, &got, why), -EINVAL);
	rq.count = ADMIN_ITEMS + 1;
	CHECK_EQ(parse(&rq, &got, why), -EINVAL);
	rq.count = UINT32_MAX;
	CHECK_EQ(parse(&rq, &got, why), -EINVAL);
	rq.count = 0;
	fake_item(&rq, "a.led", 1);
	CHECK_EQ(parse(&rq, &got, why), 0);
	CHECK_EQ(got.item[0].raw, 1);
	memset(rq.item[0].channel, 'x', sizeof(rq.item[0].channel));
	CHECK_EQ(parse(&rq, &got, why), -EINVAL);
	snprintf(rq.item[0].channel, sizeof(rq.item[0].channel), "a\nb");
	CHECK_EQ(parse(&rq, &got, why), -EINVAL);
	rq.item[0].channel[0] = '\0';
	CHECK_EQ(parse(&rq, &got, why), -EINVAL);
}

TEST(admin, slave_positions_beyond_the_limit_and_empty_writes_are_refused)
{
	struct admin_request rq = fake_request(ADMIN_SDO_READ);
	struct admin_request got;
	char why[ADMIN_TEXT_BYTES];

	rq.slave_pos = LIMIT_SLAVES;
	CHECK_EQ(parse(&rq, &got, why), -EINVAL);
	rq.slave_pos = LIMIT_SLAVES - 1;
	CHECK_EQ(parse(&rq, &got, why), 0);
	rq.verb = ADMIN_SDO_WRITE;
	CHECK_EQ(parse(&rq, &got, why), -EINVAL);
	rq.data_len = ADMIN_DATA_BYTES + 1;
	CHECK_EQ(parse(&rq, &got, why), -EINVAL);
	rq.data_len = ADMIN_DATA_BYTES;
	CHECK_EQ(parse(&rq, &got, why), 0);
	rq.verb = ADMIN_ONESHOT;
	rq.is_relative = 2;
	CHECK_EQ(parse(&rq, &got, why), -EINVAL);
}

TEST(admin, a_register_access_is_1_to_256_bytes_in_64_kib)
{
	struct admin_request rq = fake_request(ADMIN_REGISTER_READ);
	struct admin_request got;
	char why[ADMIN_TEXT_BYTES];

	CHECK_EQ(parse(&rq, &got, why), -EINVAL);
	CHECK_STR(why, "0 bytes at 0x0: expected 1 to 256 bytes at 0x0000 to 0xffff");
	rq.length = ADMIN_REGISTER_BYTES;
	rq.address = UINT16_MAX;
	CHECK_EQ(parse(&rq, &got, why), 0);
	rq.length++;
	CHECK_EQ(parse(&rq, &got, why), -EINVAL);
	rq.length = 1;
	rq.address++;
	CHECK_EQ(parse(&rq, &got, why), -EINVAL);
	rq = fake_request(ADMIN_REGISTER_WRITE);
	rq.length = 1; /* of a read */
	CHECK_EQ(parse(&rq, &got, why), -EINVAL);
	rq.data_len = ADMIN_REGISTER_BYTES;
	CHECK_EQ(parse(&rq, &got, why), 0);
	rq.data_total = ADMIN_REGISTER_BYTES + 1; /* more would follow */
	CHECK_EQ(parse(&rq, &got, why), -EINVAL);
	rq.data_total = 0;
	rq.slave_pos = LIMIT_SLAVES;
	CHECK_EQ(parse(&rq, &got, why), -EINVAL);
}

TEST(admin, an_alias_has_16_bits)
{
	struct admin_request rq = fake_request(ADMIN_SII_ALIAS);
	struct admin_request got;
	char why[ADMIN_TEXT_BYTES];

	rq.argument[0] = UINT16_MAX;
	CHECK_EQ(parse(&rq, &got, why), 0);
	rq.argument[0]++;
	CHECK_EQ(parse(&rq, &got, why), -EINVAL);
	CHECK_STR(why, "argument[0] must be an alias up to 65535");
}

TEST(admin, requests_to_a_mailbox_are_checked_before_they_reach_a_slave)
{
	static const struct {
		enum admin_verb verb;
		const char *name;
		uint32_t argument[3];
		uint8_t subindex;
		uint32_t data_len;
		uint32_t length;
		int is_good;
	} cases[] = {
		{ ADMIN_SDO_READ, "", { 1 }, 1, 0, 0, 1 },
		{ ADMIN_SDO_READ, "", { 1 }, 2, 0, 0, 0 },
		{ ADMIN_SDO_READ, "", { 2 }, 0, 0, 0, 0 },
		{ ADMIN_SDO_LIST, "", { 5 }, 0, 0, 0, 1 },
		{ ADMIN_SDO_LIST, "", { 6 }, 0, 0, 0, 0 },
		{ ADMIN_FOE_READ, "a.bin", { UINT32_MAX }, 0, 0, 0, 1 },
		{ ADMIN_FOE_READ, "", { 0 }, 0, 0, 0, 0 },
		{ ADMIN_FOE_WRITE, "a\nb", { 0 }, 0, 1, 0, 0 },
		{ ADMIN_FOE_WRITE, "a.bin", { 0 }, 0, 0, 0, 1 },
		{ ADMIN_SOE_READ, "", { 0x40 }, 7, 0, 0, 1 },
		{ ADMIN_SOE_READ, "", { 0x40 }, 8, 0, 0, 0 },
		{ ADMIN_SOE_READ, "", { 0 }, 0, 0, 0, 0 },
		{ ADMIN_SOE_READ, "", { 0x100 }, 0, 0, 0, 0 },
		{ ADMIN_SOE_WRITE, "", { 0x40 }, 0, 0, 0, 0 },
		{ ADMIN_EOE_IP_READ, "", { 15 }, 0, 0, 0, 1 },
		{ ADMIN_EOE_IP_READ, "", { 16 }, 0, 0, 0, 0 },
		{ ADMIN_AOE_READ, "1.2.3.4.5.6", { 0, 0, 65535 }, 0, 0, 4, 1 },
		{ ADMIN_AOE_READ, "1.2.3.4.5", { 0 }, 0, 0, 4, 0 },
		{ ADMIN_AOE_READ, "", { 0, 0, 65536 }, 0, 0, 4, 0 },
		{ ADMIN_AOE_READ, "", { 0 }, 0, 0, 0, 0 },
		{ ADMIN_VOE, "", { UINT32_MAX, 65535, 1 }, 0, 0, 0, 1 },
		{ ADMIN_VOE, "", { 0, 65536, 0 }, 0, 0, 0, 0 },
		{ ADMIN_VOE, "", { 0, 0, 2 }, 0, 0, 0, 0 },
	};
	struct admin_request got;
	char why[ADMIN_TEXT_BYTES];

	for (size_t i = 0; i < sizeof(cases) / sizeof(cases[0]); i++) {
		struct admin_request rq = fake_request(cases[i].verb);

		snprintf(rq.name, sizeof(rq.name), "%s", cases[i].name);
		memcpy(rq.argument, cases[i].argument, sizeof(cases[i].argument));
		rq.subindex = cases[i].subindex;
		rq.data_len = cases[i].data_len;
		rq.length = cases[i].length;
		CHECK_EQ(parse(&rq, &got, why), cases[i].is_good ? 0 : -EINVAL);
		rq.slave_pos = LIMIT_SLAVES;
		CHECK_EQ(parse(&rq, &got, why), -EINVAL);
	}
}
