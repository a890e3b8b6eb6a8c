/* SPDX-License-Identifier: MIT */
/* Channels by name or pattern. */
#ifndef CLI_CHOOSE_H
#define CLI_CHOOSE_H

#include <stdint.h>

#include "cli/source.h"

enum { CHOOSE_LIMIT = 512 };

struct choice {
	uint32_t channel[CHOOSE_LIMIT]; /* places in the channel table */
	unsigned count;
};

/**
 * The channels that the words @names name, in that order; * and ? match. EXIT_CODE_OK, or the code
 * of a failure that was reported.
 */
enum exit_code choose_channels(const struct cli *cli, const struct samples *samples,
			       char *const *names, int name_count, struct choice *ret_choice);

/** Say that there is no channel @name, with a guess. Returns EXIT_CODE_FAILED. */
enum exit_code choose_fail(const struct cli *cli, const struct samples *samples, const char *name);

#endif
