/* SPDX-License-Identifier: MIT */
/* The GPIO lines of the configuration, opened one by one: one that cannot be had does not keep the
 * others from it, and is tried again. Context: blocking. */
#ifndef SYNC0_LINES_H
#define SYNC0_LINES_H

#include <stddef.h>
#include <stdint.h>

#include "config/config.h"
#include "sync0/edge.h"

struct lines;

/** What a line has to say: it was opened (why is NULL), or why it was not, or is gone. */
typedef void (*lines_tell)(void *ctx, size_t line, const char *why);

/** For the slaves of @cfg that have one. NULL with errno; ENOENT: none has. */
struct lines *lines_create(const struct config *cfg, const char *dev_dir);
void lines_destroy(struct lines *l);
size_t lines_count(const struct lines *l);
uint16_t lines_slave(const struct lines *l, size_t line);
const char *lines_text(const struct lines *l, size_t line);
int lines_is_open(const struct lines *l, size_t line);
/** Why it is not: what gpio_open() said last, or -ENODEV: its chip is gone. */
int lines_error(const struct lines *l, size_t line);
int lines_is_hte(const struct lines *l, size_t line);
/** Open what is not open. Returns how many are. */
size_t lines_open(struct lines *l, lines_tell tell, void *ctx);
/** Wait at most @ms for an edge on any line. */
void lines_wait(const struct lines *l, int ms);
/** Give every edge that waits to @take. */
void lines_read(struct lines *l, void (*take)(void *ctx, const struct edge *edge), lines_tell tell,
		void *ctx);

#endif
