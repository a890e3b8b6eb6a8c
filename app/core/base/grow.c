/* SPDX-License-Identifier: MIT */
#include "base/grow.h"

#include <stdint.h>
#include <stdlib.h>
#include <string.h>

enum { ROWS_FIRST = 8 };

void *array_grow(void *array, size_t *count, size_t bytes)
{
	if (*count == 0 || (*count >= ROWS_FIRST && (*count & (*count - 1)) == 0)) {
		size_t rows = *count == 0 ? ROWS_FIRST : 2 * *count;
		void *moved = *count > SIZE_MAX / 2 / bytes ? NULL : realloc(array, rows * bytes);

		if (moved == NULL) {
			return NULL;
		}
		array = moved;
	}
	memset((uint8_t *)array + *count * bytes, 0, bytes);
	(*count)++;
	return array;
}
