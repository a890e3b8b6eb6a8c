/* SPDX-License-Identifier: MIT */
/* A number with its unit into a field. Exact: no float on the way to an integer. */
#include "config/number.h"

#include <errno.h>
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef __int128 wide_t; /* holds every 64-bit number, signed and unsigned, in the smallest unit */

struct unit {
	const char *name;
	int64_t scale;
};

static const struct unit time_units[] = {
	{ "ns", 1 },
	{ "us", 1000 },
	{ "ms", 1000000 },
	{ "s", 1000000000 },
	{ "min", INT64_C(60000000000) },
	{ "h", INT64_C(3600000000000) },
	{ "d", INT64_C(86400000000000) },
	{ NULL, 0 },
};

static const struct unit size_units[] = {
	{ "B", 1 },
	{ "kB", 1000 },
	{ "MB", 1000000 },
	{ "GB", 1000000000 },
	{ "TB", INT64_C(1000000000000) },
	{ "KiB", INT64_C(1) << 10 },
	{ "MiB", INT64_C(1) << 20 },
	{ "GiB", INT64_C(1) << 30 },
	{ "TiB", INT64_C(1) << 40 },
	{ NULL, 0 },
};

static const struct unit *unit_find(const struct unit *units, const char *name)
{
	for (; units->name != NULL; units++) {
		if (strcmp(units->name, name) == 0) {
			return units;
		}
	}
	return NULL;
}

/* The family of units that @option's own unit is of; NULL if it is a plain count. */
static const struct unit *units_of(const struct option *option)
{
	if (unit_find(time_units, option->unit) != NULL) {
		return time_units;
	}
	return unit_find(size_units, option->unit) != NULL ? size_units : NULL;
}

enum number_family number_unit_family(const struct option *option)
{
	const struct unit *units = units_of(option);

	if (units == NULL) {
		return NUMBER_PLAIN;
	}
	return units == time_units ? NUMBER_OF_TIME : NUMBER_OF_SIZE;
}

static int fail_unit(const struct option *option, const char *suffix, char *reason)
{
	const struct unit *units = units_of(option);

	if (units == time_units) {
		snprintf(reason, OPTION_WHY_BYTES,
			 "unknown unit \"%.16s\": ns, us, ms, s, min, h or d", suffix);
	} else if (units == size_units) {
		snprintf(reason, OPTION_WHY_BYTES,
			 "unknown unit \"%.16s\": B, KiB, MiB, GiB, TiB, kB, MB, GB or TB", suffix);
	} else if (option->unit[0] != '\0') {
		snprintf(reason, OPTION_WHY_BYTES, "unknown unit \"%.16s\": only %s", suffix,
			 option->unit);
	} else {
		snprintf(reason, OPTION_WHY_BYTES, "expected a plain number, without \"%.16s\"",
			 suffix);
	}
	return -EINVAL;
}

/* What a number with @suffix counts, in the smallest unit of its family. 0 if the suffix is wrong.
 */
static int64_t scale_of(const struct option *option, const char *suffix)
{
	const struct unit *units = units_of(option);
	const struct unit *unit;

	if (units == NULL) {
		return suffix[0] == '\0' || strcmp(suffix, option->unit) == 0;
	}
	unit = unit_find(units, suffix[0] == '\0' ? option->unit : suffix);
	return unit == NULL ? 0 : unit->scale;
}

/* What one step of the field is, in the smallest unit: durations and sizes are kept in ns and
 * bytes. */
static int64_t field_scale(const struct option *option)
{
	if (option->type == OPTION_DURATION || option->type == OPTION_SIZE ||
	    units_of(option) == NULL) {
		return 1;
	}
	return unit_find(units_of(option), option->unit)->scale;
}

/* A decimal number, kept as digits * 10^-places. */
struct decimal {
	wide_t digits;
	wide_t divisor; /* 10^places */
	const char *rest;
};

/* -EINVAL: no number; -ERANGE: more digits than any field holds. */
static int decimal_parse(const char *text, struct decimal *ret)
{
	const wide_t limit = (wide_t)1 << 66;
	struct decimal d = { .digits = 0, .divisor = 1 };
	int is_negative = text[0] == '-';
	int is_fraction = 0;
	const char *p = text + (is_negative || text[0] == '+');

	if (*p < '0' || *p > '9') {
		return -EINVAL;
	}
	for (; (*p >= '0' && *p <= '9') || (*p == '.' && !is_fraction); p++) {
		if (*p == '.') {
			is_fraction = 1;
			continue;
		}
		d.digits = d.digits * 10 + (*p - '0');
		d.divisor *= is_fraction ? 10 : 1;
		if (d.digits > limit || d.divisor > limit) {
			return -ERANGE;
		}
	}
	d.digits = is_negative ? -d.digits : d.digits;
	d.rest = p;
	*ret = d;
	return 0;
}

static int hex_parse(const char *text, struct decimal *ret)
{
	unsigned long long magnitude;
	char *end;

	errno = 0;
	magnitude = strtoull(text, &end, 16);
	if (end < text + 3 || *end != '\0') {
		return -EINVAL;
	}
	if (errno == ERANGE) {
		return -ERANGE;
	}
	*ret = (struct decimal){ .digits = (wide_t)magnitude, .divisor = 1, .rest = end };
	return 0;
}

static int fail_number(const struct option *option, const char *text, char *reason)
{
	const struct unit *units = units_of(option);
	const char *what = "a whole number";

	if (units == time_units) {
		what = "a duration such as 500us or 1ms";
	} else if (units == size_units) {
		what = "a size such as 256MiB";
	} else if (option->type == OPTION_NUMBER) {
		what = option->unit[0] == '%' ? "a share such as 50%" : "a number";
	}
	snprintf(reason, OPTION_WHY_BYTES, "expected %s, not \"%.32s\"", what, text);
	return -EINVAL;
}

static int fail_range(const struct option *option, const char *text, char *reason)
{
	snprintf(reason, OPTION_WHY_BYTES, "%.32s is out of range: %s to %s", text, option->min,
		 option->max);
	return -ERANGE;
}

static int fail_whole(const struct option *option, const char *text, char *reason)
{
	const char *step = option->unit;

	if (option->type == OPTION_DURATION) {
		step = "ns";
	} else if (option->type == OPTION_SIZE) {
		step = "bytes";
	} else if (step[0] == '\0') {
		return fail_number(option, text, reason);
	}
	snprintf(reason, OPTION_WHY_BYTES, "%.32s is not a whole number of %s", text, step);
	return -EINVAL;
}

/* Text to a whole number of the field's steps. */
static int whole_parse(const struct option *option, const char *text, wide_t *ret, char *reason)
{
	int is_hex = text[0] == '0' && (text[1] == 'x' || text[1] == 'X');
	struct decimal d;
	int64_t scale;
	wide_t step;
	int r = is_hex ? hex_parse(text, &d) : decimal_parse(text, &d);

	if (r < 0) {
		return r == -ERANGE ? fail_range(option, text, reason)
				    : fail_number(option, text, reason);
	}
	while (*d.rest == ' ') {
		d.rest++;
	}
	scale = scale_of(option, d.rest);
	if (scale == 0) {
		return fail_unit(option, d.rest, reason);
	}
	step = d.divisor * field_scale(option);
	/* |digits| <= 2^66 and scale < 2^47 */
	if (d.digits * scale % step != 0) {
		return fail_whole(option, text, reason);
	}
	*ret = d.digits * scale / step;
	return 0;
}

int number_parse_whole(const struct option *option, const char *text, void *base, char *reason)
{
	wide_t value;
	wide_t min;
	wide_t max;
	int r = whole_parse(option, text, &value, reason);

	if (r < 0) {
		return r;
	}
	if (whole_parse(option, option->min, &min, reason) < 0 ||
	    whole_parse(option, option->max, &max, reason) < 0) {
		return -EINVAL; /* a fault of the table; its test would have seen it */
	}
	if (value < min || value > max) {
		return fail_range(option, text, reason);
	}
	option_store(option, (uint64_t)value, base);
	return 0;
}

static int real_parse(const struct option *option, const char *text, double *ret, char *reason)
{
	const char *digits = text + (text[0] == '-' || text[0] == '+');
	char *end = NULL;
	double value;

	if (strcmp(digits, "inf") == 0 || strcmp(digits, ".inf") == 0) {
		*ret = text[0] == '-' ? -HUGE_VAL : HUGE_VAL;
		return 0;
	}
	/* strtod also takes "nan", "infinity" and hex floats; a file does not. */
	if (strchr("0123456789.", *digits) == NULL || *digits == '\0' ||
	    strpbrk(text, "xX") != NULL) {
		return fail_number(option, text, reason);
	}
	value = strtod(text, &end);
	if (end == text || (end == digits && *digits == '.')) {
		return fail_number(option, text, reason);
	}
	while (*end == ' ') {
		end++;
	}
	if (*end != '\0' && (option->unit[0] == '\0' || strcmp(end, option->unit) != 0)) {
		return fail_unit(option, end, reason);
	}
	*ret = value;
	return 0;
}

int number_parse_real(const struct option *option, const char *text, void *base, char *reason)
{
	double value;
	double min;
	double max;
	int r = real_parse(option, text, &value, reason);

	if (r < 0) {
		return r;
	}
	if (real_parse(option, option->min, &min, reason) < 0 ||
	    real_parse(option, option->max, &max, reason) < 0) {
		return -EINVAL; /* a fault of the table; its test would have seen it */
	}
	if (!(value >= min && value <= max)) {
		return fail_range(option, text, reason);
	}
	memcpy((char *)base + option->offset, &value, sizeof(value));
	return 0;
}

int number_lacks_unit(const struct option *option, const char *text)
{
	size_t len = strlen(text);

	return (units_of(option) != NULL || strcmp(option->unit, "%") == 0) && len > 0 &&
	       (strchr("0123456789.", text[len - 1]) != NULL);
}
