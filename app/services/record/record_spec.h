/* SPDX-License-Identifier: MIT */
/* What a recording is made of, and what it ends with. */
#ifndef RECORD_RECORD_SPEC_H
#define RECORD_RECORD_SPEC_H

#include <stdint.h>

#include "base/timemap.h"
#include "record/layout.h"
#include "record/mcap.h"
#include "record/store.h"

/* A test's way to count and fail what is done to a file. */
struct record_seam {
	/** Replace calls of @io, which writes the file at @path. */
	void (*wrap)(void *ctx, const char *path, struct mcap_io *io);
	/** Free bytes in @dir. NULL: read from the file system. */
	int (*free_bytes)(void *ctx, const char *dir, uint64_t *ret_bytes);
	void *ctx;
};

struct record_file_spec {
	const char *dir;
	const char *name;            /* without suffix */
	const struct layout *layout; /* kept */
	int zstd_level;
	const struct store_state *before; /* what was recorded of the session so far */
	uint64_t file_sequence;
	uint64_t start_utc_ns; /* log times start here */
	const struct timemap_state *timemap;
	const char *config_path; /* "" where there is none */
	const char *config_text;
	const struct record_seam *seam; /* NULL: none */
};

struct record_file_end {
	const char *reason; /* "rotated", "producer ended", ... */
	uint64_t events_lost;
	const struct store_state *after; /* what was recorded of the session with this file */
	const struct timemap_state *timemap;
};

#endif
