/* SPDX-License-Identifier: MIT */
/*
 * A configuration that is in use, and a newer one of the same file: what differs, and what of it
 * can be taken while ecdaqd runs (struct option.effect). Context: blocking.
 */
#ifndef CONFIG_VERSION_H
#define CONFIG_VERSION_H

#include <stddef.h>

#include "base/config_change.h"
#include "config/config.h"

struct config_texts; /* every option with its value, as text */

struct config_version {
	struct config *cfg; /* the caller's */
	struct config_texts *texts;
};

/**
 * Read @source, whose callbacks are not used, into @version->cfg, and its texts. 0; the errors of
 * config_assemble(), -ENOMEM, with one line in @error; @version is untouched then. Free the texts
 * with config_version_done().
 */
int config_version_read(const struct config_source *source, struct config_version *version,
			char *error, size_t error_bytes);
/** Free the texts; NULL ones are fine. */
void config_version_done(struct config_version *version);

/**
 * What differs, in the order of the file, an item that one of them has not as a whole; free
 * *@ret_change. 0 or -ENOMEM.
 */
int config_version_compare(const struct config_version *running,
			   const struct config_version *wanted, struct config_change **ret_change,
			   size_t *ret_count);

/**
 * Take from @wanted what takes effect at once, and what ecdaqd does not use itself. 0; -ENOMEM:
 * nothing was taken.
 */
int config_version_take_now(struct config_version *running, const struct config_version *wanted);
/** While nothing of @running is in use: take all but what needs a restart. 0; -ENOMEM, as above. */
int config_version_take_rescan(struct config_version *running, const struct config_version *wanted);

/** The options of sections and of outputs that take effect at once, of @wanted into @cfg; no
 * texts. */
void config_take_now(struct config *cfg, const struct config *wanted);
/** The same for the configuration by position that was made of @running (bus_config()). */
void config_follow(struct config *bound, const struct config *running);

#endif
