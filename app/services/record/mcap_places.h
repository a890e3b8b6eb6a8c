/* SPDX-License-Identifier: MIT */
/*
 * Where in a file its chunks and attachments begin: from the summary of one that was closed, or by
 * going from record to record. Nothing in them is read or checked. Context: blocking.
 */
#ifndef RECORD_MCAP_PLACES_H
#define RECORD_MCAP_PLACES_H

#include <stddef.h>
#include <stdint.h>

#include "record/mcap.h"

/* A part of the file. */
struct mcap_range {
	uint64_t at;
	uint64_t bytes;
};

struct mcap_groups {
	struct mcap_range kind[MCAP_OP_DATA_END + 1]; /* by opcode; 0 bytes: there is none */
};

/** Where the summary has the records of each kind, by footer and summary offsets. 0; -ENODATA: the
 * file has no end; -EBADMSG: it is damaged; or -errno. */
int mcap_groups_find(const struct mcap_source *source, struct mcap_groups *ret);
/** @part as memory: free() it. NULL with *@ret_error, -EBADMSG if it is not in the file or larger
 * than @limit. */
uint8_t *mcap_range_read(const struct mcap_source *source, const struct mcap_range *part,
			 uint64_t limit, int *ret_error);

/* Offsets of records, going up. */
struct mcap_places {
	uint64_t *at;
	size_t count;
};

/** The places of all records with the opcode @kind: MCAP_OP_CHUNK or MCAP_OP_ATTACHMENT. Free with
 * mcap_places_done(), also after a failure. 0, -ENOMEM, or -errno of the I/O. */
int mcap_places_read(const struct mcap_source *source, enum mcap_opcode kind,
		     struct mcap_places *ret);
void mcap_places_done(struct mcap_places *places);

#endif
