/* SPDX-License-Identifier: MIT */
/* The ring of an ecdaqd with two slaves or more, all with a clock, the second with a shot's time.
 */
#ifndef TESTS_UNIT_SYNC0_FAKE_MASTER_H
#define TESTS_UNIT_SYNC0_FAKE_MASTER_H

#include <stdint.h>

#include "base/ring.h"

enum { FAKE_SLAVES = 2, FAKE_SHOT_SLAVE = 1 };

#define FAKE_DC0_NS INT64_C(845000000000000000)
#define FAKE_MONO0_NS INT64_C(7000000000000)

struct fake_master {
	char path[128];
	struct ring *ring;
	int64_t period_ns;
	int64_t cycle;     /* next */
	int64_t dc_ns;     /* of its SYNC0; goes on over restarts */
	int has_own_cycle; /* the second slave's SYNC0 has a cycle of its own */
	uint32_t cycle_ns;
	int32_t shift_ns; /* of the second slave */
	unsigned more;    /* slaves behind the second */
	uint16_t absent;  /* items of slaves[] before the second slave */
};

/** Make "samples" in @dir, in place of one that is there. */
void fake_master_start(struct fake_master *fm, const char *dir, int64_t period_ns);
void fake_master_stop(struct fake_master *fm);
/** One cycle, with this time in the second slave's output. */
void fake_master_push(struct fake_master *fm, uint64_t shot_ns);
/** The host's clock at @dc_ns. */
int64_t fake_mono_ns(int64_t dc_ns);

#endif
