/* SPDX-License-Identifier: MIT */
/* Records of a recording besides its messages: at the start and at the end. Context: blocking.
 */
#ifndef RECORD_RECORD_HEAD_H
#define RECORD_RECORD_HEAD_H

#include "record/mcap_writer.h"
#include "record/record_spec.h"

/**
 * Header, schemas, channels (MESSAGE_CYCLE.. first, then one for each topic of the layout, in this
 * order), session, configuration, channel table, time map, IDL. 0 or -errno.
 */
int record_head_put(struct mcap_writer *w, const struct record_file_spec *spec);

struct record_head_counts {
	uint64_t first_cycle;
	uint64_t last_cycle;
	uint64_t cycles;
};

/** The closing notes: counts, time map. 0 or -errno. */
int record_head_put_end(struct mcap_writer *w, const struct record_head_counts *counts,
			const struct record_file_end *end);

#endif
