/* SPDX-License-Identifier: MIT */
/*
 * A growing buffer for MCAP records. A failed allocation sticks until mcap_buf_clear(): check
 * mcap_buf.error once at the end.
 */
#ifndef RECORD_MCAP_BUF_H
#define RECORD_MCAP_BUF_H

#include <stddef.h>
#include <stdint.h>

#include "record/mcap.h"

struct mcap_buf {
	uint8_t *data;
	size_t len;
	size_t capacity;
	int error; /* 0, or -ENOMEM */
};

void mcap_buf_done(struct mcap_buf *b);
void mcap_buf_clear(struct mcap_buf *b);
/** Room for @len more bytes at the end, uninitialised; NULL (and error) without memory. */
uint8_t *mcap_buf_grow(struct mcap_buf *b, size_t len);

void mcap_buf_put(struct mcap_buf *b, const void *data, size_t len);
void mcap_buf_u8(struct mcap_buf *b, uint8_t v);
void mcap_buf_u16(struct mcap_buf *b, uint16_t v);
void mcap_buf_u32(struct mcap_buf *b, uint32_t v);
void mcap_buf_u64(struct mcap_buf *b, uint64_t v);
/** With its length before it; U+FFFD for what is not UTF-8. */
void mcap_buf_string(struct mcap_buf *b, const char *text);
void mcap_buf_pairs(struct mcap_buf *b, const struct mcap_pair *pairs, size_t count);

/** Start a record of @opcode; its length is filled in by mcap_buf_end(), which takes what this
 * returned. */
size_t mcap_buf_begin(struct mcap_buf *b, enum mcap_opcode opcode);
void mcap_buf_end(struct mcap_buf *b, size_t start);

#endif
