/* SPDX-License-Identifier: MIT */
#include "web/window.h"

#include <errno.h>
#include <stddef.h>
#include <string.h>

#include "base/args.h"

enum { SESSION, FROM, TO, FIELDS };

static const char *const keys[FIELDS] = { "session=", "from=", "to=" };

/* One "key=number" of @len bytes, into the field of that key. */
static int take_field(const char *text, size_t len, uint64_t value[FIELDS], int has[FIELDS])
{
	char number[24];
	char why[ARGS_ERROR_BYTES];

	for (int i = 0; i < FIELDS; i++) {
		size_t key_len = strlen(keys[i]);

		if (len <= key_len || strncmp(text, keys[i], key_len) != 0) {
			continue;
		}
		if (has[i] || len - key_len >= sizeof(number)) {
			return -EINVAL;
		}
		memcpy(number, text + key_len, len - key_len);
		number[len - key_len] = '\0';
		has[i] = 1;
		return args_cycle(number, &value[i], why) < 0 ? -EINVAL : 0;
	}
	return -EINVAL;
}

int window_parse(const char *query, struct window *ret)
{
	uint64_t value[FIELDS] = { 0 };
	int has[FIELDS] = { 0 };
	int is_more = 1;

	while (is_more) {
		size_t len = strcspn(query, "&");

		if (take_field(query, len, value, has) < 0) {
			return -EINVAL;
		}
		is_more = query[len] == '&';
		query += len + (size_t)is_more;
	}
	if (!has[SESSION] || !has[FROM] || !has[TO] || value[SESSION] == 0 ||
	    value[TO] < value[FROM]) {
		return -EINVAL;
	}
	if (value[TO] - value[FROM] >= WINDOW_CYCLES) {
		return -ERANGE;
	}
	*ret = (struct window){ value[SESSION], value[FROM], value[TO] };
	return 0;
}
