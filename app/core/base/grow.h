/* SPDX-License-Identifier: MIT */
/* Arrays that grow by a row at a time. Context: blocking. */
#ifndef BASE_GROW_H
#define BASE_GROW_H

#include <stddef.h>

/**
 * @array (NULL: none yet) with one more than @count rows of @bytes, which is zeroed. It has room
 * for the next power of two. NULL: out of memory; @array and @count are as before then. free() it.
 */
void *array_grow(void *array, size_t *count, size_t bytes);

#endif
