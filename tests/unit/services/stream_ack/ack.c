/* SPDX-License-Identifier: MIT */
#include "stream/ack.h"

#include <string.h>

#include "harness/test.h"

static struct ack parse(const char *text)
{
	struct ack ack;

	ack_parse(text, strlen(text), &ack);
	return ack;
}

TEST(stream_ack, answers_of_jetstream_are_told_apart)
{
	struct ack ack = parse("{\"stream\":\"ecdaq\",\"seq\":12}");

	CHECK_EQ(ack.result, ACK_STORED);
	CHECK_EQ(ack.sequence, 12);
	ack = parse("{\"stream\":\"ecdaq\",\"seq\":3,\"duplicate\":true}");
	CHECK_EQ(ack.result, ACK_DUPLICATE);
	CHECK_EQ(ack.sequence, 3);
	ack = parse("{\"error\":{\"code\":400,\"err_code\":10071,\"description\":\"wrong last "
		    "sequence: 7\"},\"seq\":0}");
	CHECK_EQ(ack.result, ACK_REJECTED);
	CHECK_STR(ack.reason, "wrong last sequence: 7");
}

TEST(stream_ack, anything_else_is_no_answer)
{
	static const char *const bad[] = { "",
					   "{}",
					   "[]",
					   "{\"seq\":0}",
					   "null",
					   "{\"seq\":-1}",
					   "{\"seq\":1e30}",
					   "{\"seq\":\"1\"}",
					   "{\"seq\":1",
					   "\"error\"" };

	for (size_t i = 0; i < sizeof(bad) / sizeof(bad[0]); i++) {
		CHECK_EQ(parse(bad[i]).result, ACK_INVALID);
	}
}

TEST(stream_ack, a_reason_is_one_printable_line)
{
	struct ack ack = parse("{\"error\":{\"description\":\"a\\n\\u001b[1m\\u00e4b\"}}");

	CHECK_STR(ack.reason, "a??[1m??b");
	CHECK_STR(parse("{\"error\":{}}").reason, "no reason given");
}
