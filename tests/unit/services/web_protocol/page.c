/* SPDX-License-Identifier: MIT */
#include "web/page.h"

#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/bytes.h"
#include "harness/test.h"

static struct page_request request;
static struct history_picture picture;

static int parse(const char *text)
{
	return page_parse(text, strlen(text), &request);
}

TEST(web_protocol, a_page_asks_for_values_and_pictures)
{
	CHECK_EQ(parse("{\"op\":\"values\",\"on\":true}"), 0);
	CHECK_EQ(request.op, PAGE_VALUES);
	CHECK_EQ(request.is_on, 1);
	CHECK_EQ(parse("{\"op\":\"draw\",\"id\":3,\"cycles\":2000,\"pixels\":800,\"end\":0,"
		       "\"channels\":[0,4],\"edge\":\"falling\",\"trigger\":4,\"level\":-1.5,"
		       "\"before\":500}"),
		 0);
	CHECK_EQ(request.op, PAGE_DRAW);
	CHECK_EQ(request.id, 3);
	CHECK_EQ(request.draw.cycles, 2000);
	CHECK_EQ(request.draw.count, 2);
	CHECK_EQ(request.draw.channel[1], 4);
	CHECK_EQ(request.draw.trigger.kind, TRIGGER_FALLING);
	CHECK(request.draw.trigger.level == -1.5);
	CHECK_EQ(request.draw.trigger.before, 500);
}

TEST(web_protocol, each_trigger_has_the_fields_that_it_requires)
{
#define DRAW                                                                                       \
	"{\"op\":\"draw\",\"id\":1,\"cycles\":9,\"pixels\":9,\"end\":0,\"channels\":[],"           \
	"\"before\":1,"
	CHECK_EQ(parse(DRAW "\"edge\":\"leaves\",\"trigger\":2,\"level\":1,\"level2\":3,"
			    "\"hold\":50,\"last\":7}"),
		 0);
	CHECK_EQ(request.draw.trigger.kind, TRIGGER_LEAVES);
	CHECK_EQ(request.draw.trigger.hold, 50);
	CHECK_EQ(request.draw.trigger.last, 7);
	CHECK(request.draw.trigger.level2 == 3);
	CHECK_EQ(parse(DRAW "\"edge\":\"leaves\",\"trigger\":2,\"level\":1}"), -EBADMSG);
	CHECK_EQ(parse(DRAW "\"edge\":\"above\",\"trigger\":2}"), -EBADMSG);
	CHECK_EQ(parse(DRAW "\"edge\":\"bad\",\"trigger\":2}"), 0);
	CHECK_EQ(parse(DRAW "\"edge\":\"bad\"}"), -EBADMSG);
	CHECK_EQ(parse(DRAW "\"edge\":\"lost\"}"), 0);
	CHECK_EQ(parse(DRAW "\"edge\":\"lost\",\"hold\":-1}"), -EBADMSG);
	CHECK_EQ(parse(DRAW "\"edge\":\"event\",\"severity\":\"warning\"}"), 0);
	CHECK_EQ(request.severity, EVENT_WARNING);
	CHECK_EQ(parse(DRAW "\"edge\":\"event\",\"severity\":\"bad\"}"), -EBADMSG);
	CHECK_EQ(parse(DRAW "\"edge\":\"event\"}"), -EBADMSG);
#undef DRAW
}

TEST(web_protocol, what_a_page_never_asks_is_rejected)
{
#define DRAW "{\"op\":\"draw\",\"id\":1,\"cycles\":9,\"pixels\":9,"
	static const char *const bad[] = {
		"",
		"{}",
		"[]",
		"{\"op\":\"set\",\"channel\":\"a.led\",\"value\":1}",
		DRAW "\"end\":0}",
		DRAW "\"end\":-1,\"channels\":[]}",
		DRAW "\"end\":0.5,\"channels\":[]}",
		DRAW "\"end\":1e300,\"channels\":[]}",
		DRAW "\"end\":0,\"channels\":[0,1,2,3,4,5,6,7,8]}",
		DRAW "\"end\":0,\"channels\":[\"a\"]}",
		DRAW "\"end\":0,\"channels\":[-1]}",
		DRAW "\"end\":0,\"channels\":[],\"edge\":\"up\"}",
		DRAW "\"end\":0,\"channels\":[],\"edge\":\"rising\"}",
		DRAW "\"end\":0,\"channels\":[],\"edge\":\"rising\",\"level\":0,\"before\":1e9,"
		     "\"trigger\":0}",
	};

	for (size_t i = 0; i < sizeof(bad) / sizeof(bad[0]); i++) {
		CHECK_EQ(parse(bad[i]), -EBADMSG);
	}
	CHECK_EQ(parse(DRAW "\"end\":0,\"channels\":[]}"), 0);
#undef DRAW
}

TEST(web_protocol, a_picture_is_a_text_then_columns_then_marks)
{
	const struct history_request draw = { .count = 1, .channel = { 5 } };
	static uint8_t buf[1024];
	float value;
	uint32_t bits;
	size_t len;
	size_t text;

	picture.first = 100;
	picture.cycles = 2;
	picture.pixels = 2;
	picture.sum[0] = (struct history_sum){ .min = (double)NAN, .mean = 0.5 };
	picture.column[0][0] = (struct history_column){ 1, 3 };
	picture.column[0][1] = (struct history_column){ 2, 4 };
	picture.mark[1] = HISTORY_BAD;
	len = page_picture(&draw, &picture, 9, buf, sizeof(buf));
	text = get_le32(buf);
	CHECK_EQ(text % 4, 0);
	CHECK_EQ(len, 4 + text + 2 * 8 + 2);
	CHECK(memcmp(buf + 4, "{\"op\":\"picture\",\"id\":9,\"first\":100,", 35) == 0);
	CHECK(strstr((const char *)buf + 4, "\"min\":null") != NULL);
	bits = get_le32(buf + 4 + text + 4); /* the second column's min */
	memcpy(&value, &bits, sizeof(value));
	CHECK(value == 2);
	CHECK_EQ(buf[len - 1], HISTORY_BAD);
	CHECK_EQ(page_picture(&draw, &picture, 9, buf, len - 1), 0);
}

TEST(web_protocol, values_that_are_not_good_are_null)
{
	const double value[] = { 1.5, (double)NAN };
	char *text = page_values(value, 2, 7);

	CHECK_STR(text, "{\"op\":\"values\",\"cycle\":7,\"values\":[1.5,null]}");
	free(text);
}

TEST(web_protocol, a_page_without_a_master_has_a_table_without_channels)
{
	char *text = page_table(NULL, 2000);

	CHECK_STR(text, "{\"op\":\"table\",\"session\":\"\",\"period_ns\":0,"
			"\"recorded_ms\":2000,\"slaves\":[],\"channels\":[]}");
	free(text);
}
