/* SPDX-License-Identifier: MIT */
/*
 * Is the sample of each slave good? It is, if its frame was fresh and its conversion counter went
 * on by as many as there were SYNC0 edges since the last fresh one. Without a last one nobody
 * knows, and the sample is not good. Context: cycle thread, RT-safe.
 */
#ifndef CYCLE_CHECK_H
#define CYCLE_CHECK_H

#include <stddef.h>
#include <stdint.h>

#include "base/limits.h"
#include "base/sample.h"
#include "base/slave_set.h"
#include "config/config.h"

struct check_slave {
	const struct channel *counter; /* NULL: it has none */
	int is_oneshot;                /* the counter advances only when a shot was armed */
	int has_last;
	uint64_t last;
	uint64_t last_cycle;
};

struct check {
	struct check_slave slave[LIMIT_SLAVES];
	size_t slave_count;
};

/* What was wrong with one slave's counter. */
struct check_fault {
	uint16_t slave_pos;
	uint64_t seen;
	uint64_t expected;
};

void check_init(struct check *check, const struct config *cfg, const struct slave_info *slaves,
		size_t slave_count, const struct channel *channels);
/** The next fresh sample has nothing to be compared with: entering OP, or a new numbering. */
void check_restart(struct check *check);
/** The same for some slaves. */
void check_restart_some(struct check *check, const struct slave_set *slaves);

struct check_result {
	struct slave_set wrong;   /* the counter is not as expected */
	struct slave_set unknown; /* the first fresh sample since a restart: it may be a stale one
				   */
	struct check_fault first; /* of the first in @wrong */
};

/** Judge a fresh image of @cycle, but for the slaves of @stale, whose part of it is not. Slaves
 * without a counter are in neither set. */
struct check_result check_image(struct check *check, const uint8_t *image, uint64_t cycle,
				const struct slave_set *stale);

#endif
