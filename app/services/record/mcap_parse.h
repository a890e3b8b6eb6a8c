/* SPDX-License-Identifier: MIT */
/* The fields of one MCAP record, whatever its bytes are. Inside of the reader. Context: any. */
#ifndef RECORD_MCAP_PARSE_H
#define RECORD_MCAP_PARSE_H

#include "record/mcap_reader.h"

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

#endif
