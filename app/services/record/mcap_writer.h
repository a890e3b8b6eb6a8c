/* SPDX-License-Identifier: MIT */
/*
 * Writes an MCAP file, append-only. Messages gather in one chunk in memory until it is closed;
 * every other record goes out at once. A failed write leaves the file cut back to its last whole
 * record (or is cut before the next write) and the writer as it was: the caller may try again,
 * nothing in the chunk is lost. Context of all functions: blocking.
 *
 * Schemas and channels are in the head of the file, in the summary, and again in chunks: in the
 * first one, then in one whenever the file has grown by MCAP_REPEAT_FACTOR times their size. So a
 * destroyed head costs no message even where there is no summary, in our recovery and in others'
 * that go from chunk to chunk; the price is less than 2 % of the file. Every sync would cost ten
 * times as much in a slow recording, and the first chunk alone may be in the same bad block.
 */
#ifndef RECORD_MCAP_WRITER_H
#define RECORD_MCAP_WRITER_H

#include <stddef.h>
#include <stdint.h>

#include "record/mcap.h"
#include "record/mcap_index.h"

struct mcap_writer;

struct mcap_channel_spec {
	uint16_t schema_id;
	const char *topic;
	const char *message_encoding;
	const struct mcap_pair *pairs;
	size_t pair_count;
};

struct mcap_message {
	uint16_t channel_id;
	uint32_t sequence;
	uint64_t log_time_ns;
	uint64_t publish_time_ns;
	const void *data;
	size_t data_len;
};

/**
 * A writer to @io; @zstd_level 0 writes chunks uncompressed. Nothing is written yet. 0, -ENOMEM,
 * -EINVAL. Free with mcap_writer_destroy(), which writes nothing either. @io is copied, its ctx is
 * not.
 */
int mcap_writer_create(const struct mcap_io *io, int zstd_level, struct mcap_writer **ret_writer);
void mcap_writer_destroy(struct mcap_writer *w);

/** Magic and header: first of all. 0 or -errno of the I/O. */
int mcap_writer_begin(struct mcap_writer *w, const char *profile, const char *library);
/** Continue a file that ends in a complete record at @offset, has the CRC @data_crc up to there,
 * and contains what @index lists; @index is moved in. */
void mcap_writer_resume(struct mcap_writer *w, uint64_t offset, uint32_t data_crc,
			struct mcap_index *index);

/** Add a schema. Its id (from 1 on) or -errno. */
int mcap_writer_schema(struct mcap_writer *w, const char *name, const char *encoding,
		       const char *text);
/** Add a channel. Its id (from 0 on) or -errno. */
int mcap_writer_channel(struct mcap_writer *w, const struct mcap_channel_spec *spec);

/** Add a message to the open chunk. 0, -ENOMEM; -ENOBUFS: close the chunk first (no room). */
int mcap_writer_message(struct mcap_writer *w, const struct mcap_message *m);
/** Bytes that messages can still take in the open chunk; each takes its data plus
 * MCAP_MESSAGE_COST_BYTES. */
size_t mcap_writer_room(const struct mcap_writer *w);
#define MCAP_REPEAT_FACTOR 64
#define MCAP_MESSAGE_COST_BYTES ((size_t)MCAP_HEAD_BYTES + MCAP_MESSAGE_HEAD_BYTES)
/** Write the open chunk and its message index; an empty one is nothing. 0 or -errno: it stays open.
 */
int mcap_writer_close_chunk(struct mcap_writer *w);

int mcap_writer_metadata(struct mcap_writer *w, const char *name, const struct mcap_pair *pairs,
			 size_t pair_count);
int mcap_writer_attachment(struct mcap_writer *w, const char *name, const char *media_type,
			   uint64_t time_ns, const void *data, size_t data_len);

/** Append @record as it is, and note it in the index: for copying what a reader found whole. */
int mcap_writer_copy(struct mcap_writer *w, const uint8_t *record, size_t record_len);
/** Append the chunk record @record with the index built from its content. */
int mcap_writer_copy_chunk(struct mcap_writer *w, const uint8_t *record, size_t record_len,
			   const char *compression, size_t uncompressed_len,
			   const struct mcap_chunk_index *messages);

/** Cut the file to its first @bytes; nothing can be written after that. 0 or -errno. */
int mcap_writer_cut(struct mcap_writer *w, uint64_t bytes);
/** Make all that is written durable. 0 or -errno. */
int mcap_writer_sync(struct mcap_writer *w);
/**
 * Close the chunk, write the summary and the end, and sync. 0 or -errno: the file is then cut back
 * to its data section, and finishing may be tried again.
 */
int mcap_writer_finish(struct mcap_writer *w);

/** Bytes written so far (the open chunk is not). */
uint64_t mcap_writer_bytes(const struct mcap_writer *w);
/** Bytes that a summary would add now. */
uint64_t mcap_writer_summary_bytes(const struct mcap_writer *w);
/** 1 when the index has grown to its limit: finish the file and start another. */
int mcap_writer_is_full(const struct mcap_writer *w);
const struct mcap_index *mcap_writer_index(const struct mcap_writer *w);

#endif
