/* SPDX-License-Identifier: MIT */
/*
 * The configuration of a running ecdaqd, and the newer one of its file that waits for the next
 * bring-up. Owned by the program; the session works on it. Context: service thread, blocking.
 */
#ifndef DAEMON_RELOAD_H
#define DAEMON_RELOAD_H

#include "config/version.h"
#include "daemon/failure.h"

struct reload {
	struct config_source source;   /* of the command line */
	struct config_version running; /* its cfg is the session's */
	struct config_version next;    /* what the file has; no texts: nothing newer is known */
};

/** Read @source into @cfg, which is the one to run. 0 or -errno with @failure. Free with
 * reload_done(). */
int reload_init(struct reload *reload, const struct config_source *source, struct config *cfg,
		struct failure *failure);
void reload_done(struct reload *reload);

/** What may be done before anything is taken; not 0 with one line in @error: nothing is. */
struct reload_check {
	int (*is_possible)(void *ctx, const struct config *cfg, char *error, size_t error_bytes);
	void *ctx;
};

/**
 * Read the file again. What can be taken at once is taken, the rest is kept for
 * reload_take_rescan(); all that differs is in *@ret_change, to be freed. 0, or -errno with one
 * line in @error: nothing has changed.
 */
int reload_read(struct reload *reload, const struct reload_check *check,
		struct config_change **ret_change, size_t *ret_count, char *error,
		size_t error_bytes);
/** Before a bring-up, while nothing is up: 1 if a newer configuration was taken. */
int reload_take_rescan(struct reload *reload);

#endif
