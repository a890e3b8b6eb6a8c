/* SPDX-License-Identifier: MIT */
/* The end of an MCAP file: data end, summary section, footer, magic. */
#ifndef RECORD_MCAP_SUMMARY_H
#define RECORD_MCAP_SUMMARY_H

#include "record/mcap_index.h"

/**
 * Append to @out what belongs at @offset, the end of the data section; @data_crc is the CRC of all
 * bytes before it, the magic included, as the official writers count it. Errors stick in @out.
 */
void mcap_summary_put(const struct mcap_index *ix, uint64_t offset, uint32_t data_crc,
		      struct mcap_buf *out);

/** An upper bound of how much that is. */
uint64_t mcap_summary_bytes(const struct mcap_index *ix);

#endif
