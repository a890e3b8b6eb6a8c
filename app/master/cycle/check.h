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
#include "image/field.h"

/*
 * Of a counter that goes on by one with each edge, counter minus cycle number stays the same: in a
 * good cycle nothing is written. A one-shot counter goes on when a shot was armed; of it, base is
 * what it was last.
 */
struct check_slave {
	struct image_field counter;
	uint64_t mask; /* its bits */
	uint64_t base; /* if the slave is in check.known */
};

struct check {
	struct check_slave slave[LIMIT_SLAVES];
	struct slave_set counted; /* have a counter */
	struct slave_set oneshot; /* of those: one-shot */
	struct slave_set known;   /* have been fresh since a restart */
	unsigned words;           /* of these sets that are in use */
	int are_words;            /* all counters are whole words of 16 bits */
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
/** The same for the slaves in @word, the @w-th of a set. */
void check_restart_word(struct check *check, unsigned w, uint64_t word);

/* The sets have the words that check.words says. */
struct check_result {
	int has_wrong; /* @wrong is not empty; the same of @unknown */
	int has_unknown;
	struct slave_set wrong;   /* the counter is not as expected */
	struct slave_set unknown; /* the first fresh sample since a restart: it may be a stale one
				   */
	struct check_fault first; /* of the first in @wrong */
};

/** Judge a fresh image of @cycle, but for the slaves of @stale, whose part of it is not. Slaves
 * without a counter are in neither set. */
void check_image(struct check *check, const uint8_t *image, uint64_t cycle,
		 const struct slave_set *stale, struct check_result *ret);

#endif
