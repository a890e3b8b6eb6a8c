/* SPDX-License-Identifier: MIT */
#include "web/range.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

/* Digits at *@at; *@at moves behind them. 1; 0: there are none. A number that is too large is as
 * good as the largest one. */
static int take_number(const char **at, uint64_t *ret)
{
	char *end;

	if (**at < '0' || **at > '9') {
		return 0;
	}
	*ret = strtoull(*at, &end, 10);
	*at = end;
	return 1;
}

int range_parse(const char *header, uint64_t bytes, struct range *ret)
{
	static const char unit[] = "bytes=";
	const char *at = header + strlen(unit);
	struct range all = { 0, bytes };
	uint64_t first = 0;
	uint64_t last = UINT64_MAX;
	int has_first;
	int has_last;

	*ret = all;
	if (strncmp(header, unit, strlen(unit)) != 0) {
		return 0;
	}
	has_first = take_number(&at, &first);
	if (*at++ != '-') {
		return 0;
	}
	has_last = take_number(&at, &last);
	if (*at != '\0' || (!has_first && !has_last) || (has_first && has_last && last < first)) {
		return 0;
	}
	if (!has_first) { /* the last so many */
		if (last == 0 || bytes == 0) {
			return -ERANGE;
		}
		ret->first = last < bytes ? bytes - last : 0;
		return 1;
	}
	if (first >= bytes) {
		return -ERANGE;
	}
	ret->first = first;
	ret->end = last < bytes ? last + 1 : bytes;
	return 1;
}
