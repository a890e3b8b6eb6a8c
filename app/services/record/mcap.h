/* SPDX-License-Identifier: MIT */
/*
 * MCAP as its specification (mcap.dev/spec, version 0) has it: a magic, records of opcode, length
 * and content, a magic. All numbers are little-endian.
 */
#ifndef RECORD_MCAP_H
#define RECORD_MCAP_H

#include <stddef.h>
#include <stdint.h>

#define MCAP_MAGIC "\x89MCAP0\r\n"

enum mcap_opcode {
	MCAP_OP_HEADER = 0x01,
	MCAP_OP_FOOTER = 0x02,
	MCAP_OP_SCHEMA = 0x03,
	MCAP_OP_CHANNEL = 0x04,
	MCAP_OP_MESSAGE = 0x05,
	MCAP_OP_CHUNK = 0x06,
	MCAP_OP_MESSAGE_INDEX = 0x07,
	MCAP_OP_CHUNK_INDEX = 0x08,
	MCAP_OP_ATTACHMENT = 0x09,
	MCAP_OP_ATTACHMENT_INDEX = 0x0a,
	MCAP_OP_STATISTICS = 0x0b,
	MCAP_OP_METADATA = 0x0c,
	MCAP_OP_METADATA_INDEX = 0x0d,
	MCAP_OP_SUMMARY_OFFSET = 0x0e,
	MCAP_OP_DATA_END = 0x0f,
	MCAP_OP_PRIVATE = 0x80, /* and above: skipped by who does not know them */
};

enum mcap_limits {
	MCAP_MAGIC_BYTES = 8,
	MCAP_HEAD_BYTES = 9,                /* opcode and length of a record */
	MCAP_MESSAGE_HEAD_BYTES = 22,       /* of a message, before its data */
	MCAP_FOOTER_BYTES = 9 + 20,         /* the whole record */
	MCAP_DATA_END_BYTES = 9 + 4,        /* the whole record */
	MCAP_LIMIT_CHUNK_BYTES = 4 << 20,   /* that we write: closed early at this size */
	MCAP_LIMIT_RECORD_BYTES = 32 << 20, /* that we read, and a chunk's content: beyond is damage
					     */
	MCAP_LIMIT_INDEX_BYTES = 16 << 20,  /* summary kept in memory while writing; then rotate */
	MCAP_CHANNEL_IDS = 1 << 16,
};

/* One entry of a string map, as metadata and channels have it. */
struct mcap_pair {
	const char *key;
	const char *value;
};

/* Where the bytes go. Everything the writer does to a file is one of these calls. */
struct mcap_io {
	/** Append all of @data; 0, or -errno and some of it may be there. */
	int (*write)(void *ctx, const void *data, size_t len);
	/** Make durable what was written; 0 or -errno. */
	int (*sync)(void *ctx);
	/** Cut back to @bytes and append there from now on; 0 or -errno. */
	int (*truncate)(void *ctx, uint64_t bytes);
	void *ctx;
};

/* Where the bytes come from. */
struct mcap_source {
	/** Read @len bytes at @offset (within bytes); 0 or -errno. */
	int (*read_at)(void *ctx, uint64_t offset, void *buf, size_t len);
	uint64_t bytes;
	void *ctx;
};

#endif
