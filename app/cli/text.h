/* SPDX-License-Identifier: MIT */
/* Quantities as people read them. Each writes into @buf and returns it. Context: any. */
#ifndef CLI_TEXT_H
#define CLI_TEXT_H

#include <stddef.h>
#include <stdint.h>

#include "base/sample.h"

enum { TEXT_BYTES = 32 };

/** "850 ns", "12.3 us", "1.05 ms", "2.5 s". */
const char *text_ns(int64_t ns, char buf[TEXT_BYTES]);
/** "512 B", "1.5 MiB". */
const char *text_bytes(uint64_t bytes, char buf[TEXT_BYTES]);
/** "0:01:23", "2d 3:04:05". */
const char *text_uptime(int64_t ns, char buf[TEXT_BYTES]);
/** CLOCK_REALTIME, ns, as "2026-01-02T03:04:05.678Z". */
const char *text_utc(int64_t utc_ns, char buf[TEXT_BYTES]);

/** @text for a terminal: printable ASCII, "?" for all else. */
const char *text_plain(const char *text, char *buf, size_t buf_len);

/** A channel's value in its unit, without the unit: exact where the channel is not scaled. */
const char *text_value(const struct channel *ch, uint64_t raw, char buf[TEXT_BYTES]);

enum text_value_kind { TEXT_RAW, TEXT_PHYSICAL };

struct json;
/** The same as a JSON number: exact integers, null for NaN; BOOL as 0 and 1. */
void text_value_json(struct json *js, const char *key, const struct channel *ch, uint64_t raw,
		     enum text_value_kind kind);

#endif
