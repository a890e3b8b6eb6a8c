/* SPDX-License-Identifier: MIT */
#include "record/mcap_writer.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

#include <libdeflate.h>
#include <zstd.h>

#include "base/bytes.h"
#include "record/mcap_buf.h"
#include "record/mcap_chunk.h"
#include "record/mcap_summary.h"

struct mcap_writer {
	struct mcap_io io;
	struct mcap_index index;
	struct mcap_chunk_index *messages;
	struct mcap_buf chunk; /* the open chunk, uncompressed */
	struct mcap_buf out;   /* the record being written */
	ZSTD_CCtx *zstd;       /* NULL: uncompressed */
	uint64_t offset;       /* end of the last whole record in the file */
	uint32_t data_crc;     /* of all bytes before offset */
	uint64_t repeat_at;    /* definitions are repeated in a chunk that begins here or later */
	size_t repeated_len;   /* of definitions in the open chunk */
	uint16_t next_schema;
	uint32_t next_channel;
	int is_torn; /* there may be bytes after offset: truncate before writing */
};

int mcap_writer_create(const struct mcap_io *io, int zstd_level, struct mcap_writer **ret_writer)
{
	struct mcap_writer *w = calloc(1, sizeof(*w));
	int r = -ENOMEM;

	if (w == NULL) {
		return -ENOMEM;
	}
	w->io = *io;
	w->next_schema = 1;
	w->messages = mcap_chunk_index_create();
	if (w->messages == NULL || mcap_index_init(&w->index) < 0) {
		goto destroy;
	}
	if (zstd_level != 0) {
		w->zstd = ZSTD_createCCtx();
		if (w->zstd == NULL) {
			goto destroy;
		}
		if (ZSTD_isError(
			    ZSTD_CCtx_setParameter(w->zstd, ZSTD_c_compressionLevel, zstd_level))) {
			r = -EINVAL;
			goto destroy;
		}
	}
	*ret_writer = w;
	return 0;

destroy:
	mcap_writer_destroy(w);
	return r;
}

void mcap_writer_destroy(struct mcap_writer *w)
{
	if (w == NULL) {
		return;
	}
	ZSTD_freeCCtx(w->zstd);
	mcap_chunk_index_destroy(w->messages);
	mcap_index_done(&w->index);
	mcap_buf_done(&w->chunk);
	mcap_buf_done(&w->out);
	free(w);
}

static int repair(struct mcap_writer *w)
{
	int r;

	if (!w->is_torn) {
		return 0;
	}
	r = w->io.truncate(w->io.ctx, w->offset);
	w->is_torn = r < 0;
	return r;
}

/* Append w->out; on failure cut back to where the file was. */
static int write_out(struct mcap_writer *w)
{
	int r = w->out.error < 0 ? w->out.error : repair(w);

	if (r < 0) {
		return r;
	}
	r = w->io.write(w->io.ctx, w->out.data, w->out.len);
	if (r < 0) {
		w->is_torn = 1;
		repair(w);
		return r;
	}
	w->offset += w->out.len;
	w->data_crc = libdeflate_crc32(w->data_crc, w->out.data, w->out.len);
	return 0;
}

/* Append the one record in w->out and note it in the index. */
static int put_record(struct mcap_writer *w)
{
	uint64_t offset = w->offset;
	int r = write_out(w);

	if (r < 0) {
		return r;
	}
	switch (w->out.data[0]) {
	case MCAP_OP_SCHEMA:
	case MCAP_OP_CHANNEL:
		return mcap_index_define(&w->index, w->out.data, w->out.len);
	case MCAP_OP_ATTACHMENT:
		return mcap_index_attachment(&w->index, offset, w->out.data, w->out.len);
	case MCAP_OP_METADATA:
		return mcap_index_metadata(&w->index, offset, w->out.data, w->out.len);
	default:
		return 0;
	}
}

int mcap_writer_begin(struct mcap_writer *w, const char *profile, const char *library)
{
	size_t start;

	mcap_buf_clear(&w->out);
	mcap_buf_put(&w->out, MCAP_MAGIC, MCAP_MAGIC_BYTES);
	start = mcap_buf_begin(&w->out, MCAP_OP_HEADER);
	mcap_buf_string(&w->out, profile);
	mcap_buf_string(&w->out, library);
	mcap_buf_end(&w->out, start);
	return write_out(w);
}

void mcap_writer_resume(struct mcap_writer *w, uint64_t offset, uint32_t data_crc,
			struct mcap_index *index)
{
	mcap_index_done(&w->index);
	w->index = *index;
	*index = (struct mcap_index){ .schema_at = NULL };
	w->offset = offset;
	w->data_crc = data_crc;
	w->is_torn = 1;
}

int mcap_writer_schema(struct mcap_writer *w, const char *name, const char *encoding,
		       const char *text)
{
	size_t start;
	int r;

	if (w->next_schema == UINT16_MAX) {
		return -ENOSPC;
	}
	mcap_buf_clear(&w->out);
	start = mcap_buf_begin(&w->out, MCAP_OP_SCHEMA);
	mcap_buf_u16(&w->out, w->next_schema);
	mcap_buf_string(&w->out, name);
	mcap_buf_string(&w->out, encoding);
	mcap_buf_string(&w->out, text);
	mcap_buf_end(&w->out, start);
	r = put_record(w);
	return r < 0 ? r : w->next_schema++;
}

int mcap_writer_channel(struct mcap_writer *w, const struct mcap_channel_spec *spec)
{
	size_t start;
	int r;

	if (w->next_channel == MCAP_CHANNEL_IDS) {
		return -ENOSPC;
	}
	mcap_buf_clear(&w->out);
	start = mcap_buf_begin(&w->out, MCAP_OP_CHANNEL);
	mcap_buf_u16(&w->out, (uint16_t)w->next_channel);
	mcap_buf_u16(&w->out, spec->schema_id);
	mcap_buf_string(&w->out, spec->topic);
	mcap_buf_string(&w->out, spec->message_encoding);
	mcap_buf_pairs(&w->out, spec->pairs, spec->pair_count);
	mcap_buf_end(&w->out, start);
	r = put_record(w);
	return r < 0 ? r : (int)w->next_channel++;
}

size_t mcap_writer_room(const struct mcap_writer *w)
{
	return MCAP_LIMIT_CHUNK_BYTES - (w->chunk.len - w->repeated_len);
}

/* Begin the open chunk with all schemas and channels, if it is time. */
static int repeat_definitions(struct mcap_writer *w)
{
	if (w->chunk.len > 0 || w->offset < w->repeat_at) {
		return 0;
	}
	mcap_buf_put(&w->chunk, w->index.schemas.data, w->index.schemas.len);
	mcap_buf_put(&w->chunk, w->index.channels.data, w->index.channels.len);
	if (w->chunk.error < 0) {
		mcap_buf_clear(&w->chunk);
		return -ENOMEM;
	}
	w->repeated_len = w->chunk.len;
	return 0;
}

int mcap_writer_message(struct mcap_writer *w, const struct mcap_message *m)
{
	size_t whole = MCAP_MESSAGE_COST_BYTES + m->data_len;
	uint8_t *at;

	if (whole > mcap_writer_room(w)) {
		return -ENOBUFS;
	}
	at = repeat_definitions(w) == 0 ? mcap_buf_grow(&w->chunk, whole) : NULL;
	if (at != NULL && mcap_chunk_index_add(w->messages, m->channel_id, m->log_time_ns,
					       w->chunk.len - whole) < 0) {
		w->chunk.len -= whole;
		at = NULL;
	}
	if (at == NULL) {
		w->chunk.error = 0; /* the messages in it are still good */
		if (w->chunk.len == w->repeated_len) {
			w->chunk.len = 0;
			w->repeated_len = 0;
		}
		return -ENOMEM;
	}
	at[0] = MCAP_OP_MESSAGE;
	put_le64(at + 1, whole - MCAP_HEAD_BYTES);
	put_le16(at + 9, m->channel_id);
	put_le32(at + 11, m->sequence);
	put_le64(at + 15, m->log_time_ns);
	put_le64(at + 23, m->publish_time_ns);
	if (m->data_len > 0) {
		memcpy(at + MCAP_MESSAGE_COST_BYTES, m->data, m->data_len);
	}
	return 0;
}

int mcap_writer_close_chunk(struct mcap_writer *w)
{
	struct mcap_chunk_place place = { .offset = w->offset,
					  .compression = w->zstd != NULL ? "zstd" : "",
					  .uncompressed_len = w->chunk.len };
	const uint8_t *index;
	size_t index_len;
	int64_t content_len;
	int r;

	if (w->chunk.len == 0) {
		return 0;
	}
	r = mcap_chunk_index_finish(w->messages);
	if (r < 0) {
		return r;
	}
	mcap_buf_clear(&w->out);
	content_len = mcap_chunk_put(&w->out, w->messages, w->chunk.data, w->chunk.len, w->zstd);
	if (content_len < 0) {
		return (int)content_len;
	}
	place.record_len = w->out.len;
	place.compressed_len = (uint64_t)content_len;
	index = mcap_chunk_index_bytes(w->messages, &index_len);
	mcap_buf_put(&w->out, index, index_len);
	r = write_out(w);
	if (r < 0) {
		return r;
	}
	mcap_buf_clear(&w->chunk);
	if (w->repeated_len > 0) {
		w->repeat_at = w->offset + (uint64_t)MCAP_REPEAT_FACTOR * w->repeated_len;
		w->repeated_len = 0;
	}
	r = mcap_index_chunk(&w->index, &place, w->messages);
	mcap_chunk_index_clear(w->messages);
	return r;
}

int mcap_writer_metadata(struct mcap_writer *w, const char *name, const struct mcap_pair *pairs,
			 size_t pair_count)
{
	size_t start;
	int r = mcap_writer_close_chunk(w);

	if (r < 0) {
		return r;
	}
	mcap_buf_clear(&w->out);
	start = mcap_buf_begin(&w->out, MCAP_OP_METADATA);
	mcap_buf_string(&w->out, name);
	mcap_buf_pairs(&w->out, pairs, pair_count);
	mcap_buf_end(&w->out, start);
	return put_record(w);
}

int mcap_writer_attachment(struct mcap_writer *w, const char *name, const char *media_type,
			   uint64_t time_ns, const void *data, size_t data_len)
{
	size_t start;
	int r = mcap_writer_close_chunk(w);

	if (r < 0) {
		return r;
	}
	mcap_buf_clear(&w->out);
	start = mcap_buf_begin(&w->out, MCAP_OP_ATTACHMENT);
	mcap_buf_u64(&w->out, time_ns);
	mcap_buf_u64(&w->out, time_ns);
	mcap_buf_string(&w->out, name);
	mcap_buf_string(&w->out, media_type);
	mcap_buf_u64(&w->out, data_len);
	mcap_buf_put(&w->out, data, data_len);
	if (w->out.error == 0) {
		/* Over all fields before it, without the record's head. */
		mcap_buf_u32(&w->out, libdeflate_crc32(0, w->out.data + MCAP_HEAD_BYTES,
						       (w->out.len - MCAP_HEAD_BYTES)));
	}
	mcap_buf_end(&w->out, start);
	return put_record(w);
}

int mcap_writer_copy(struct mcap_writer *w, const uint8_t *record, size_t record_len)
{
	mcap_buf_clear(&w->out);
	mcap_buf_put(&w->out, record, record_len);
	return put_record(w);
}

int mcap_writer_copy_chunk(struct mcap_writer *w, const uint8_t *record, size_t record_len,
			   const char *compression, size_t uncompressed_len,
			   const struct mcap_chunk_index *messages)
{
	struct mcap_chunk_place place = {
		.offset = w->offset,
		.record_len = record_len,
		.compression = compression,
		.uncompressed_len = uncompressed_len,
		.compressed_len = mcap_chunk_content_len(record_len, strlen(compression)),
	};
	const uint8_t *index;
	size_t index_len;
	int r;

	index = mcap_chunk_index_bytes(messages, &index_len);
	mcap_buf_clear(&w->out);
	mcap_buf_put(&w->out, record, record_len);
	mcap_buf_put(&w->out, index, index_len);
	r = write_out(w);
	return r < 0 ? r : mcap_index_chunk(&w->index, &place, messages);
}

int mcap_writer_cut(struct mcap_writer *w, uint64_t bytes)
{
	return w->io.truncate(w->io.ctx, bytes);
}

int mcap_writer_sync(struct mcap_writer *w)
{
	return w->io.sync(w->io.ctx);
}

int mcap_writer_finish(struct mcap_writer *w)
{
	uint64_t data_end;
	uint32_t data_crc;
	int r = mcap_writer_close_chunk(w);

	if (r < 0) {
		return r;
	}
	data_end = w->offset;
	data_crc = w->data_crc;
	mcap_buf_clear(&w->out);
	mcap_summary_put(&w->index, data_end, data_crc, &w->out);
	r = write_out(w);
	if (r < 0) {
		return r;
	}
	r = mcap_writer_sync(w);
	if (r < 0) {
		w->offset = data_end;
		w->data_crc = data_crc;
		w->is_torn = 1;
		repair(w);
	}
	return r;
}

uint64_t mcap_writer_bytes(const struct mcap_writer *w)
{
	return w->offset;
}

uint64_t mcap_writer_summary_bytes(const struct mcap_writer *w)
{
	return mcap_summary_bytes(&w->index);
}

int mcap_writer_is_full(const struct mcap_writer *w)
{
	return mcap_index_is_full(&w->index);
}

const struct mcap_index *mcap_writer_index(const struct mcap_writer *w)
{
	return &w->index;
}
