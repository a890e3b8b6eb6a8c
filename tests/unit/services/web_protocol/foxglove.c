/* SPDX-License-Identifier: MIT */
#include "web/foxglove.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

#include "base/bytes.h"
#include "harness/test.h"

static struct foxglove_request request;

static int parse(const char *text)
{
	return foxglove_parse(text, strlen(text), &request);
}

TEST(web_protocol, a_subscribe_request_gives_its_ids_and_channels)
{
	CHECK_EQ(parse("{\"op\":\"subscribe\",\"subscriptions\":["
		       "{\"id\":0,\"channelId\":1},{\"channelId\":4294967295,\"id\":2,\"x\":[]}]}"),
		 0);
	CHECK_EQ(request.op, FOXGLOVE_SUBSCRIBE);
	CHECK_EQ(request.count, 2);
	CHECK_EQ(request.item[0].id, 0);
	CHECK_EQ(request.item[0].channel, 1);
	CHECK_EQ(request.item[1].id, 2);
	CHECK_EQ(request.item[1].channel, UINT32_MAX);
}

TEST(web_protocol, an_unsubscribe_request_gives_its_ids)
{
	CHECK_EQ(parse("{\"subscriptionIds\":[5,6],\"op\":\"unsubscribe\"}"), 0);
	CHECK_EQ(request.op, FOXGLOVE_UNSUBSCRIBE);
	CHECK_EQ(request.count, 2);
	CHECK_EQ(request.item[1].id, 6);
}

TEST(web_protocol, another_operation_is_recognised_as_such)
{
	CHECK_EQ(parse("{\"op\":\"setParameters\",\"parameters\":[]}"), 0);
	CHECK_EQ(request.op, FOXGLOVE_SET_PARAMETERS);
	CHECK_EQ(parse("{\"op\":\"getParameters\",\"parameterNames\":[]}"), 0);
	CHECK_EQ(request.op, FOXGLOVE_GET_PARAMETERS);
	CHECK_EQ(parse("{\"op\":\"callService\"}"), 0);
	CHECK_EQ(request.op, FOXGLOVE_OTHER);
}

TEST(web_protocol, what_is_not_of_the_protocol_is_rejected)
{
	static const char *const bad[] = {
		"",
		"null",
		"[]",
		"{}",
		"{\"op\":3}",
		"{\"op\":\"subscribe\"}",
		"{\"op\":\"subscribe\",\"subscriptions\":{}}",
		"{\"op\":\"subscribe\",\"subscriptions\":[{}]}",
		"{\"op\":\"subscribe\",\"subscriptions\":[3]}",
		"{\"op\":\"subscribe\",\"subscriptions\":[{\"id\":1}]}",
		"{\"op\":\"subscribe\",\"subscriptions\":[{\"id\":\"1\",\"channelId\":1}]}",
		"{\"op\":\"subscribe\",\"subscriptions\":[{\"id\":-1,\"channelId\":1}]}",
		"{\"op\":\"subscribe\",\"subscriptions\":[{\"id\":1.5,\"channelId\":1}]}",
		"{\"op\":\"subscribe\",\"subscriptions\":[{\"id\":4294967296,\"channelId\":1}]}",
		"{\"op\":\"subscribe\",\"subscriptions\":[{\"id\":1e999,\"channelId\":1}]}",
		"{\"op\":\"unsubscribe\",\"subscriptionIds\":[{}]}",
		"{\"op\":\"subscribe\",\"subscriptions\":[",
	};

	for (size_t i = 0; i < sizeof(bad) / sizeof(bad[0]); i++) {
		CHECK_EQ(parse(bad[i]), -EBADMSG);
	}
}

TEST(web_protocol, more_items_or_bytes_than_a_request_may_have_are_rejected)
{
	static char text[FOXGLOVE_REQUEST_BYTES + 2];
	size_t len = (size_t)snprintf(text, sizeof(text),
				      "{\"op\":\"unsubscribe\",\"subscriptionIds\":[0");

	for (int i = 0; i < FOXGLOVE_ITEMS; i++) {
		len += (size_t)snprintf(text + len, sizeof(text) - len, ",1");
	}
	snprintf(text + len, sizeof(text) - len, "]}");
	CHECK_EQ(parse(text), -E2BIG);
	memset(text, ' ', sizeof(text) - 1);
	memcpy(text, "{\"op\":\"x\"}", 10);
	CHECK_EQ(foxglove_parse(text, FOXGLOVE_REQUEST_BYTES, &request), 0);
	CHECK_EQ(foxglove_parse(text, FOXGLOVE_REQUEST_BYTES + 1, &request), -EBADMSG);
}

TEST(web_protocol, a_message_begins_with_its_subscription_and_time)
{
	uint8_t head[FOXGLOVE_MESSAGE_HEAD_BYTES];

	foxglove_message_head(0x01020304, 0x1122334455667788, head);
	CHECK_EQ(head[0], 1);
	CHECK_EQ(get_le32(head + 1), 0x01020304);
	CHECK_EQ(get_le64(head + 5), 0x1122334455667788);
}

TEST(web_protocol, a_status_is_one_object_whatever_its_text)
{
	char *text = foxglove_status(FOXGLOVE_WARNING, "a \"b\"\n");

	CHECK_STR(text, "{\"op\":\"status\",\"level\":1,\"message\":\"a \\\"b\\\"\\u000a\"}");
	free(text);
}
