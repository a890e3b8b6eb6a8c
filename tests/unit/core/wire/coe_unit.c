/* SPDX-License-Identifier: MIT */
/* Units of CoE objects: the code of ETG.1004 and its text. */
#include "wire/coe_unit.h"

#include "harness/test.h"

static const char *text(uint32_t code)
{
	static char shown[COE_UNIT_BYTES];

	CHECK_EQ(coe_unit_format(code, shown), shown[0] != '\0');
	return shown;
}

TEST(coe_unit, a_code_is_prefix_numerator_and_denominator)
{
	CHECK_STR(text(0x00260000), "V");
	CHECK_STR(text(0xfd260000), "mV");
	CHECK_STR(text(0x00040000), "A");
	CHECK_STR(text(0xfa040000), "uA");
	CHECK_STR(text(0x002d0000), "degC");
	CHECK_STR(text(0x004e0000), "bar");
	CHECK_STR(text(0xfd030000), "ms");
	CHECK_STR(text(0xfd010000), "mm");
	CHECK_STR(text(0xfd010300), "mm/s");
	CHECK_STR(text(0xfd015700), "mm/s^2");
	CHECK_STR(text(0x00b44700), "rev/min");
	CHECK_STR(text(0x00004700), "1/min");
	CHECK_STR(text(0x00b50000), "inc");
	CHECK_STR(text(0x03220000), "kPa");
}

TEST(coe_unit, a_power_without_a_prefix_is_written_as_one)
{
	CHECK_STR(text(0xff2d0000), "1e-1 degC");
	CHECK_STR(text(0xff410000), "1e-1 deg");
	CHECK_STR(text(0xfb260000), "1e-5 V");
	CHECK_STR(text(0xfd020000), "1e-3 kg");
	CHECK_STR(text(0xfa580000), "1e-6 m^2");
	CHECK_STR(text(0x02220000), "1e2 Pa");
	CHECK_STR(text(0xfdb44700), "1e-3 rev/min");
}

TEST(coe_unit, what_is_no_unit_or_not_known_has_no_text)
{
	CHECK_STR(text(0), "");
	CHECK_STR(text(0xfd000000), "");
	CHECK_STR(text(0x00260001), ""); /* the last byte is 0 */
	CHECK_STR(text(0x00b60000), ""); /* of the vendors */
	CHECK_STR(text(0x00262600 | 0xff), "");
	CHECK_STR(text(0x0026fe00), "");
	CHECK_STR(text(0x80555700), ""); /* too long */
	for (uint32_t code = 0; code < 0x10000; code++) {
		text(code << 8 | 0x80000000);
	}
}
