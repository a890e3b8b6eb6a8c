/* SPDX-License-Identifier: MIT */
#include "config/sdo_value.h"

#include <errno.h>
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

enum kind { KIND_BOOL, KIND_SIGNED, KIND_UNSIGNED, KIND_FLOAT };

static const struct {
	const char *name;
	enum kind kind;
	unsigned bytes;
} types[SDO_TYPES] = {
	[SDO_BOOL] = { "BOOL", KIND_BOOL, 1 },       [SDO_SINT] = { "SINT", KIND_SIGNED, 1 },
	[SDO_INT] = { "INT", KIND_SIGNED, 2 },       [SDO_DINT] = { "DINT", KIND_SIGNED, 4 },
	[SDO_LINT] = { "LINT", KIND_SIGNED, 8 },     [SDO_USINT] = { "USINT", KIND_UNSIGNED, 1 },
	[SDO_UINT] = { "UINT", KIND_UNSIGNED, 2 },   [SDO_UDINT] = { "UDINT", KIND_UNSIGNED, 4 },
	[SDO_ULINT] = { "ULINT", KIND_UNSIGNED, 8 }, [SDO_REAL] = { "REAL", KIND_FLOAT, 4 },
	[SDO_LREAL] = { "LREAL", KIND_FLOAT, 8 },
};

int sdo_type_find(const char *name)
{
	for (int i = 0; i < SDO_TYPES; i++) {
		if (strcasecmp(types[i].name, name) == 0) {
			return i;
		}
	}
	return -ENOENT;
}

const char *sdo_type_to_str(enum sdo_type type)
{
	return types[type].name;
}

unsigned sdo_type_bytes(enum sdo_type type)
{
	return types[type].bytes;
}

static uint64_t low_bits(unsigned bytes)
{
	return bytes >= 8 ? UINT64_MAX : (UINT64_C(1) << (8 * bytes)) - 1;
}

static int parse_bool(const char *text, uint64_t *ret_bits)
{
	static const char *const words[2][3] = { { "0", "false", "off" }, { "1", "true", "on" } };

	for (unsigned value = 0; value < 2; value++) {
		for (unsigned i = 0; i < 3; i++) {
			if (strcasecmp(text, words[value][i]) == 0) {
				*ret_bits = value;
				return 0;
			}
		}
	}
	return -EINVAL;
}

static int parse_float(unsigned bytes, const char *text, uint64_t *ret_bits)
{
	char *end;
	double d;
	float f;
	uint32_t half;

	if (strpbrk(text, "0123456789") == NULL) {
		return -EINVAL; /* no "nan", no "inf" */
	}
	d = strtod(text, &end);
	if (end == text || *end != '\0') {
		return -EINVAL;
	}
	f = (float)d;
	if (!isfinite(d) || (bytes == 4 && !isfinite(f))) {
		return -ERANGE;
	}
	if (bytes == 4) {
		memcpy(&half, &f, sizeof(half));
		*ret_bits = half;
	} else {
		memcpy(ret_bits, &d, sizeof(d));
	}
	return 0;
}

static int parse_integer(enum kind kind, unsigned bytes, const char *text, uint64_t *ret_bits)
{
	uint64_t limit = low_bits(bytes);
	int is_negative = text[0] == '-';
	unsigned long long magnitude;
	int is_hex;
	char *end;

	text += is_negative || text[0] == '+';
	if (text[0] < '0' || text[0] > '9') {
		return -EINVAL;
	}
	is_hex = text[0] == '0' && (text[1] == 'x' || text[1] == 'X');
	errno = 0;
	magnitude = strtoull(text, &end, is_hex ? 16 : 10);
	if (*end != '\0' || (is_hex && end == text + 1)) {
		return -EINVAL;
	}
	if (kind == KIND_SIGNED && (is_negative || !is_hex)) {
		limit = limit / 2 + (uint64_t)is_negative;
	} else if (is_negative && magnitude != 0) {
		return -ERANGE;
	}
	if (errno == ERANGE || magnitude > limit) {
		return -ERANGE;
	}
	*ret_bits = (is_negative ? 0 - (uint64_t)magnitude : (uint64_t)magnitude) & low_bits(bytes);
	return 0;
}

int sdo_value_parse(enum sdo_type type, const char *text, uint64_t *ret_bits)
{
	switch (types[type].kind) {
	case KIND_BOOL:
		return parse_bool(text, ret_bits);
	case KIND_FLOAT:
		return parse_float(types[type].bytes, text, ret_bits);
	case KIND_SIGNED:
	case KIND_UNSIGNED:
		return parse_integer(types[type].kind, types[type].bytes, text, ret_bits);
	}
	return -EINVAL;
}

int sdo_value_format(enum sdo_type type, uint64_t bits, char *buf, size_t buf_len)
{
	unsigned bytes = types[type].bytes;
	uint64_t sign = UINT64_C(1) << (8 * bytes - 1);
	uint32_t half = (uint32_t)bits;
	double d;
	float f;

	bits &= low_bits(bytes);
	switch (types[type].kind) {
	case KIND_BOOL:
		return snprintf(buf, buf_len, "%s", bits != 0 ? "true" : "false");
	case KIND_SIGNED:
		return snprintf(buf, buf_len, "%" PRId64, (int64_t)((bits ^ sign) - sign));
	case KIND_UNSIGNED:
		return snprintf(buf, buf_len, "%" PRIu64, bits);
	case KIND_FLOAT:
		memcpy(&f, &half, sizeof(f));
		memcpy(&d, &bits, sizeof(d));
		return snprintf(buf, buf_len, "%.*g", bytes == 4 ? 9 : 17,
				bytes == 4 ? (double)f : d);
	}
	return snprintf(buf, buf_len, "?");
}
