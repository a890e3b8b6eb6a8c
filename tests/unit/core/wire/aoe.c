/* SPDX-License-Identifier: MIT */
#include "wire/aoe.h"

#include <errno.h>

#include "base/bytes.h"
#include "harness/test.h"

TEST(aoe, a_header_comes_back_as_it_was_written)
{
	const struct aoe_header out = { .target = { { 1, 2, 3, 4, 5, 6 }, 1001 },
					.source = { { 6, 5, 4, 3, 2, 1 }, 2002 },
					.command = AOE_WRITE,
					.flags = AOE_FLAG_COMMAND,
					.data_len = 8,
					.error = 7,
					.invoke_id = 0x12345678 };
	uint8_t data[AOE_HEADER_BYTES + 8] = { 0 };
	struct aoe_header in;

	aoe_header_put(data, &out);
	CHECK_EQ(aoe_header_get(data, sizeof(data), &in), 0);
	CHECK_MEM(in.target.net_id, out.target.net_id, 6);
	CHECK_EQ(in.target.port, 1001);
	CHECK_MEM(in.source.net_id, out.source.net_id, 6);
	CHECK_EQ(in.source.port, 2002);
	CHECK_EQ(in.command, AOE_WRITE);
	CHECK_EQ(in.flags, AOE_FLAG_COMMAND);
	CHECK_EQ(in.data_len, 8);
	CHECK_EQ(in.error, 7);
	CHECK_EQ(in.invoke_id, 0x12345678);
	CHECK_EQ(aoe_header_get(data, sizeof(data) - 1, &in), -EBADMSG);
	CHECK_EQ(aoe_header_get(data, AOE_HEADER_BYTES - 1, &in), -EBADMSG);
	put_le32(data + 20, UINT32_MAX);
	CHECK_EQ(aoe_header_get(data, sizeof(data), &in), -EBADMSG);
}

TEST(aoe, an_sdo_is_an_index_offset)
{
	CHECK_EQ(aoe_sdo_offset(0x1018, 2), 0x10180002);
}

TEST(aoe, a_net_id_is_six_bytes_in_decimal)
{
	static const char *const bad[] = { "1.2.3.4.5",  "1.2.3.4.5.6.7", "1.2.3.4.5.256",
					   "1.2.3.4.5.", "1..3.4.5.6",    "1.2.3.4.5.6 ",
					   "a",          "1.2.3.4.5.0006" };
	uint8_t id[AOE_NET_ID_BYTES] = { 9 };

	CHECK_EQ(aoe_net_id_parse("192.168.0.1.2.255", id), 0);
	CHECK_EQ(id[0], 192);
	CHECK_EQ(id[5], 255);
	for (size_t i = 0; i < sizeof(bad) / sizeof(bad[0]); i++) {
		CHECK_EQ(aoe_net_id_parse(bad[i], id), -EINVAL);
	}
	CHECK_EQ(id[0], 192);
	CHECK_EQ(aoe_net_id_parse("", id), 0);
	CHECK_EQ(id[0], 0);
}

TEST(aoe, errors_of_ads_and_aborts_of_sdos_have_a_text)
{
	CHECK_STR(aoe_error_to_str(AOE_ERROR_GROUP), "invalid index group");
	CHECK_STR(aoe_error_to_str(0x06020000), "object does not exist");
	CHECK_STR(aoe_error_to_str(0x7777), "unknown error");
}
