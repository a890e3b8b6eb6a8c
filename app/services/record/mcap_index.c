/* SPDX-License-Identifier: MIT */
#include "record/mcap_index.h"

#include <errno.h>
#include <stdlib.h>

#include "base/bytes.h"

int mcap_index_init(struct mcap_index *ix)
{
	*ix = (struct mcap_index){ .start_ns = UINT64_MAX };
	ix->has_schema = calloc(MCAP_CHANNEL_IDS, 1);
	ix->has_channel = calloc(MCAP_CHANNEL_IDS, 1);
	ix->channel_messages = calloc(MCAP_CHANNEL_IDS, sizeof(ix->channel_messages[0]));
	if (ix->has_schema == NULL || ix->has_channel == NULL || ix->channel_messages == NULL) {
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
	free(ix->has_schema);
	free(ix->has_channel);
	free(ix->channel_messages);
	*ix = (struct mcap_index){ .has_schema = NULL };
}

int mcap_index_schema(struct mcap_index *ix, const uint8_t *record, size_t record_len)
{
	uint16_t id;

	if (record_len < MCAP_HEAD_BYTES + 2) {
		return -EBADMSG;
	}
	id = get_le16(record + MCAP_HEAD_BYTES);
	if (!ix->has_schema[id]) {
		ix->has_schema[id] = 1;
		ix->schema_count++;
		mcap_buf_put(&ix->schemas, record, record_len);
	}
	return ix->schemas.error;
}

int mcap_index_channel(struct mcap_index *ix, const uint8_t *record, size_t record_len)
{
	uint16_t id;

	if (record_len < MCAP_HEAD_BYTES + 2) {
		return -EBADMSG;
	}
	id = get_le16(record + MCAP_HEAD_BYTES);
	if (!ix->has_channel[id]) {
		ix->has_channel[id] = 1;
		ix->channel_count++;
		mcap_buf_put(&ix->channels, record, record_len);
	}
	return ix->channels.error;
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
		ix->channel_messages[ch[i].id] += ch[i].messages;
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
