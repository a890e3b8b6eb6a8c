/* SPDX-License-Identifier: MIT */
#include "program/json.h"

#include <math.h>

#include "harness/test.h"

/* One value in an array, as text without the brackets. */
static char *written(void (*write)(struct json *js))
{
	static char copy[1024];
	char *text = NULL;
	size_t len = 0;
	FILE *out = open_memstream(&text, &len);
	struct json js;

	CHECK(out != NULL);
	json_init(&js, out);
	json_array_begin(&js, NULL);
	write(&js);
	json_array_end(&js);
	json_end_line(&js);
	CHECK_EQ(fclose(out), 0);
	CHECK(len > 2 && len < sizeof(copy));
	memcpy(copy, text + 1, len - 3);
	copy[len - 3] = '\0';
	free(text);
	return copy;
}

static const char *text_in;
static double double_in;

static void write_text(struct json *js)
{
	json_text(js, NULL, text_in);
}

static void write_double(struct json *js)
{
	json_double(js, NULL, double_in);
}

static void text_is(const char *in, const char *wanted)
{
	text_in = in;
	CHECK_STR(written(write_text), wanted);
}

static void double_is(double in, const char *wanted)
{
	double_in = in;
	CHECK_STR(written(write_double), wanted);
}

TEST(json, text_is_escaped)
{
	text_is("", "\"\"");
	text_is("a\"b\\c", "\"a\\\"b\\\\c\"");
	text_is("a\nb\tc", "\"a\\u000ab\\u0009c\"");
	text_is("\x01\x1f\x7f", "\"\\u0001\\u001f\\u007f\"");
	text_is("/", "\"/\"");
}

TEST(json, utf8_is_kept_and_invalid_bytes_are_replaced)
{
	text_is("\xc2\xb5s", "\"\xc2\xb5s\"");
	text_is("\xe2\x82\xac", "\"\xe2\x82\xac\"");
	text_is("\xf0\x9f\x98\x80", "\"\xf0\x9f\x98\x80\"");
	text_is("\xb5s", "\"\xef\xbf\xbds\"");                               /* Latin-1 */
	text_is("\xc3", "\"\xef\xbf\xbd\"");                                 /* cut short */
	text_is("\xe2\x82", "\"\xef\xbf\xbd\xef\xbf\xbd\"");                 /* cut short */
	text_is("\xc0\xaf", "\"\xef\xbf\xbd\xef\xbf\xbd\"");                 /* overlong */
	text_is("\xe0\x80\xaf", "\"\xef\xbf\xbd\xef\xbf\xbd\xef\xbf\xbd\""); /* overlong */
	text_is("\xed\xa0\x80", "\"\xef\xbf\xbd\xef\xbf\xbd\xef\xbf\xbd\""); /* surrogate */
	text_is("\xf4\x90\x80\x80",
		"\"\xef\xbf\xbd\xef\xbf\xbd\xef\xbf\xbd\xef\xbf\xbd\""); /* beyond
									    U+10FFFF
									  */
}

TEST(json, floats_are_short_and_read_back_the_same)
{
	double_is(0.1, "0.1");
	double_is(1.0, "1");
	double_is(-2.5e-300, "-2.5e-300");
	double_is(1.0 / 3, "0.3333333333333333");
	double_is(4096 * 3.3 / 4096, "3.3");
	CHECK(strtod(written(write_double), NULL) == 4096 * 3.3 / 4096);
}

TEST(json, numbers_that_json_cannot_represent_are_null)
{
	double_is((double)NAN, "null");
	double_is(HUGE_VAL, "null");
	double_is(-HUGE_VAL, "null");
}

static void write_integers(struct json *js)
{
	json_u64(js, NULL, UINT64_MAX);
	json_i64(js, NULL, INT64_MIN);
	json_truth(js, NULL, 2);
	json_truth(js, NULL, 0);
	json_null(js, NULL);
}

TEST(json, integers_are_exact_at_64_bits)
{
	CHECK_STR(written(write_integers),
		  "18446744073709551615,-9223372036854775808,true,false,null");
}

static void write_nested(struct json *js)
{
	json_object_begin(js, NULL);
	json_object_begin(js, "a");
	json_object_end(js);
	json_array_begin(js, "b");
	json_u64(js, NULL, 1);
	json_object_begin(js, NULL);
	json_text(js, "k\"", "v");
	json_object_end(js);
	json_array_end(js);
	json_u64(js, "c", 3);
	json_object_end(js);
	json_array_begin(js, NULL);
	json_array_end(js);
}

TEST(json, commas_are_between_values_only)
{
	CHECK_STR(written(write_nested), "{\"a\":{},\"b\":[1,{\"k\\\"\":\"v\"}],\"c\":3},[]");
}

static void write_fixed(struct json *js)
{
	json_fixed(js, NULL, double_in, 1);
}

TEST(json, a_figure_has_the_requested_decimals)
{
	double_in = 2.25;
	CHECK_STR(written(write_fixed), "2.2");
	double_in = -0.96;
	CHECK_STR(written(write_fixed), "-1.0");
	double_in = NAN;
	CHECK_STR(written(write_fixed), "null");
}

TEST(json, a_part_of_a_text_ends_at_its_length_or_at_a_zero)
{
	char text[64];
	FILE *out = fmemopen(text, sizeof(text), "w");

	CHECK(out != NULL);
	json_put_text_n(out, "a\xe2\x82\xac", 3);
	json_put_text_n(out, "a\0b", 3);
	fclose(out);
	CHECK_STR(text, "\"a\xef\xbf\xbd\xef\xbf\xbd\"\"a\"");
}
