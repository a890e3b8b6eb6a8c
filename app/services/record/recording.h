/* SPDX-License-Identifier: MIT */
/*
 * A recording that is open at any place: its head was read, and its chunks can be found by their
 * cycles. Context: blocking.
 */
#ifndef RECORD_RECORDING_H
#define RECORD_RECORDING_H

#include <limits.h>
#include <stddef.h>
#include <stdint.h>

#include "record/columns.h"
#include "record/log_common.h"
#include "record/mcap_places.h"
#include "record/mcap_reader.h"
#include "record/store.h"

struct recording {
	const char *path;
	struct log_file file;
	struct mcap_reader *reader;
	struct columns *columns; /* learned from the head */
	uint64_t session;        /* 0: unknown */
	uint64_t period_ns;
	int cycle_channel; /* -1: none */
};

/** Open the file at @path and read what is before its first chunk; @channels as columns_create()
 * has them. @path and @rec stay where they are. 0 or -errno. */
int recording_open(struct recording *rec, const char *path, const char *channels);
/** The same with the recording @name of @dir, whose path is kept in @path; @session: only if it is
 * of that one. 1; 0: it is not, or it is gone or empty: the budget removes, the recorder begins and
 * finishes files meanwhile; -errno. */
int recording_open_of(struct recording *rec, const char *dir, const char *name, uint64_t session,
		      const char *channels, char path[PATH_MAX]);
void recording_close(struct recording *rec);

/** The last of @chunks that begins at cycle @wanted or before it; 0 if none does. 0 or -errno. */
int recording_find_chunk(struct recording *rec, const struct mcap_places *chunks, uint64_t wanted,
			 size_t *ret_chunk);
/** First and last cycle of the recording. 1; 0: it has none; -errno. */
int recording_find_range(struct recording *rec, uint64_t *ret_first, uint64_t *ret_last);

/** The session of the newest of @entries in @dir which names one; 0: none does. */
uint64_t recording_newest_session(const char *dir, const struct store_entry *entries, size_t count);

#endif
