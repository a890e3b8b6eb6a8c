/* SPDX-License-Identifier: MIT */
/* Text that may not be UTF-8: names in a slave's SII are in whatever its vendor wrote. */
#ifndef BASE_UTF8_H
#define BASE_UTF8_H

#include <stddef.h>

/* U+FFFD, in place of each byte that is no UTF-8. */
#define UTF8_REPLACEMENT "\xef\xbf\xbd"

/** Length of the sequence at @text, which has @left > 0 bytes; 0 if it is none. */
size_t utf8_len(const char *text, size_t left);

/** @text with replacements, cut between sequences to fit @buf_len > 0 with its zero. */
void utf8_copy(const char *text, char *buf, size_t buf_len);

#endif
