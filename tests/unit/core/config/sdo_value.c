/* SPDX-License-Identifier: MIT */
#include "config/sdo_value.h"

#include <errno.h>

#include "harness/test.h"

static uint64_t bits_of(enum sdo_type type, const char *text)
{
	uint64_t bits = 77;

	if (sdo_value_parse(type, text, &bits) != 0) {
		test_fail(__FILE__, __LINE__, "%s refused as %s", text, sdo_type_to_str(type));
	}
	return bits;
}

static void fails(enum sdo_type type, const char *text, int wanted)
{
	uint64_t bits = 77;

	CHECK_EQ(sdo_value_parse(type, text, &bits), wanted);
	CHECK_EQ(bits, 77);
}

TEST(sdo_value, types_are_found_by_name)
{
	CHECK_EQ(sdo_type_find("UDINT"), SDO_UDINT);
	CHECK_EQ(sdo_type_find("udint"), SDO_UDINT);
	CHECK_EQ(sdo_type_find("U32"), -ENOENT);
	CHECK_EQ(sdo_type_bytes(SDO_LREAL), 8);
}

TEST(sdo_value, bounds_of_every_integer_type_are_exact)
{
	CHECK_EQ(bits_of(SDO_SINT, "-128"), 0x80);
	fails(SDO_SINT, "-129", -ERANGE);
	fails(SDO_SINT, "128", -ERANGE);
	CHECK_EQ(bits_of(SDO_SINT, "0xff"), 0xff);
	fails(SDO_SINT, "0x100", -ERANGE);
	CHECK_EQ(bits_of(SDO_USINT, "255"), 255);
	fails(SDO_USINT, "256", -ERANGE);
	fails(SDO_USINT, "-1", -ERANGE);
	CHECK_EQ(bits_of(SDO_ULINT, "18446744073709551615"), UINT64_MAX);
	fails(SDO_ULINT, "18446744073709551616", -ERANGE);
	CHECK_EQ(bits_of(SDO_LINT, "-9223372036854775808"), UINT64_C(1) << 63);
	fails(SDO_LINT, "9223372036854775808", -ERANGE);
}

TEST(sdo_value, invalid_text_is_rejected)
{
	fails(SDO_UINT, "", -EINVAL);
	fails(SDO_UINT, "-", -EINVAL);
	fails(SDO_UINT, "0x", -EINVAL);
	fails(SDO_UINT, "12 ", -EINVAL);
	fails(SDO_UINT, " 12", -EINVAL);
	fails(SDO_UINT, "1.5", -EINVAL);
	fails(SDO_BOOL, "2", -EINVAL);
	fails(SDO_REAL, "nan", -EINVAL);
	fails(SDO_REAL, "1e39", -ERANGE);
	fails(SDO_LREAL, "1e309", -ERANGE);
}

TEST(sdo_value, parsed_values_are_printed_as_the_same_text)
{
	static const struct {
		enum sdo_type type;
		const char *text;
	} cases[] = {
		{ SDO_BOOL, "true" },
		{ SDO_SINT, "-1" },
		{ SDO_INT, "-32768" },
		{ SDO_DINT, "2147483647" },
		{ SDO_UDINT, "4294967295" },
		{ SDO_LINT, "-9223372036854775808" },
		{ SDO_REAL, "0.5" },
		{ SDO_LREAL, "-1.25" },
		{ SDO_ULINT, "18446744073709551615" },
	};
	char text[32];

	for (size_t i = 0; i < sizeof(cases) / sizeof(cases[0]); i++) {
		sdo_value_format(cases[i].type, bits_of(cases[i].type, cases[i].text), text,
				 sizeof(text));
		CHECK_STR(text, cases[i].text);
	}
}
