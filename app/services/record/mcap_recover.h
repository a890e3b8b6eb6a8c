/* SPDX-License-Identifier: MIT */
/*
 * Repairs MCAP files. A file that only lost its end (power cut, killed writer) is repaired in
 * place: cut to its last whole record, index of the last chunk completed, summary written. A file
 * that is damaged before its end is copied: damaged records and messages of unknown channels are
 * left out, and schemas and channels are those of mcap_definitions.h. Context of all functions:
 * blocking.
 */
#ifndef RECORD_MCAP_RECOVER_H
#define RECORD_MCAP_RECOVER_H

#include "record/mcap_reader.h"
#include "record/mcap_writer.h"

struct mcap_scan;

struct mcap_findings {
	uint64_t chunks;      /* with a right CRC */
	uint64_t messages;    /* in those */
	uint64_t valid_bytes; /* up to the end of the last whole record of the data section */
	uint64_t lost_bytes;  /* behind it, where the file was not closed */
	uint64_t damaged;     /* damaged records; the torn one at the end is one of them */
	const char *reason;   /* of the first; NULL: none */
	uint64_t reason_offset;
	enum mcap_ending ending;
	int needs_copy; /* cannot be repaired in place */
};

/* Called for each item that the reader finds, damage included. */
struct mcap_visitor {
	void (*item)(void *ctx, const struct mcap_item *item);
	void *ctx;
};

/**
 * Read all of @source. 0; -EPROTO not MCAP; -ENODATA: ends before its first record; or -errno.
 * @visitor may be NULL. Free with mcap_scan_destroy().
 */
int mcap_scan_create(const struct mcap_source *source, const struct mcap_visitor *visitor,
		     struct mcap_scan **ret_scan);
void mcap_scan_destroy(struct mcap_scan *scan);
const struct mcap_findings *mcap_scan_findings(const struct mcap_scan *scan);
/** 1 if the file is whole: closed, and no damage. */
int mcap_scan_is_whole(const struct mcap_scan *scan);

/**
 * A writer to @io, the scanned file itself, that continues after its valid part; the caller may add
 * records and finishes it. 0; -EXDEV: needs_copy; or -errno. Consumes the scan's index: once per
 * scan.
 */
int mcap_scan_resume(struct mcap_scan *scan, const struct mcap_io *io,
		     struct mcap_writer **ret_writer);

/** Copy what is whole in @source, which @scan is of, to a fresh writer, which the caller then
 * finishes. 0; -ENODATA: there is nothing whole; or -errno. */
int mcap_copy_whole(const struct mcap_source *source, const struct mcap_scan *scan,
		    struct mcap_writer *w);

#endif
