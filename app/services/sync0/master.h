/* SPDX-License-Identifier: MIT */
/* The sample ring of ecdaqd, as input of the checker: cycles, frames and commanded shots. */
#ifndef SYNC0_MASTER_H
#define SYNC0_MASTER_H

#include <stddef.h>
#include <stdint.h>

#include "reader/table.h"
#include "sync0/checker.h"

struct master;

/** NULL with errno. @path is copied. Context: blocking. */
struct master *master_create(const char *path);
void master_destroy(struct master *m);

/**
 * Is a session of the master there? Looks for one if none is open. 1, or 0; -EPROTO: what is there
 * is no sample ring of this version.
 */
int master_open(struct master *m);
/** Of the open session. */
const struct channel_table *master_table(const struct master *m);

/* Slaves whose shots are looked for. */
void master_watch_shots(struct master *m, const struct slave_set *slaves);

/* The time of the slave's shot was set to @dc_ns, which may have passed or be 0: then to none. */
struct master_shot {
	uint16_t slave_pos;
	int64_t dc_ns;
};

struct master_item {
	struct checker_cycle cycle;
	int has_dc;
	struct master_shot shot[LIMIT_SLAVES]; /* set in this cycle */
	size_t shots;
};

/** The next cycle. 1; 0: none now; -EPIPE: the session has ended and is closed. */
int master_next(struct master *m, struct master_item *ret);

#endif
