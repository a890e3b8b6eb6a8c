/* SPDX-License-Identifier: MIT */
/*
 * Reads the data section of an MCAP file from front to back, in bounded memory, whatever the bytes
 * are. A chunk is handed out only after its CRC was checked, then what is inside it, record by
 * record. Context of all functions: blocking.
 */
#ifndef RECORD_MCAP_READER_H
#define RECORD_MCAP_READER_H

#include <stddef.h>
#include <stdint.h>

#include "record/mcap.h"

struct mcap_reader;

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
	MCAP_ITEM_DATA_END,      /* the last item of a file that was closed */
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
	uint32_t sequence;
	uint64_t log_time_ns;
	uint64_t publish_time_ns;
	struct mcap_text name;
	struct mcap_text encoding;
	const uint8_t *data;
	size_t data_len;
};

/** 0; -EPROTO: does not start as an MCAP file; -ENODATA: ends within its magic; or -errno. @source
 * is copied. */
int mcap_reader_create(const struct mcap_source *source, struct mcap_reader **ret_reader);
/** The same for the summary section of a closed file; -ENODATA where there is none, -EBADMSG: its
 * CRC is wrong. */
int mcap_reader_create_summary(const struct mcap_source *source, struct mcap_reader **ret_reader);
void mcap_reader_destroy(struct mcap_reader *r);

/** The next item: 1; 0 at the end of the section or of the file; -errno of the I/O, -ENOMEM. */
int mcap_reader_next(struct mcap_reader *r, struct mcap_item *ret_item);

enum mcap_ending {
	MCAP_ENDING_GOOD,    /* footer and magic are there and the summary's CRC is right */
	MCAP_ENDING_MISSING, /* the file was not closed */
	MCAP_ENDING_BAD,     /* there is an end, but its summary is damaged */
};

/** Look at the end of the file; *@ret_ending is written on success (0), else -errno. */
int mcap_ending_check(const struct mcap_source *source, enum mcap_ending *ret_ending);

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
