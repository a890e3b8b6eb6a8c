/* SPDX-License-Identifier: MIT */
/*
 * Room for recordings: what record.budget allows and what record.reserve leaves free. The oldest
 * files go where record.when_full lets them, damaged ones too; a file NAME.keep pins a recording.
 * With ecdaq-uplink those that are uploaded go first, and record.keep_until_uploaded rules the
 * rest. Context: blocking.
 */
#ifndef RECORD_SPACE_H
#define RECORD_SPACE_H

#include <stdint.h>

#include "record/record_file.h"
#include "record/recorder.h"

struct space {
	const struct recorder_options *opt; /* kept */
	uint64_t bytes_free;                /* when looked at last */
	uint64_t bytes_kept;                /* in all recordings but the open one */
	uint64_t bytes_kept_back;           /* not uploaded, where nothing else can go */
	uint64_t seen_bytes;                /* of the open file, by space_for_chunk() */
	uint64_t chunk_bytes;               /* that it grew by */
};

/**
 * Have room for @more bytes beside what is in @file (NULL: none is open). 0; -ENOSPC: there is
 * none, and nothing was deleted in vain; or -errno.
 */
int space_make(struct space *sp, const struct record_file *file, uint64_t more);
/** Have room for another chunk in @file and for its end. Old files are looked at only where it is
 * tight: call it for each chunk. */
int space_for_chunk(struct space *sp, const struct record_file *file);
/** Have room to begin again after there was none: some more, so that it does not go to and fro. */
int space_to_begin(struct space *sp);
/** Size at which a file is finished: so that letting the oldest go is a small loss. */
uint64_t space_largest_file(const struct space *sp, const struct record_file *file);

#endif
