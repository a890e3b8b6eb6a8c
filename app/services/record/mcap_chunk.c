/* SPDX-License-Identifier: MIT */
#include "record/mcap_chunk.h"

#include <assert.h>
#include <errno.h>
#include <stdlib.h>
#include <string.h>

#include <libdeflate.h>

#include "base/bytes.h"
#include "record/mcap_parse.h"

enum {
	ENTRY_BYTES = 16,                          /* time and offset of one message */
	INDEX_HEAD_BYTES = MCAP_HEAD_BYTES + 2 + 4 /* record head, channel, length of the array */
};

/* A message: where it is in the chunk. */
struct entry {
	uint64_t log_time_ns;
	uint32_t offset;
	uint16_t id;
};

static_assert(MCAP_LIMIT_RECORD_BYTES <= UINT32_MAX, "entry.offset");

struct mcap_chunk_index {
	struct mcap_chunk_channel *channel; /* those seen, ascending once built */
	size_t channel_count;
	size_t channel_capacity;
	uint32_t *slot;      /* by channel id: 1 + its place in channel[]; 0: not seen */
	uint32_t *fill;      /* by place: next free byte in bytes */
	struct entry *entry; /* in the order of the chunk */
	size_t entry_capacity;
	struct mcap_buf bytes;
	uint64_t start_ns;
	uint64_t end_ns;
	uint64_t messages;
};

int mcap_chunk_next(const uint8_t *records, size_t records_len, size_t *offset,
		    struct mcap_inner *ret_inner)
{
	size_t left = records_len - *offset;
	uint64_t content_len;

	if (left == 0) {
		return 0;
	}
	if (left < MCAP_HEAD_BYTES) {
		return -EBADMSG;
	}
	content_len = get_le64(records + *offset + 1);
	if (content_len > left - MCAP_HEAD_BYTES) {
		return -EBADMSG;
	}
	if (records[*offset] == MCAP_OP_MESSAGE && content_len < MCAP_MESSAGE_HEAD_BYTES) {
		return -EBADMSG;
	}
	*ret_inner = (struct mcap_inner){ .opcode = records[*offset],
					  .content = records + *offset + MCAP_HEAD_BYTES,
					  .content_len = (size_t)content_len,
					  .offset = *offset };
	*offset += MCAP_HEAD_BYTES + (size_t)content_len;
	return 1;
}

size_t mcap_chunk_content_len(size_t record_len, size_t compression_len)
{
	/* Head; start, end, size, CRC; length and name of the compression; length of the content.
	 */
	return record_len - MCAP_HEAD_BYTES - 28 - 4 - compression_len - 8;
}

struct mcap_chunk_index *mcap_chunk_index_create(void)
{
	struct mcap_chunk_index *ix = calloc(1, sizeof(*ix));

	if (ix == NULL) {
		return NULL;
	}
	ix->slot = calloc(MCAP_CHANNEL_IDS, sizeof(ix->slot[0]));
	if (ix->slot == NULL) {
		free(ix);
		return NULL;
	}
	mcap_chunk_index_clear(ix);
	return ix;
}

void mcap_chunk_index_destroy(struct mcap_chunk_index *ix)
{
	if (ix == NULL) {
		return;
	}
	mcap_buf_done(&ix->bytes);
	free(ix->entry);
	free(ix->channel);
	free(ix->fill);
	free(ix->slot);
	free(ix);
}

void mcap_chunk_index_clear(struct mcap_chunk_index *ix)
{
	for (size_t i = 0; i < ix->channel_count; i++) {
		ix->slot[ix->channel[i].id] = 0;
	}
	ix->channel_count = 0;
	ix->start_ns = UINT64_MAX;
	ix->end_ns = 0;
	ix->messages = 0;
	mcap_buf_clear(&ix->bytes);
}

static int add_channel(struct mcap_chunk_index *ix, uint16_t id)
{
	if (ix->channel_count == ix->channel_capacity) {
		size_t capacity = ix->channel_capacity * 2 + 16;
		struct mcap_chunk_channel *channel =
			realloc(ix->channel, capacity * sizeof(ix->channel[0]));
		uint32_t *fill;

		if (channel == NULL) {
			return -ENOMEM;
		}
		ix->channel = channel;
		fill = realloc(ix->fill, capacity * sizeof(ix->fill[0]));
		if (fill == NULL) {
			return -ENOMEM;
		}
		ix->fill = fill;
		ix->channel_capacity = capacity;
	}
	ix->channel[ix->channel_count++] = (struct mcap_chunk_channel){ .id = id };
	ix->slot[id] = (uint32_t)ix->channel_count;
	return 0;
}

/* Schemas and channels must be readable; of a message the length is enough. */
static int is_sound(const struct mcap_inner *inner)
{
	struct mcap_item item = { .record = inner->content - MCAP_HEAD_BYTES,
				  .record_len = inner->content_len + MCAP_HEAD_BYTES };

	return mcap_parse_record(&item) == 0;
}

static int grow_entries(struct mcap_chunk_index *ix)
{
	size_t capacity = ix->entry_capacity * 2 + 256;
	struct entry *entry = realloc(ix->entry, capacity * sizeof(ix->entry[0]));

	if (entry == NULL) {
		return -ENOMEM;
	}
	ix->entry = entry;
	ix->entry_capacity = capacity;
	return 0;
}

int mcap_chunk_index_add(struct mcap_chunk_index *ix, uint16_t id, uint64_t log_time_ns,
			 size_t offset)
{
	if ((ix->messages == ix->entry_capacity && grow_entries(ix) < 0) ||
	    (ix->slot[id] == 0 && add_channel(ix, id) < 0)) {
		return -ENOMEM;
	}
	ix->entry[ix->messages++] = (struct entry){ log_time_ns, (uint32_t)offset, id };
	ix->channel[ix->slot[id] - 1].messages++;
	ix->start_ns = log_time_ns < ix->start_ns ? log_time_ns : ix->start_ns;
	ix->end_ns = log_time_ns > ix->end_ns ? log_time_ns : ix->end_ns;
	return 0;
}

static int by_id(const void *a, const void *b)
{
	return (int)((const struct mcap_chunk_channel *)a)->id -
	       (int)((const struct mcap_chunk_channel *)b)->id;
}

/* Heads of all index records, with room for their entries. */
static void lay_out(struct mcap_chunk_index *ix)
{
	if (ix->channel_count > 0) {
		qsort(ix->channel, ix->channel_count, sizeof(ix->channel[0]), by_id);
	}
	for (size_t i = 0; i < ix->channel_count; i++) {
		struct mcap_chunk_channel *ch = &ix->channel[i];
		size_t start = ix->bytes.len;
		size_t entries_len = (size_t)ch->messages * ENTRY_BYTES;

		ix->slot[ch->id] = (uint32_t)i + 1;
		ch->index_offset = (uint32_t)start;
		ix->fill[i] = (uint32_t)(start + INDEX_HEAD_BYTES);
		mcap_buf_begin(&ix->bytes, MCAP_OP_MESSAGE_INDEX);
		mcap_buf_u16(&ix->bytes, ch->id);
		mcap_buf_u32(&ix->bytes, (uint32_t)entries_len);
		mcap_buf_grow(&ix->bytes, entries_len);
		mcap_buf_end(&ix->bytes, start);
	}
}

int mcap_chunk_index_finish(struct mcap_chunk_index *ix)
{
	mcap_buf_clear(&ix->bytes);
	lay_out(ix);
	if (ix->bytes.error < 0) {
		return ix->bytes.error;
	}
	for (size_t i = 0; i < ix->messages; i++) {
		const struct entry *entry = &ix->entry[i];
		uint32_t *fill = &ix->fill[ix->slot[entry->id] - 1];

		put_le64(ix->bytes.data + *fill, entry->log_time_ns);
		put_le64(ix->bytes.data + *fill + 8, entry->offset);
		*fill += ENTRY_BYTES;
	}
	return 0;
}

int mcap_chunk_index_build(struct mcap_chunk_index *ix, const uint8_t *records, size_t records_len)
{
	struct mcap_inner inner;
	size_t offset = 0;
	int r;

	mcap_chunk_index_clear(ix);
	while ((r = mcap_chunk_next(records, records_len, &offset, &inner)) > 0) {
		if (inner.opcode != MCAP_OP_MESSAGE) {
			r = is_sound(&inner) ? 0 : -EBADMSG;
		} else {
			r = mcap_chunk_index_add(ix, get_le16(inner.content),
						 get_le64(inner.content + 6), inner.offset);
		}
		if (r < 0) {
			return r;
		}
	}
	return r < 0 ? r : mcap_chunk_index_finish(ix);
}

const uint8_t *mcap_chunk_index_bytes(const struct mcap_chunk_index *ix, size_t *ret_len)
{
	*ret_len = ix->bytes.len;
	return ix->bytes.data;
}

const struct mcap_chunk_channel *mcap_chunk_index_channels(const struct mcap_chunk_index *ix,
							   size_t *ret_count)
{
	*ret_count = ix->channel_count;
	return ix->channel;
}

uint64_t mcap_chunk_index_start_ns(const struct mcap_chunk_index *ix)
{
	return ix->messages == 0 ? 0 : ix->start_ns;
}

uint64_t mcap_chunk_index_end_ns(const struct mcap_chunk_index *ix)
{
	return ix->end_ns;
}

uint64_t mcap_chunk_index_messages(const struct mcap_chunk_index *ix)
{
	return ix->messages;
}

/* The content into @out, compressed if so wished. Returns its length there or -errno. */
static int64_t put_content(struct mcap_buf *out, const uint8_t *records, size_t records_len,
			   ZSTD_CCtx *zstd)
{
	size_t bound = zstd != NULL ? ZSTD_compressBound(records_len) : records_len;
	uint8_t *at = mcap_buf_grow(out, bound);
	size_t len;

	if (at == NULL) {
		return out->error;
	}
	if (zstd == NULL) {
		memcpy(at, records, records_len);
		return (int64_t)records_len;
	}
	len = ZSTD_compress2(zstd, at, bound, records, records_len);
	if (ZSTD_isError(len)) {
		return -ENOMEM; /* with this bound nothing else can go wrong */
	}
	out->len -= bound - len;
	return (int64_t)len;
}

int64_t mcap_chunk_put(struct mcap_buf *out, const struct mcap_chunk_index *messages,
		       const uint8_t *records, size_t records_len, ZSTD_CCtx *zstd)
{
	size_t start = mcap_buf_begin(out, MCAP_OP_CHUNK);
	size_t content_at;
	int64_t content_len;

	mcap_buf_u64(out, mcap_chunk_index_start_ns(messages));
	mcap_buf_u64(out, mcap_chunk_index_end_ns(messages));
	mcap_buf_u64(out, records_len);
	mcap_buf_u32(out, libdeflate_crc32(0, records, records_len));
	mcap_buf_string(out, zstd != NULL ? "zstd" : "");
	mcap_buf_u64(out, 0);
	content_at = out->len;
	content_len = put_content(out, records, records_len, zstd);
	if (content_len >= 0) {
		put_le64(out->data + content_at - 8, (uint64_t)content_len);
		mcap_buf_end(out, start);
	}
	return content_len;
}
