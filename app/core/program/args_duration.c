/* SPDX-License-Identifier: MIT */
#include "program/args_duration.h"

#include <errno.h>
#include <stdio.h>

#include "config/config.h"

_Static_assert((int)ARGS_WHY_BYTES >= (int)CONFIG_WHY_BYTES, "a reason of config/ fits");

int args_duration(const char *text, void *target, char *why)
{
	int64_t ns;
	int r = config_parse_duration(text, &ns, why);

	if (r == 0 && ns <= 0) {
		snprintf(why, ARGS_WHY_BYTES, "\"%.64s\": expected a duration above 0", text);
		r = -ERANGE;
	}
	if (r == 0) {
		*(int64_t *)target = ns;
	}
	return r;
}
