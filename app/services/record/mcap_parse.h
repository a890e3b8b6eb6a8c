/* SPDX-License-Identifier: MIT */
/* The fields of one MCAP record, whatever its bytes are. What a reader hands out. Context: any. */
#ifndef RECORD_MCAP_PARSE_H
#define RECORD_MCAP_PARSE_H

#include <stddef.h>
#include <stdint.h>

enum mcap_item_kind {
	MCAP_ITEM_HEADER,  /* name: profile; encoding: library */
	MCAP_ITEM_SCHEMA,  /* id, name, encoding, data: its text */
	MCAP_ITEM_CHANNEL, /* id, schema_id, name: topic, encoding, data: pairs */
	MCAP_ITEM_MESSAGE, /* id: channel, sequence, times, data */
	MCAP_ITEM_CHUNK,   /* encoding: compression; data: its records, uncompressed. They follow */
	MCAP_ITEM_MESSAGE_INDEX, /* id: channel */
	MCAP_ITEM_ATTACHMENT,    /* name, encoding: media type, data */
	MCAP_ITEM_METADATA,      /* name, data: pairs */
	MCAP_ITEM_STATISTICS,    /* log_time_ns, publish_time_ns: of first and last message; data:
				    counts */
	MCAP_ITEM_OTHER,         /* a record that this reader has no use for */
	MCAP_ITEM_DATA_END,      /* the last item of a file that was closed; crc: 0: none */
	MCAP_ITEM_DAMAGE,        /* reason; the reader continues after it if !is_final */
};

/* Not zero-terminated. */
struct mcap_text {
	const char *at;
	uint32_t len;
};

/* What it points to is valid until the next mcap_reader_next(). */
struct mcap_item {
	enum mcap_item_kind kind;
	int is_final; /* damage: nothing behind it can be read */
	int is_inner; /* the record is inside a chunk */
	const char *reason;
	uint64_t offset;       /* of the record in the file; inside a chunk: of the chunk */
	const uint8_t *record; /* whole, head included; NULL for damage */
	size_t record_len;
	uint16_t id;
	uint16_t schema_id;
	uint32_t crc;
	uint32_t sequence;
	uint64_t log_time_ns;
	uint64_t publish_time_ns;
	struct mcap_text name;
	struct mcap_text encoding;
	const uint8_t *data;
	size_t data_len;
};

struct mcap_chunk_fields {
	uint64_t uncompressed_len;
	uint32_t crc;
	struct mcap_text compression;
	const uint8_t *data;
	size_t data_len;
};

/** Fill the fields of @item from its record. 0 or -EBADMSG. A chunk's are left to
 * mcap_parse_chunk(). */
int mcap_parse_record(struct mcap_item *item);

int mcap_parse_chunk(const uint8_t *content, size_t content_len,
		     struct mcap_chunk_fields *ret_fields);

/** The next pair of channel or metadata @data; *@offset starts at 0. 1, 0 at the end, -EBADMSG. */
int mcap_pairs_next(const uint8_t *data, size_t data_len, size_t *offset, struct mcap_text *ret_key,
		    struct mcap_text *ret_value);
/** The value of @key as a zero-terminated copy (cut to fit) in @buf. 0, -ENOENT, -EBADMSG. */
int mcap_pairs_get(const struct mcap_item *item, const char *key, char *buf, size_t buf_len);

/** Messages of the channel @id by a statistics item; 0 if it does not know it. */
uint64_t mcap_statistics_count(const struct mcap_item *item, uint16_t id);

/** 1 if @text is exactly @wanted. */
int mcap_text_is(struct mcap_text text, const char *wanted);

#endif
