/* SPDX-License-Identifier: MIT */
#include "record/mcap_index.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

#include "base/bytes.h"

int mcap_index_init(struct mcap_index *ix)
{
	*ix = (struct mcap_index){ .start_ns = UINT64_MAX };
	ix->schema_at = calloc(MCAP_CHANNEL_IDS, sizeof(ix->schema_at[0]));
	ix->channel_at = calloc(MCAP_CHANNEL_IDS, sizeof(ix->channel_at[0]));
	ix->channel_messages = calloc(MCAP_CHANNEL_IDS, sizeof(ix->channel_messages[0]));
	if (ix->schema_at == NULL || ix->channel_at == NULL || ix->channel_messages == NULL) {
		mcap_index_done(ix);
		return -ENOMEM;
	}
	return 0;
}

void mcap_index_done(struct mcap_index *ix)
{
	mcap_buf_done(&ix->schemas);
	mcap_buf_done(&ix->channels);
	mcap_buf_done(&ix->chunks);
	mcap_buf_done(&ix->attachments);
	mcap_buf_done(&ix->metadata);
	free(ix->schema_at);
	free(ix->channel_at);
	free(ix->channel_messages);
	*ix = (struct mcap_index){ .schema_at = NULL };
}

int mcap_index_define(struct mcap_index *ix, const uint8_t *record, size_t record_len)
{
	int is_schema = record[0] == MCAP_OP_SCHEMA;
	struct mcap_buf *b = is_schema ? &ix->schemas : &ix->channels;
	uint32_t *at = is_schema ? ix->schema_at : ix->channel_at;
	uint16_t id;

	if (record_len < MCAP_HEAD_BYTES + 4) { /* a channel: its id and its schema's */
		return -EBADMSG;
	}
	if (b->len > UINT32_MAX - MCAP_LIMIT_RECORD_BYTES) {
		return -ENOMEM;
	}
	id = get_le16(record + MCAP_HEAD_BYTES);
	if (at[id] == 0) {
		at[id] = (uint32_t)b->len + 1;
		mcap_buf_put(b, record, record_len);
		ix->schema_count += record[0] == MCAP_OP_SCHEMA;
		ix->channel_count += record[0] == MCAP_OP_CHANNEL;
	}
	return b->error;
}

int mcap_index_contradicts(const struct mcap_index *ix, const uint8_t *record, size_t record_len)
{
	int is_schema = record[0] == MCAP_OP_SCHEMA;
	const struct mcap_buf *b = is_schema ? &ix->schemas : &ix->channels;
	const uint32_t *at = is_schema ? ix->schema_at : ix->channel_at;
	uint32_t place = at[get_le16(record + MCAP_HEAD_BYTES)];

	/* The head has the length: as long as it is the same, so is the rest of the comparison. */
	return place != 0 && (memcmp(b->data + place - 1, record, MCAP_HEAD_BYTES) != 0 ||
			      memcmp(b->data + place - 1, record, record_len) != 0);
}

int mcap_index_has_schema_of(const struct mcap_index *ix, const uint8_t *channel_record)
{
	uint16_t schema_id = get_le16(channel_record + MCAP_HEAD_BYTES + 2);

	return schema_id == 0 || ix->schema_at[schema_id] != 0;
}

int mcap_index_can_read(const struct mcap_index *ix, uint16_t id)
{
	uint32_t place = ix->channel_at[id];

	return place != 0 && mcap_index_has_schema_of(ix, ix->channels.data + place - 1);
}

void mcap_index_count(struct mcap_index *ix, uint16_t id, uint64_t messages)
{
	ix->channel_messages[id] += messages;
	ix->channel_end = id >= ix->channel_end ? id + 1u : ix->channel_end;
}

static void count_chunk(struct mcap_index *ix, const struct mcap_chunk_index *messages)
{
	size_t count;
	const struct mcap_chunk_channel *ch = mcap_chunk_index_channels(messages, &count);

	ix->chunk_count++;
	if (count == 0) {
		return;
	}
	for (size_t i = 0; i < count; i++) {
		mcap_index_count(ix, ch[i].id, ch[i].messages);
	}
	ix->messages += mcap_chunk_index_messages(messages);
	if (mcap_chunk_index_start_ns(messages) < ix->start_ns) {
		ix->start_ns = mcap_chunk_index_start_ns(messages);
	}
	if (mcap_chunk_index_end_ns(messages) > ix->end_ns) {
		ix->end_ns = mcap_chunk_index_end_ns(messages);
	}
}

int mcap_index_chunk(struct mcap_index *ix, const struct mcap_chunk_place *place,
		     const struct mcap_chunk_index *messages)
{
	struct mcap_buf *b = &ix->chunks;
	size_t start = mcap_buf_begin(b, MCAP_OP_CHUNK_INDEX);
	uint64_t chunk_end = place->offset + place->record_len;
	size_t count;
	const struct mcap_chunk_channel *ch = mcap_chunk_index_channels(messages, &count);
	size_t index_len;

	mcap_chunk_index_bytes(messages, &index_len);
	mcap_buf_u64(b, mcap_chunk_index_start_ns(messages));
	mcap_buf_u64(b, mcap_chunk_index_end_ns(messages));
	mcap_buf_u64(b, place->offset);
	mcap_buf_u64(b, place->record_len);
	mcap_buf_u32(b, (uint32_t)(count * 10)); /* a map of u16 to u64 */
	for (size_t i = 0; i < count; i++) {
		mcap_buf_u16(b, ch[i].id);
		mcap_buf_u64(b, chunk_end + ch[i].index_offset);
	}
	mcap_buf_u64(b, index_len);
	mcap_buf_string(b, place->compression);
	mcap_buf_u64(b, place->compressed_len);
	mcap_buf_u64(b, place->uncompressed_len);
	mcap_buf_end(b, start);
	if (b->error == 0) {
		count_chunk(ix, messages);
	}
	return b->error;
}

/* The string at *@at with its length before it; *@at is moved behind. NULL if it does not fit. */
static const uint8_t *take_string(const uint8_t *content, size_t content_len, size_t *at)
{
	const uint8_t *string = content + *at;
	uint32_t len;

	if (*at > content_len || content_len - *at < 4) {
		return NULL;
	}
	len = get_le32(string);
	if (len > content_len - *at - 4) {
		return NULL;
	}
	*at += 4 + len;
	return string;
}

int mcap_index_metadata(struct mcap_index *ix, uint64_t offset, const uint8_t *record,
			size_t record_len)
{
	struct mcap_buf *b = &ix->metadata;
	size_t at = MCAP_HEAD_BYTES;
	const uint8_t *name = take_string(record, record_len, &at);
	size_t start;

	if (name == NULL) {
		return -EBADMSG;
	}
	start = mcap_buf_begin(b, MCAP_OP_METADATA_INDEX);
	mcap_buf_u64(b, offset);
	mcap_buf_u64(b, record_len);
	mcap_buf_put(b, name, (size_t)4 + get_le32(name));
	mcap_buf_end(b, start);
	ix->metadata_count += b->error == 0;
	return b->error;
}

int mcap_index_attachment(struct mcap_index *ix, uint64_t offset, const uint8_t *record,
			  size_t record_len)
{
	struct mcap_buf *b = &ix->attachments;
	size_t at = MCAP_HEAD_BYTES + 16;
	const uint8_t *name;
	const uint8_t *media_type;
	size_t start;

	if (record_len < at) {
		return -EBADMSG;
	}
	name = take_string(record, record_len, &at);
	media_type = name != NULL ? take_string(record, record_len, &at) : NULL;
	if (media_type == NULL || record_len - at < 8) {
		return -EBADMSG;
	}
	start = mcap_buf_begin(b, MCAP_OP_ATTACHMENT_INDEX);
	mcap_buf_u64(b, offset);
	mcap_buf_u64(b, record_len);
	mcap_buf_put(b, record + MCAP_HEAD_BYTES, 16); /* log time, create time */
	mcap_buf_put(b, record + at, 8);               /* data size */
	mcap_buf_put(b, name, (size_t)4 + get_le32(name));
	mcap_buf_put(b, media_type, (size_t)4 + get_le32(media_type));
	mcap_buf_end(b, start);
	ix->attachment_count += b->error == 0;
	return b->error;
}

int mcap_index_is_full(const struct mcap_index *ix)
{
	return ix->schemas.len + ix->channels.len + ix->chunks.len + ix->attachments.len +
		       ix->metadata.len >=
	       MCAP_LIMIT_INDEX_BYTES;
}
