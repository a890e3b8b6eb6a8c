/* SPDX-License-Identifier: MIT */
/*
 * The content of a chunk, uncompressed: walking its records, and making the message index that
 * follows the chunk in the file. The writer and the recovery make it by the same code, so it can be
 * compared byte by byte.
 */
#ifndef RECORD_MCAP_CHUNK_H
#define RECORD_MCAP_CHUNK_H

#include <zstd.h>

#include "record/mcap_buf.h"

struct mcap_chunk_index;

/* One record inside a chunk. */
struct mcap_inner {
	uint8_t opcode;
	const uint8_t *content;
	size_t content_len;
	size_t offset; /* of the record in the chunk */
};

/** The record at *@offset, which is moved past it. 1, 0 at the end, -EBADMSG (ret untouched). */
int mcap_chunk_next(const uint8_t *records, size_t records_len, size_t *offset,
		    struct mcap_inner *ret_inner);

/** Length of the (compressed) content of a chunk record of @record_len. */
size_t mcap_chunk_content_len(size_t record_len, size_t compression_len);

/** Scratch memory for the functions below. NULL with errno. */
struct mcap_chunk_index *mcap_chunk_index_create(void);
void mcap_chunk_index_destroy(struct mcap_chunk_index *ix);

/** No message is in it, as after creation. */
void mcap_chunk_index_clear(struct mcap_chunk_index *ix);
/** The chunk has a message of channel @id at @offset, behind those added before. 0, -ENOMEM: it is
 * not added. */
int mcap_chunk_index_add(struct mcap_chunk_index *ix, uint16_t id, uint64_t log_time_ns,
			 size_t offset);
/** Build it of what was added; more may be added, and it be built again. 0, -ENOMEM. */
int mcap_chunk_index_finish(struct mcap_chunk_index *ix);

/** All three for the messages of @records. 0, -EBADMSG (a malformed record), -ENOMEM. */
int mcap_chunk_index_build(struct mcap_chunk_index *ix, const uint8_t *records, size_t records_len);

/** The message index records of what was built: channels in ascending order. */
const uint8_t *mcap_chunk_index_bytes(const struct mcap_chunk_index *ix, size_t *ret_len);

/* What was built, by channel: offset of its message index record from the end of the chunk. */
struct mcap_chunk_channel {
	uint16_t id;
	uint32_t messages;
	uint32_t index_offset;
};

const struct mcap_chunk_channel *mcap_chunk_index_channels(const struct mcap_chunk_index *ix,
							   size_t *ret_count);
uint64_t mcap_chunk_index_start_ns(const struct mcap_chunk_index *ix); /* smallest log time, 0 if
									  none */
uint64_t mcap_chunk_index_end_ns(const struct mcap_chunk_index *ix);   /* largest log time */
uint64_t mcap_chunk_index_messages(const struct mcap_chunk_index *ix);

/**
 * Append the chunk record of @records, which @messages was built from, to @out; compressed if @zstd
 * is not NULL. Returns the length of the content in the record, or -errno.
 */
int64_t mcap_chunk_put(struct mcap_buf *out, const struct mcap_chunk_index *messages,
		       const uint8_t *records, size_t records_len, ZSTD_CCtx *zstd);

#endif
