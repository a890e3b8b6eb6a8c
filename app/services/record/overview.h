/* SPDX-License-Identifier: MIT */
/*
 * What the end of a finished recording says of it, by a few small reads whatever its size is: for
 * lists. Checks no CRC; `ecdaq log check` does. Context: blocking.
 */
#ifndef RECORD_OVERVIEW_H
#define RECORD_OVERVIEW_H

#include <stdint.h>

#include "record/mcap.h"

struct overview {
	uint64_t start_ns; /* Unix time of the first message and of the last one */
	uint64_t end_ns;
	int has_counts;       /* the closing notes are there: a repaired file has none */
	uint64_t cycles;      /* samples in the file */
	uint64_t first_cycle; /* of those, if there are any */
	uint64_t last_cycle;
	uint64_t missing; /* cycles between the first and the last one that are not in it */
};

/** 0; -ENODATA: the file has no end, it was not closed; -EBADMSG: the end is damaged; or -errno.
 * @ret is written on success only. */
int overview_read(const struct mcap_source *source, struct overview *ret);

#endif
