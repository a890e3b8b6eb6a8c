/* SPDX-License-Identifier: MIT */
/*
 * Units of CoE objects as SDO information gives them (ETG.1004): from the top, a byte each, the
 * power of ten (two's complement), the numerator, the denominator, and one that is 0. The codes of
 * numerator and denominator are those that CiA 402 has in 0x60A8 and 0x60A9: 0xfd260000 is mV,
 * 0xff410000 tenths of a degree, 0x00b44700 revolutions per minute. Context: any.
 */
#ifndef WIRE_COE_UNIT_H
#define WIRE_COE_UNIT_H

#include <stdint.h>

enum { COE_UNIT_BYTES = 16 };

/**
 * The text of @code in ASCII: "mV", "degC", "1/min", "1e-5 V" where there is no prefix for it. 1;
 * 0 and "": there is no unit, or one that is not known here.
 */
int coe_unit_format(uint32_t code, char ret[COE_UNIT_BYTES]);

#endif
