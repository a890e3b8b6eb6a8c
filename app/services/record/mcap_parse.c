/* SPDX-License-Identifier: MIT */
#include "record/mcap_parse.h"

#include <errno.h>
#include <stdio.h>
#include <string.h>

#include <libdeflate.h>

#include "base/bytes.h"
#include "base/utf8.h"
#include "record/mcap.h"

/* A place in a record; what does not fit sets error and reads as zero. */
struct cursor {
	const uint8_t *at;
	size_t left;
	int error;
};

static const uint8_t *take(struct cursor *c, uint64_t len)
{
	const uint8_t *at = c->at;

	if (c->error < 0 || len > c->left) {
		c->error = -EBADMSG;
		return NULL;
	}
	c->at += len;
	c->left -= (size_t)len;
	return at;
}

static uint16_t take_u16(struct cursor *c)
{
	const uint8_t *p = take(c, 2);

	return p != NULL ? get_le16(p) : 0;
}

static uint32_t take_u32(struct cursor *c)
{
	const uint8_t *p = take(c, 4);

	return p != NULL ? get_le32(p) : 0;
}

static uint64_t take_u64(struct cursor *c)
{
	const uint8_t *p = take(c, 8);

	return p != NULL ? get_le64(p) : 0;
}

static int is_utf8(const uint8_t *p, size_t len)
{
	const char *text = (const char *)p;
	size_t n = 1;

	for (; len > 0 && n > 0; text += n, len -= n) {
		n = utf8_len(text, len);
	}
	return n > 0;
}

/* Text is UTF-8 by the specification; readers in other languages refuse a file that has other. */
static struct mcap_text take_text(struct cursor *c)
{
	uint32_t len = take_u32(c);
	const uint8_t *p = take(c, len);

	if (p == NULL || !is_utf8(p, len)) {
		c->error = -EBADMSG;
		return (struct mcap_text){ "", 0 };
	}
	return (struct mcap_text){ (const char *)p, len };
}

/* An array of bytes with its length before it. */
static void take_bytes(struct cursor *c, uint64_t len, struct mcap_item *item)
{
	item->data = take(c, len);
	item->data_len = item->data != NULL ? (size_t)len : 0;
}

static int pairs_are_sound(const struct mcap_item *item)
{
	struct mcap_text key;
	struct mcap_text value;
	size_t offset = 0;
	int r;

	while ((r = mcap_pairs_next(item->data, item->data_len, &offset, &key, &value)) > 0) {
	}
	return r == 0;
}

static void parse_channel(struct cursor *c, struct mcap_item *item)
{
	item->id = take_u16(c);
	item->schema_id = take_u16(c);
	item->name = take_text(c);
	item->encoding = take_text(c);
	take_bytes(c, take_u32(c), item);
	if (c->error == 0 && !pairs_are_sound(item)) {
		c->error = -EBADMSG;
	}
}

static void parse_schema(struct cursor *c, struct mcap_item *item)
{
	item->id = take_u16(c);
	item->name = take_text(c);
	item->encoding = take_text(c);
	take_bytes(c, take_u32(c), item);
}

static void parse_message(struct cursor *c, struct mcap_item *item)
{
	item->id = take_u16(c);
	item->sequence = take_u32(c);
	item->log_time_ns = take_u64(c);
	item->publish_time_ns = take_u64(c);
	take_bytes(c, c->left, item);
}

static void parse_attachment(struct cursor *c, struct mcap_item *item)
{
	const uint8_t *start = c->at;
	size_t covered;
	uint32_t crc;

	item->log_time_ns = take_u64(c);
	take_u64(c); /* create time */
	item->name = take_text(c);
	item->encoding = take_text(c);
	take_bytes(c, take_u64(c), item);
	covered = (size_t)(c->at - start);
	crc = take_u32(c);
	if (c->error == 0 && crc != 0 && crc != libdeflate_crc32(0, start, covered)) {
		c->error = -EBADMSG;
	}
}

static void parse_metadata(struct cursor *c, struct mcap_item *item)
{
	item->name = take_text(c);
	take_bytes(c, take_u32(c), item);
	if (c->error == 0 && !pairs_are_sound(item)) {
		c->error = -EBADMSG;
	}
}

static void parse_statistics(struct cursor *c, struct mcap_item *item)
{
	take(c, 8 + 2 + 4 * 4); /* numbers of records */
	item->log_time_ns = take_u64(c);
	item->publish_time_ns = take_u64(c);
	take_bytes(c, take_u32(c), item);
}

uint64_t mcap_statistics_count(const struct mcap_item *item, uint16_t id)
{
	for (size_t at = 0; at + 10 <= item->data_len; at += 10) {
		if (get_le16(item->data + at) == id) {
			return get_le64(item->data + at + 2);
		}
	}
	return 0;
}

int mcap_parse_record(struct mcap_item *item)
{
	struct cursor c = { .at = item->record + MCAP_HEAD_BYTES,
			    .left = item->record_len - MCAP_HEAD_BYTES };

	switch (item->record[0]) {
	case MCAP_OP_HEADER:
		item->kind = MCAP_ITEM_HEADER;
		item->name = take_text(&c);
		item->encoding = take_text(&c);
		break;
	case MCAP_OP_SCHEMA:
		item->kind = MCAP_ITEM_SCHEMA;
		parse_schema(&c, item);
		break;
	case MCAP_OP_CHANNEL:
		item->kind = MCAP_ITEM_CHANNEL;
		parse_channel(&c, item);
		break;
	case MCAP_OP_MESSAGE:
		item->kind = MCAP_ITEM_MESSAGE;
		parse_message(&c, item);
		break;
	case MCAP_OP_CHUNK:
		item->kind = MCAP_ITEM_CHUNK;
		break;
	case MCAP_OP_MESSAGE_INDEX:
		item->kind = MCAP_ITEM_MESSAGE_INDEX;
		item->id = take_u16(&c);
		if (take_u32(&c) != c.left) {
			return -EBADMSG;
		}
		break;
	case MCAP_OP_ATTACHMENT:
		item->kind = MCAP_ITEM_ATTACHMENT;
		parse_attachment(&c, item);
		break;
	case MCAP_OP_METADATA:
		item->kind = MCAP_ITEM_METADATA;
		parse_metadata(&c, item);
		break;
	case MCAP_OP_STATISTICS:
		item->kind = MCAP_ITEM_STATISTICS;
		parse_statistics(&c, item);
		break;
	case MCAP_OP_DATA_END:
		item->kind = MCAP_ITEM_DATA_END;
		item->crc = take_u32(&c);
		if (c.left > 0) { /* a record that ends the section must not be a damaged other */
			return -EBADMSG;
		}
		break;
	default:
		item->kind = MCAP_ITEM_OTHER;
		break;
	}
	return c.error;
}

int mcap_parse_chunk(const uint8_t *content, size_t content_len,
		     struct mcap_chunk_fields *ret_fields)
{
	struct cursor c = { .at = content, .left = content_len };
	struct mcap_chunk_fields f;

	take_u64(&c); /* start time */
	take_u64(&c); /* end time */
	f.uncompressed_len = take_u64(&c);
	f.crc = take_u32(&c);
	f.compression = take_text(&c);
	f.data_len = (size_t)take_u64(&c);
	f.data = take(&c, f.data_len);
	if (c.error < 0 || c.left > 0) {
		return -EBADMSG;
	}
	*ret_fields = f;
	return 0;
}

int mcap_pairs_next(const uint8_t *data, size_t data_len, size_t *offset, struct mcap_text *ret_key,
		    struct mcap_text *ret_value)
{
	struct cursor c = { .at = data + *offset, .left = data_len - *offset };
	struct mcap_text key;
	struct mcap_text value;

	if (c.left == 0) {
		return 0;
	}
	key = take_text(&c);
	value = take_text(&c);
	if (c.error < 0) {
		return -EBADMSG;
	}
	*offset = data_len - c.left;
	*ret_key = key;
	*ret_value = value;
	return 1;
}

int mcap_pairs_get(const struct mcap_item *item, const char *key, char *buf, size_t buf_len)
{
	struct mcap_text k;
	struct mcap_text v;
	size_t offset = 0;
	int r;

	while ((r = mcap_pairs_next(item->data, item->data_len, &offset, &k, &v)) > 0) {
		if (mcap_text_is(k, key)) {
			snprintf(buf, buf_len, "%.*s", (int)v.len, v.at);
			return 0;
		}
	}
	return r < 0 ? r : -ENOENT;
}

int mcap_text_is(struct mcap_text text, const char *wanted)
{
	return text.len == strlen(wanted) && memcmp(text.at, wanted, text.len) == 0;
}
