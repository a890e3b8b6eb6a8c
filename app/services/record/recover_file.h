/* SPDX-License-Identifier: MIT */
/* Recovery of recordings on disk: one file, or all unfinished ones of a store. Context: blocking.
 */
#ifndef RECORD_RECOVER_FILE_H
#define RECORD_RECOVER_FILE_H

#include "record/mcap_recover.h"
#include "record/store.h"
#include "record/track.h"

enum recover_result {
	RECOVER_WAS_WHOLE, /* nothing to repair */
	RECOVER_REPAIRED,  /* in place */
	RECOVER_COPIED,    /* to a new file; damaged records were left out */
	RECOVER_EMPTY,     /* no message in it: nothing to keep */
};

struct recover_outcome {
	enum recover_result result;
	struct mcap_findings found;
	struct track track;
};

/**
 * Repair the file at @path in place and make it durable. 0; -EXDEV: damaged before its end, copy
 * it; -EPROTO: not MCAP; -ENODATA: ends before its first record; or -errno. An empty recording is
 * left as it is. @watch (or NULL) is called with how many bytes have been read.
 */
int recover_in_place(const char *path, void (*watch)(uint64_t done),
		     struct recover_outcome *ret_outcome);

/** Copy what is whole in @path to a new file at @output (-EEXIST if it is there), durable. Errors
 * and
 * @watch as above; @path is read twice. */
int recover_copy(const char *path, const char *output, void (*watch)(uint64_t done),
		 struct recover_outcome *ret_outcome);

struct recover_report {
	/** One line for a person. */
	void (*line)(void *ctx, const char *text);
	void *ctx;
};

/**
 * Repair and rename all .part files of the store, and set @state by what they hold. Empty ones are
 * removed; what cannot be recovered is renamed to .damaged, or left where that is refused, so that
 * no file stops recording. 0, or -errno of what may pass: no space, no memory, the directory
 * itself.
 */
int recover_store(const struct store *s, const struct recover_report *report,
		  struct store_state *state);

#endif
