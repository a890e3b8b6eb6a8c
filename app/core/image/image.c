/* SPDX-License-Identifier: MIT */
#include "image/image.h"

#include <assert.h>
#include <errno.h>
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "image/field.h"

static uint64_t low_bits(unsigned bit_len)
{
	return bit_len >= 64 ? UINT64_MAX : (UINT64_C(1) << bit_len) - 1;
}

int image_channel_fits(const struct channel *ch, size_t image_bytes)
{
	uint64_t end = (uint64_t)ch->bit_offset + ch->bit_len;

	if (ch->bit_len < 1 || ch->bit_len > 64 || end > (uint64_t)image_bytes * 8) {
		return 0;
	}
	switch ((enum channel_type)ch->type) {
	case CHANNEL_BOOL:
		return ch->bit_len == 1;
	case CHANNEL_UINT:
	case CHANNEL_INT:
		return 1;
	case CHANNEL_FLOAT:
		return ch->bit_len == 32 || ch->bit_len == 64;
	}
	return 0;
}

uint64_t image_get_raw(const uint8_t *image, const struct channel *ch)
{
	return image_field_get(image, image_field_of(ch));
}

void image_set_raw(uint8_t *image, const struct channel *ch, uint64_t raw)
{
	image_field_set(image, image_field_of(ch), raw);
}

static int64_t sign_extended(const struct channel *ch, uint64_t raw)
{
	uint64_t sign;

	assert(ch->bit_len >= 1 && ch->bit_len <= 64);
	sign = UINT64_C(1) << (ch->bit_len - 1);
	return (int64_t)((raw ^ sign) - sign);
}

static double raw_to_double(const struct channel *ch, uint64_t raw)
{
	float f;
	double d;
	uint32_t bits = (uint32_t)raw;

	if (ch->type == CHANNEL_INT) {
		return (double)sign_extended(ch, raw);
	}
	if (ch->type != CHANNEL_FLOAT) {
		return (double)raw;
	}
	if (ch->bit_len == 32) {
		memcpy(&f, &bits, sizeof(f));
		return (double)f;
	}
	memcpy(&d, &raw, sizeof(d));
	return d;
}

double image_raw_to_physical(const struct channel *ch, uint64_t raw)
{
	return raw_to_double(ch, raw) * ch->scale + ch->offset;
}

double image_get_physical(const uint8_t *image, const struct channel *ch)
{
	return image_raw_to_physical(ch, image_get_raw(image, ch));
}

int image_is_outside(const struct channel *ch, double physical)
{
	return image_has_range(ch) && !(physical >= ch->min && physical <= ch->max);
}

int image_is_scaled(const struct channel *ch)
{
	return ch->scale != 1 || ch->offset != 0;
}

int image_has_range(const struct channel *ch)
{
	return ch->min < ch->max && (isfinite(ch->min) || isfinite(ch->max));
}

static uint64_t float_to_raw(const struct channel *ch, double value)
{
	uint64_t raw = 0;
	uint32_t bits;
	float f = (float)value;

	if (ch->bit_len == 32) {
		memcpy(&bits, &f, sizeof(bits));
		return bits;
	}
	memcpy(&raw, &value, sizeof(raw));
	return raw;
}

int image_physical_to_raw(const struct channel *ch, double physical, uint64_t *ret_raw)
{
	double value = (physical - ch->offset) / ch->scale;
	double low = ch->type == CHANNEL_INT ? -ldexp(1.0, ch->bit_len - 1) : 0.0;
	double above = ldexp(1.0, ch->type == CHANNEL_INT ? ch->bit_len - 1 : ch->bit_len);

	if (isnan(value)) {
		return -EINVAL;
	}
	if (ch->type == CHANNEL_BOOL) {
		/* Only what scale and offset lose in a double is rounded. */
		if (!(fabs(value) < 1e-9) && !(fabs(value - 1) < 1e-9)) {
			return -EINVAL;
		}
		*ret_raw = value > 0.5;
		return 0;
	}
	if (ch->type == CHANNEL_FLOAT) {
		*ret_raw = float_to_raw(ch, value);
		return 0;
	}
	value = nearbyint(value);
	if (value < low || value >= above) {
		return -ERANGE;
	}
	*ret_raw = (value < 0 ? (uint64_t)(int64_t)value : (uint64_t)value) & low_bits(ch->bit_len);
	return 0;
}

int image_raw_format(const struct channel *ch, uint64_t raw, char *buf, size_t buf_len)
{
	if (ch->type == CHANNEL_INT) {
		return snprintf(buf, buf_len, "%" PRId64, sign_extended(ch, raw));
	}
	if (ch->type == CHANNEL_FLOAT) {
		return snprintf(buf, buf_len, "%.*g", ch->bit_len == 32 ? 9 : 17,
				raw_to_double(ch, raw));
	}
	return snprintf(buf, buf_len, "%" PRIu64, raw);
}

static int parse_bool(const char *text, uint64_t *ret_raw)
{
	static const char *const words[2][4] = { { "0", "false", "off", "no" },
						 { "1", "true", "on", "yes" } };

	for (unsigned value = 0; value < 2; value++) {
		for (unsigned i = 0; i < 4; i++) {
			if (strcasecmp(text, words[value][i]) == 0) {
				*ret_raw = value;
				return 0;
			}
		}
	}
	return -EINVAL;
}

static int parse_int(const struct channel *ch, const char *text, uint64_t *ret_raw)
{
	uint64_t limit = low_bits(ch->bit_len);
	int is_negative = text[0] == '-';
	unsigned long long magnitude;
	char *end;

	if (is_negative || text[0] == '+') {
		text++;
	}
	if (text[0] < '0' || text[0] > '9') {
		return -EINVAL;
	}
	errno = 0;
	magnitude = strtoull(text, &end, text[0] == '0' && (text[1] | 0x20) == 'x' ? 16 : 10);
	if (*end != '\0') {
		return -EINVAL;
	}
	if (ch->type == CHANNEL_INT) {
		limit = is_negative ? limit / 2 + 1 : limit / 2;
	} else if (is_negative && magnitude != 0) {
		return -ERANGE;
	}
	if (errno == ERANGE || magnitude > limit) {
		return -ERANGE;
	}
	*ret_raw = (is_negative ? 0 - (uint64_t)magnitude : (uint64_t)magnitude) &
		   low_bits(ch->bit_len);
	return 0;
}

int image_raw_parse(const struct channel *ch, const char *text, uint64_t *ret_raw)
{
	double value;
	char *end;

	if (ch->type == CHANNEL_BOOL) {
		return parse_bool(text, ret_raw);
	}
	if (ch->type != CHANNEL_FLOAT) {
		return parse_int(ch, text, ret_raw);
	}
	value = strtod(text, &end);
	if (end == text || *end != '\0') {
		return -EINVAL;
	}
	*ret_raw = float_to_raw(ch, value);
	return 0;
}

int image_channel_find(const struct channel *channels, size_t count, const char *name)
{
	for (size_t i = 0; i < count; i++) {
		if (strncmp(channels[i].name, name, sizeof(channels[i].name)) == 0) {
			return (int)i;
		}
	}
	return -ENOENT;
}

int image_type_format(const struct channel *ch, char *buf, size_t buf_len)
{
	switch ((enum channel_type)ch->type) {
	case CHANNEL_BOOL:
		return snprintf(buf, buf_len, "BOOL");
	case CHANNEL_UINT:
		return snprintf(buf, buf_len, "UINT%u", ch->bit_len);
	case CHANNEL_INT:
		return snprintf(buf, buf_len, "INT%u", ch->bit_len);
	case CHANNEL_FLOAT:
		return snprintf(buf, buf_len, "FLOAT%u", ch->bit_len);
	}
	return snprintf(buf, buf_len, "type %u", ch->type);
}
