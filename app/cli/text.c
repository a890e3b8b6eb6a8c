/* SPDX-License-Identifier: MIT */
#include "cli/text.h"

#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <string.h>
#include <time.h>

#include "base/clock.h"
#include "image/image.h"
#include "program/json.h"

const char *text_ns(int64_t ns, char buf[TEXT_BYTES])
{
	double magnitude = fabs((double)ns);

	if (magnitude < 1e3) {
		snprintf(buf, TEXT_BYTES, "%" PRId64 " ns", ns);
	} else if (magnitude < 1e6) {
		snprintf(buf, TEXT_BYTES, "%.4g us", (double)ns / 1e3);
	} else if (magnitude < 1e9) {
		snprintf(buf, TEXT_BYTES, "%.4g ms", (double)ns / 1e6);
	} else {
		snprintf(buf, TEXT_BYTES, "%.4g s", (double)ns / 1e9);
	}
	return buf;
}

const char *text_bytes(uint64_t bytes, char buf[TEXT_BYTES])
{
	static const char *const units[] = { "B", "KiB", "MiB", "GiB", "TiB", "PiB" };
	double value = (double)bytes;
	size_t unit = 0;

	while (value >= 1024 && unit < sizeof(units) / sizeof(units[0]) - 1) {
		value /= 1024;
		unit++;
	}
	snprintf(buf, TEXT_BYTES, unit == 0 ? "%.0f %s" : "%.1f %s", value, units[unit]);
	return buf;
}

const char *text_uptime(int64_t ns, char buf[TEXT_BYTES])
{
	int64_t s = ns < 0 ? 0 : ns / NS_PER_S;
	int64_t days = s / 86400;

	if (days > 0) {
		snprintf(buf, TEXT_BYTES, "%" PRId64 "d %d:%02d:%02d", days, (int)(s / 3600 % 24),
			 (int)(s / 60 % 60), (int)(s % 60));
	} else {
		snprintf(buf, TEXT_BYTES, "%d:%02d:%02d", (int)(s / 3600), (int)(s / 60 % 60),
			 (int)(s % 60));
	}
	return buf;
}

const char *text_utc(int64_t utc_ns, char buf[TEXT_BYTES])
{
	time_t s = (time_t)(utc_ns / NS_PER_S);
	struct tm tm;
	size_t len;

	if (utc_ns < 0 || gmtime_r(&s, &tm) == NULL) {
		snprintf(buf, TEXT_BYTES, "?");
		return buf;
	}
	len = strftime(buf, TEXT_BYTES, "%Y-%m-%dT%H:%M:%S", &tm);
	snprintf(buf + len, TEXT_BYTES - len, ".%03dZ", (int)(utc_ns / NS_PER_MS % 1000));
	return buf;
}

const char *text_plain(const char *text, char *buf, size_t buf_len)
{
	snprintf(buf, buf_len, "%s", text);
	for (char *p = buf; *p != '\0'; p++) {
		*p = *p < 0x20 || *p > 0x7e ? '?' : *p;
	}
	return buf;
}

/* Does the value need no scaling, so that its raw text is exact? */
static int is_exact(const struct channel *ch)
{
	return ch->type != CHANNEL_FLOAT && !image_is_scaled(ch);
}

const char *text_value(const struct channel *ch, uint64_t raw, char buf[TEXT_BYTES])
{
	if (is_exact(ch)) {
		image_raw_format(ch, raw, buf, TEXT_BYTES);
	} else {
		snprintf(buf, TEXT_BYTES, "%.9g", image_raw_to_physical(ch, raw));
	}
	return buf;
}

void text_value_json(struct json *js, const char *key, const struct channel *ch, uint64_t raw,
		     enum text_value_kind kind)
{
	uint64_t sign = UINT64_C(1) << (ch->bit_len - 1);

	if (kind == TEXT_PHYSICAL && !is_exact(ch)) {
		json_double(js, key, image_raw_to_physical(ch, raw));
	} else if (ch->type == CHANNEL_INT) {
		json_i64(js, key, (int64_t)((raw ^ sign) - sign));
	} else if (ch->type == CHANNEL_FLOAT) {
		struct channel plain = *ch;

		plain.scale = 1.0;
		plain.offset = 0.0;
		json_double(js, key, image_raw_to_physical(&plain, raw));
	} else {
		json_u64(js, key, raw);
	}
}
