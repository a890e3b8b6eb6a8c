/* SPDX-License-Identifier: MIT */
#include "wire/coe_unit.h"

#include <stddef.h>
#include <stdio.h>
#include <string.h>

struct notation {
	uint8_t code;
	uint8_t has_prefix; /* mV, but not mkg, mmin or mm^2 */
	char symbol[6];
};

/* Vendors give the codes from 0xb6 on different meanings: none of them. */
static const struct notation notations[] = {
	{ 0x01, 1, "m" },   { 0x02, 0, "kg" },    { 0x03, 1, "s" },    { 0x04, 1, "A" },
	{ 0x05, 1, "K" },   { 0x06, 1, "mol" },   { 0x07, 1, "cd" },   { 0x10, 1, "rad" },
	{ 0x11, 1, "sr" },  { 0x20, 1, "Hz" },    { 0x21, 1, "N" },    { 0x22, 1, "Pa" },
	{ 0x23, 1, "J" },   { 0x24, 1, "W" },     { 0x25, 1, "C" },    { 0x26, 1, "V" },
	{ 0x27, 1, "F" },   { 0x28, 1, "Ohm" },   { 0x29, 1, "S" },    { 0x2a, 1, "Wb" },
	{ 0x2b, 1, "T" },   { 0x2c, 1, "H" },     { 0x2d, 0, "degC" }, { 0x2e, 1, "lm" },
	{ 0x2f, 1, "lx" },  { 0x41, 0, "deg" },   { 0x44, 1, "l" },    { 0x47, 0, "min" },
	{ 0x48, 0, "h" },   { 0x49, 0, "d" },     { 0x4b, 1, "g" },    { 0x4c, 0, "t" },
	{ 0x4e, 1, "bar" }, { 0x55, 0, "m/s^2" }, { 0x56, 1, "Nm" },   { 0x57, 0, "s^2" },
	{ 0x58, 0, "m^2" }, { 0x59, 0, "m^3" },   { 0xac, 0, "step" }, { 0xb4, 0, "rev" },
	{ 0xb5, 0, "inc" },
};

static const struct {
	int power;
	char symbol;
} prefixes[] = {
	{ -12, 'p' }, { -9, 'n' }, { -6, 'u' }, { -3, 'm' }, { -2, 'c' },
	{ -1, 'd' },  { 3, 'k' },  { 6, 'M' },  { 9, 'G' },  { 12, 'T' },
};

/* The notation of @code; NULL. */
static const struct notation *find(uint8_t code)
{
	for (size_t i = 0; i < sizeof(notations) / sizeof(notations[0]); i++) {
		if (notations[i].code == code) {
			return &notations[i];
		}
	}
	return NULL;
}

/* "m", "", or "1e-5 ". */
static void put_power(int power, int has_prefix, char ret[8])
{
	ret[0] = '\0';
	for (size_t i = 0; has_prefix && i < sizeof(prefixes) / sizeof(prefixes[0]); i++) {
		if (prefixes[i].power == power) {
			ret[0] = prefixes[i].symbol;
			ret[1] = '\0';
			return;
		}
	}
	if (power != 0) {
		snprintf(ret, 8, "1e%d ", power);
	}
}

int coe_unit_format(uint32_t code, char ret[COE_UNIT_BYTES])
{
	static const struct notation one = { 0, 0, "1" };
	uint8_t above = (uint8_t)(code >> 16);
	uint8_t below = (uint8_t)(code >> 8);
	const struct notation *numerator = above == 0 ? &one : find(above);
	const struct notation *denominator = below == 0 ? &one : find(below);
	char power[8];
	char text[2 * COE_UNIT_BYTES];

	ret[0] = '\0';
	if ((code & 0xff) != 0 || (above == 0 && below == 0) || numerator == NULL ||
	    denominator == NULL) {
		return 0;
	}
	put_power((int8_t)(code >> 24), numerator->has_prefix, power);
	snprintf(text, sizeof(text), "%s%.5s%s%.5s", power, numerator->symbol,
		 below == 0 ? "" : "/", below == 0 ? "" : denominator->symbol);
	if (strlen(text) >= COE_UNIT_BYTES) {
		return 0;
	}
	memcpy(ret, text, strlen(text) + 1);
	return 1;
}
