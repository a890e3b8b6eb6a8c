/* SPDX-License-Identifier: MIT */
/*
 * Plain CDR (XCDR1), little-endian, as a flat final type has it: a 4-byte encapsulation header,
 * then each value aligned to its own size, counted from behind the header. Context: any, RT-safe.
 */
#ifndef RECORD_CDR_H
#define RECORD_CDR_H

#include <assert.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include "base/bytes.h"

enum { CDR_HEADER_BYTES = 4 };

struct cdr {
	uint8_t *data;
	size_t capacity;
	size_t len;
};

/** Where a value of @bytes (1, 2, 4, 8) goes if @len bytes of the message are there already. */
static inline size_t cdr_align(size_t len, size_t bytes)
{
	return CDR_HEADER_BYTES + (len - CDR_HEADER_BYTES + bytes - 1) / bytes * bytes;
}

static inline struct cdr cdr_begin(uint8_t *data, size_t capacity)
{
	assert(capacity >= CDR_HEADER_BYTES);
	data[0] = 0;
	data[1] = 1; /* CDR_LE */
	data[2] = 0;
	data[3] = 0;
	return (struct cdr){ data, capacity, CDR_HEADER_BYTES };
}

/** Append the lowest @bytes bytes of @value. */
static inline void cdr_put(struct cdr *c, uint64_t value, size_t bytes)
{
	size_t at = cdr_align(c->len, bytes);

	assert(at + bytes <= c->capacity);
	while (c->len < at) {
		c->data[c->len++] = 0;
	}
	put_le(c->data + at, (unsigned)bytes, value);
	c->len = at + bytes;
}

static inline void cdr_put_string(struct cdr *c, const char *text)
{
	size_t len = strlen(text) + 1; /* the closing zero is part of it */

	cdr_put(c, len, 4);
	assert(c->len + len <= c->capacity);
	memcpy(c->data + c->len, text, len);
	c->len += len;
}

#endif
