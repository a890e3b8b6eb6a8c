/* SPDX-License-Identifier: MIT */
/*
 * The contents of the summary section at the end of an MCAP file, collected while the file is
 * written (or scanned for recovery). Index records are kept ready-made; MCAP_LIMIT_INDEX_BYTES
 * bounds them.
 */
#ifndef RECORD_MCAP_INDEX_H
#define RECORD_MCAP_INDEX_H

#include "record/mcap_buf.h"
#include "record/mcap_chunk.h"

struct mcap_index {
	struct mcap_buf schemas; /* repeated as they were */
	struct mcap_buf channels;
	struct mcap_buf chunks;      /* chunk index records */
	struct mcap_buf attachments; /* attachment index records */
	struct mcap_buf metadata;    /* metadata index records */
	uint32_t *schema_at;         /* by id: 1 + place of its record in schemas; 0: none */
	uint32_t *channel_at;        /* the same */
	uint64_t *channel_messages;  /* by id */
	uint32_t channel_end;        /* no channel from this id on has messages */
	uint64_t messages;
	uint64_t start_ns;
	uint64_t end_ns;
	uint32_t schema_count;
	uint32_t channel_count;
	uint32_t chunk_count;
	uint32_t attachment_count;
	uint32_t metadata_count;
};

/* A chunk in the file. */
struct mcap_chunk_place {
	uint64_t offset; /* of its record */
	uint64_t record_len;
	const char *compression;
	uint64_t compressed_len;
	uint64_t uncompressed_len;
};

/* 0 or -ENOMEM. */
int mcap_index_init(struct mcap_index *ix);
void mcap_index_done(struct mcap_index *ix);

/** Note a schema or channel record (whole, head included); of a repeated id the first counts. 0,
 * -EBADMSG, -ENOMEM. */
int mcap_index_define(struct mcap_index *ix, const uint8_t *record, size_t record_len);
/** 1 if a record with the kind and id of this schema or channel was noted, but with other bytes. */
int mcap_index_contradicts(const struct mcap_index *ix, const uint8_t *record, size_t record_len);
/** 1 if channel @id was noted, and the schema that it names. */
int mcap_index_can_read(const struct mcap_index *ix, uint16_t id);
/** 1 if this channel record names no schema, or one that was noted. */
int mcap_index_has_schema_of(const struct mcap_index *ix, const uint8_t *channel_record);
/** Note the chunk at @place whose messages @messages was built from. */
int mcap_index_chunk(struct mcap_index *ix, const struct mcap_chunk_place *place,
		     const struct mcap_chunk_index *messages);
/** Count messages of channel @id that are in no chunk. */
void mcap_index_count(struct mcap_index *ix, uint16_t id, uint64_t messages);
/** Note a metadata or attachment record (whole) at @offset. */
int mcap_index_metadata(struct mcap_index *ix, uint64_t offset, const uint8_t *record,
			size_t record_len);
int mcap_index_attachment(struct mcap_index *ix, uint64_t offset, const uint8_t *record,
			  size_t record_len);

/** 1 when the index has grown to its limit: finish the file and start another. */
int mcap_index_is_full(const struct mcap_index *ix);

#endif
