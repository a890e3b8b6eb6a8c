/* SPDX-License-Identifier: MIT */
#ifndef BASE_PAGES_H
#define BASE_PAGES_H

#include <stddef.h>
#include <stdint.h>

enum { PAGES_SMALLEST_BYTES = 4096 };

/**
 * Write a zero into every page of @map, a new and empty mapping: the first write to a page is made
 * now and not by the cycle. MAP_POPULATE and mlockall() read the pages of a shared mapping only;
 * on cores without a dirty bit of their own (Arm before v8.1: Cortex-A53, -A72) the first write to
 * each of them would still be a page fault.
 */
static inline void pages_touch(void *map, size_t bytes)
{
	volatile uint8_t *page = map;

	for (size_t i = 0; i < bytes; i += PAGES_SMALLEST_BYTES) {
		page[i] = 0;
	}
}

#endif
