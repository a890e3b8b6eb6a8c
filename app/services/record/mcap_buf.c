/* SPDX-License-Identifier: MIT */
#include "record/mcap_buf.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

#include "base/bytes.h"
#include "base/utf8.h"

void mcap_buf_done(struct mcap_buf *b)
{
	free(b->data);
	*b = (struct mcap_buf){ .data = NULL };
}

void mcap_buf_clear(struct mcap_buf *b)
{
	b->len = 0;
	b->error = 0;
}

uint8_t *mcap_buf_grow(struct mcap_buf *b, size_t len)
{
	uint8_t *at;

	if (b->error < 0) {
		return NULL;
	}
	if (len > b->capacity - b->len) {
		size_t capacity =
			b->capacity * 2 > b->len + len ? b->capacity * 2 : b->len + len + 64;
		uint8_t *data = realloc(b->data, capacity);

		if (data == NULL) {
			b->error = -ENOMEM;
			return NULL;
		}
		b->data = data;
		b->capacity = capacity;
	}
	at = b->data + b->len;
	b->len += len;
	return at;
}

void mcap_buf_put(struct mcap_buf *b, const void *data, size_t len)
{
	uint8_t *at = len > 0 ? mcap_buf_grow(b, len) : NULL;

	if (at != NULL) {
		memcpy(at, data, len);
	}
}

void mcap_buf_u8(struct mcap_buf *b, uint8_t v)
{
	mcap_buf_put(b, &v, 1);
}

void mcap_buf_u16(struct mcap_buf *b, uint16_t v)
{
	uint8_t bytes[2];

	put_le16(bytes, v);
	mcap_buf_put(b, bytes, sizeof(bytes));
}

void mcap_buf_u32(struct mcap_buf *b, uint32_t v)
{
	uint8_t bytes[4];

	put_le32(bytes, v);
	mcap_buf_put(b, bytes, sizeof(bytes));
}

void mcap_buf_u64(struct mcap_buf *b, uint64_t v)
{
	uint8_t bytes[8];

	put_le64(bytes, v);
	mcap_buf_put(b, bytes, sizeof(bytes));
}

void mcap_buf_string(struct mcap_buf *b, const char *text)
{
	size_t left = strlen(text);
	size_t start = b->len;

	mcap_buf_u32(b, 0);
	while (left > 0) {
		size_t n = utf8_len(text, left);

		if (n > 0) {
			mcap_buf_put(b, text, n);
		} else {
			mcap_buf_put(b, UTF8_REPLACEMENT, strlen(UTF8_REPLACEMENT));
			n = 1;
		}
		text += n;
		left -= n;
	}
	if (b->error == 0) {
		put_le32(b->data + start, (uint32_t)(b->len - start - 4));
	}
}

void mcap_buf_pairs(struct mcap_buf *b, const struct mcap_pair *pairs, size_t count)
{
	size_t start = b->len;

	mcap_buf_u32(b, 0);
	for (size_t i = 0; i < count; i++) {
		mcap_buf_string(b, pairs[i].key);
		mcap_buf_string(b, pairs[i].value);
	}
	if (b->error == 0) {
		put_le32(b->data + start, (uint32_t)(b->len - start - 4));
	}
}

size_t mcap_buf_begin(struct mcap_buf *b, enum mcap_opcode opcode)
{
	size_t start = b->len;

	mcap_buf_u8(b, (uint8_t)opcode);
	mcap_buf_u64(b, 0);
	return start;
}

void mcap_buf_end(struct mcap_buf *b, size_t start)
{
	if (b->error == 0) {
		put_le64(b->data + start + 1, b->len - start - MCAP_HEAD_BYTES);
	}
}
