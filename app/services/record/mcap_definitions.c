/* SPDX-License-Identifier: MIT */
#include "record/mcap_definitions.h"

#include <errno.h>

#include "base/bytes.h"
#include "record/mcap_chunk.h"

int mcap_definitions_read_summary(const struct mcap_source *source, struct mcap_index *best)
{
	struct mcap_reader *reader;
	struct mcap_item item;
	int r = mcap_reader_create_summary(source, &reader);

	if (r == -ENODATA || r == -EBADMSG || r == -EPROTO) {
		return 0;
	}
	if (r < 0) {
		return r;
	}
	while ((r = mcap_reader_next(reader, &item)) > 0) {
		if (item.kind == MCAP_ITEM_SCHEMA || item.kind == MCAP_ITEM_CHANNEL) {
			r = mcap_index_define(best, item.record, item.record_len);
		}
		if (r < 0) {
			break;
		}
	}
	mcap_reader_destroy(reader);
	return r;
}

static int define_all(struct mcap_index *best, const struct mcap_buf *records)
{
	struct mcap_inner inner;
	size_t offset = 0;
	int r = 0;

	while (r == 0 && mcap_chunk_next(records->data, records->len, &offset, &inner) > 0) {
		r = mcap_index_define(best, inner.content - MCAP_HEAD_BYTES,
				      inner.content_len + MCAP_HEAD_BYTES);
	}
	return r;
}

/* Channel @id and its schema. */
static int define_channel(struct mcap_index *best, const struct mcap_index *data, uint16_t id)
{
	const uint8_t *channel = data->channels.data + data->channel_at[id] - 1;
	uint32_t schema_at = data->schema_at[get_le16(channel + MCAP_HEAD_BYTES + 2)];
	const uint8_t *schema = data->schemas.data + schema_at - 1;
	int r = 0;

	if (schema_at != 0) {
		r = mcap_index_define(best, schema, MCAP_HEAD_BYTES + (size_t)get_le64(schema + 1));
	}
	return r < 0 ? r
		     : mcap_index_define(best, channel,
					 MCAP_HEAD_BYTES + (size_t)get_le64(channel + 1));
}

int mcap_definitions_complete(struct mcap_index *best, const struct mcap_index *data)
{
	int r = 0;

	if (best->schema_count + best->channel_count == 0) {
		r = define_all(best, &data->schemas);
		return r < 0 ? r : define_all(best, &data->channels);
	}
	for (uint32_t id = 0; id < data->channel_end && r == 0; id++) {
		if (data->channel_messages[id] > 0 && data->channel_at[id] != 0 &&
		    !mcap_index_can_read(best, (uint16_t)id)) {
			r = define_channel(best, data, (uint16_t)id);
		}
	}
	return r;
}

const char *mcap_definitions_missing(const struct mcap_index *data, const struct mcap_index *best)
{
	struct mcap_inner inner;
	size_t offset = 0;

	for (uint32_t id = 0; id < data->channel_end; id++) {
		if (data->channel_messages[id] > 0 && !mcap_index_can_read(data, (uint16_t)id)) {
			return "messages of a channel that is not defined";
		}
	}
	while (mcap_chunk_next(data->channels.data, data->channels.len, &offset, &inner) > 0) {
		if (!mcap_index_has_schema_of(data, inner.content - MCAP_HEAD_BYTES)) {
			return "a channel with a schema that is not defined";
		}
	}
	return data->schema_count < best->schema_count || data->channel_count < best->channel_count
		       ? "a schema or channel is in the summary only"
		       : NULL;
}

int mcap_definitions_fit(const struct mcap_index *best, const uint8_t *records, size_t records_len)
{
	struct mcap_inner inner;
	size_t offset = 0;

	while (mcap_chunk_next(records, records_len, &offset, &inner) > 0) {
		const uint8_t *record = inner.content - MCAP_HEAD_BYTES;

		if (inner.opcode == MCAP_OP_MESSAGE &&
		    !mcap_index_can_read(best, get_le16(inner.content))) {
			return 0;
		}
		if (inner.opcode == MCAP_OP_CHANNEL && !mcap_index_has_schema_of(best, record)) {
			return 0;
		}
		if ((inner.opcode == MCAP_OP_SCHEMA || inner.opcode == MCAP_OP_CHANNEL) &&
		    mcap_index_contradicts(best, record, inner.content_len + MCAP_HEAD_BYTES)) {
			return 0;
		}
	}
	return 1;
}

static int put(const struct mcap_index *best, const struct mcap_buf *records, struct mcap_writer *w)
{
	struct mcap_inner inner;
	size_t offset = 0;
	int r = 0;

	while (r == 0 && mcap_chunk_next(records->data, records->len, &offset, &inner) > 0) {
		const uint8_t *record = inner.content - MCAP_HEAD_BYTES;

		if (inner.opcode == MCAP_OP_SCHEMA || mcap_index_has_schema_of(best, record)) {
			r = mcap_writer_copy(w, record, inner.content_len + MCAP_HEAD_BYTES);
		}
	}
	return r;
}

int mcap_definitions_put(const struct mcap_index *best, struct mcap_writer *w)
{
	int r = put(best, &best->schemas, w);

	return r < 0 ? r : put(best, &best->channels, w);
}
