/* SPDX-License-Identifier: MIT */
/* Blocks as in draft-ietf-opsawg-pcapng, little-endian. */
#include "cli/pcapng.h"

#include <string.h>

#include "base/bytes.h"

enum {
	SECTION = 0x0a0d0d0a,
	SECTION_MAGIC = 0x1a2b3c4d,
	INTERFACE = 1,
	PACKET = 6,
	ETHERNET = 1,
	SNAP_BYTES = 65535,
	OPTION_END = 0,
	OPTION_INTERFACE_NAME = 2,
	OPTION_RESOLUTION = 9,
	OPTION_FLAGS = 2,
	OPTION_DROPPED = 4,
	RESOLUTION_NS = 9,
	NAME_MAX_BYTES = 31,
	HEAD_BYTES = 8, /* type and length; the length again at the end: 4 */
	OPTIONS_BYTES = 64,
};

struct block {
	uint8_t bytes[HEAD_BYTES + 20 + OPTIONS_BYTES];
	size_t len;
};

static void put32(struct block *b, uint32_t value)
{
	put_le32(b->bytes + b->len, value);
	b->len += 4;
}

static void put16(struct block *b, uint16_t value)
{
	put_le16(b->bytes + b->len, value);
	b->len += 2;
}

static size_t padding(size_t len)
{
	return (4 - len % 4) % 4;
}

static void put_option(struct block *b, uint16_t code, const void *value, size_t len)
{
	put16(b, code);
	put16(b, (uint16_t)len);
	memcpy(b->bytes + b->len, value, len);
	b->len += len;
	memset(b->bytes + b->len, 0, padding(len));
	b->len += padding(len);
}

static void begin(struct block *b, uint32_t type)
{
	b->len = 0;
	put32(b, type);
	put32(b, 0); /* the length, once it is known */
}

/* The block's length, at both ends, and out with it. */
static void end(struct block *b, FILE *out)
{
	put_le32(b->bytes + 4, (uint32_t)b->len + 4);
	put32(b, (uint32_t)b->len + 4);
	fwrite(b->bytes, 1, b->len, out);
}

void pcapng_put_head(FILE *out, const char *name)
{
	const uint8_t resolution = RESOLUTION_NS;
	struct block b;

	begin(&b, SECTION);
	put32(&b, SECTION_MAGIC);
	put16(&b, 1);
	put16(&b, 0);
	put32(&b, UINT32_MAX); /* length of the section: not known */
	put32(&b, UINT32_MAX);
	end(&b, out);
	begin(&b, INTERFACE);
	put16(&b, ETHERNET);
	put16(&b, 0);
	put32(&b, SNAP_BYTES);
	put_option(&b, OPTION_INTERFACE_NAME, name, strnlen(name, NAME_MAX_BYTES));
	put_option(&b, OPTION_RESOLUTION, &resolution, 1);
	put_option(&b, OPTION_END, "", 0);
	end(&b, out);
}

void pcapng_put_frame(FILE *out, const struct pcapng_frame *frame)
{
	static const uint8_t zeros[4];
	uint64_t time = (uint64_t)(frame->utc_ns > 0 ? frame->utc_ns : 0);
	uint8_t value[8];
	struct block head;
	struct block options = { .len = 0 };
	size_t total;

	put_le32(value, frame->direction);
	put_option(&options, OPTION_FLAGS, value, 4);
	if (frame->dropped > 0) {
		put_le64(value, frame->dropped);
		put_option(&options, OPTION_DROPPED, value, 8);
	}
	put_option(&options, OPTION_END, "", 0);
	begin(&head, PACKET);
	put32(&head, 0); /* the interface */
	put32(&head, (uint32_t)(time >> 32));
	put32(&head, (uint32_t)time);
	put32(&head, (uint32_t)frame->len);
	put32(&head, (uint32_t)frame->len);
	total = head.len + frame->len + padding(frame->len) + options.len + 4;
	put_le32(head.bytes + 4, (uint32_t)total);
	put32(&options, (uint32_t)total);
	fwrite(head.bytes, 1, head.len, out);
	fwrite(frame->bytes, 1, frame->len, out);
	fwrite(zeros, 1, padding(frame->len), out);
	fwrite(options.bytes, 1, options.len, out);
}
