/* SPDX-License-Identifier: MIT */
/*
 * Reads the data section of an MCAP file from front to back, in bounded memory, whatever the bytes
 * are. A chunk is handed out only after its CRC was checked, then what is inside it, record by
 * record. Where no record starts, the next chunk, metadata or attachment whose inner lengths agree
 * is searched for. If nothing else was damaged and the CRC of the whole section is wrong, that is
 * damage before the data end. Context of all functions: blocking.
 */
#ifndef RECORD_MCAP_READER_H
#define RECORD_MCAP_READER_H

#include <stddef.h>
#include <stdint.h>

#include "record/mcap.h"
#include "record/mcap_parse.h"

struct mcap_reader;

/** 0; -EPROTO: does not start as an MCAP file, and nothing in its first MCAP_LIMIT_RECORD_BYTES
 * looks like a chunk; -ENODATA: ends within its magic; or -errno. @source is copied. */
int mcap_reader_create(const struct mcap_source *source, struct mcap_reader **ret_reader);
/** The same for the summary section of a closed file; -ENODATA where there is none, -EBADMSG: its
 * CRC is wrong. */
int mcap_reader_create_summary(const struct mcap_source *source, struct mcap_reader **ret_reader);
void mcap_reader_destroy(struct mcap_reader *r);

/** The next item: 1; 0 at the end of the section or of the file; -errno of the I/O, -ENOMEM. */
int mcap_reader_next(struct mcap_reader *r, struct mcap_item *ret_item);

/** The next item is the record at @offset, where one must begin. The CRC of the whole section is
 * not checked after that. */
void mcap_reader_seek(struct mcap_reader *r, uint64_t offset);

/** CRC of all bytes from the start of the file to the end of the newest top-level record (a data
 * end is not counted in). Meaningful as long as there was no damage. */
uint32_t mcap_reader_data_crc(const struct mcap_reader *r);

enum mcap_ending {
	MCAP_ENDING_GOOD,    /* footer and magic are there and the summary's CRC is right */
	MCAP_ENDING_MISSING, /* the file was not closed */
	MCAP_ENDING_BAD,     /* there is an end, but its summary is damaged */
};

/** Look at the end of the file; *@ret_ending is written on success (0), else -errno. */
int mcap_ending_check(const struct mcap_source *source, enum mcap_ending *ret_ending);

#endif
