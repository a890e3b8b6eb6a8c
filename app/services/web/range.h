/* SPDX-License-Identifier: MIT */
/* The Range header of a request (RFC 9110, 14.2). Context: any. */
#ifndef WEB_RANGE_H
#define WEB_RANGE_H

#include <stdint.h>

/* Bytes of a file: from @first, up to and without @end. */
struct range {
	uint64_t first;
	uint64_t end;
};

/**
 * The part of @bytes that @header asks for. 1: that one; 0: all, there is no header or one that is
 * ignored (more than one part, another unit, not to be read); -ERANGE: nothing of it is in the
 * file.
 * @ret is written unless it is -ERANGE.
 */
int range_parse(const char *header, uint64_t bytes, struct range *ret);

#endif
