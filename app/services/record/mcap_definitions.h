/* SPDX-License-Identifier: MIT */
/*
 * The schemas and channels of a file, each in its best copy. They are in the head, which no CRC of
 * its own covers; in chunks and in the summary, which have one. So the summary's copy counts before
 * a chunk's, and that before the head's. Context of all functions: blocking.
 */
#ifndef RECORD_MCAP_DEFINITIONS_H
#define RECORD_MCAP_DEFINITIONS_H

#include "record/mcap_index.h"
#include "record/mcap_reader.h"
#include "record/mcap_writer.h"

/** Into @best, which is initialised: those of the summary of @source, if its CRC is there and
 * right. 0 or -errno of the I/O. */
int mcap_definitions_read_summary(const struct mcap_source *source, struct mcap_index *best);

/** Add to @best, as it was found under CRCs, what the head has in addition (@data has both): all,
 * where nothing was under a CRC; else only what messages need, for an id that none uses may be a
 * damaged one. 0, -ENOMEM. */
int mcap_definitions_complete(struct mcap_index *best, const struct mcap_index *data);

/** What is missing in @data, the definitions found in the data section, of @best and of what its
 * own channels and messages need: a reason, or NULL. */
const char *mcap_definitions_missing(const struct mcap_index *data, const struct mcap_index *best);

/** 1 if all messages of the chunk content @records are of channels in @best with their schemas, and
 * all definitions in it are those of @best. */
int mcap_definitions_fit(const struct mcap_index *best, const uint8_t *records, size_t records_len);

/** Write all of @best to @w; no channel whose schema is missing. 0 or -errno. */
int mcap_definitions_put(const struct mcap_index *best, struct mcap_writer *w);

#endif
