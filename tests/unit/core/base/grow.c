/* SPDX-License-Identifier: MIT */
#include "base/grow.h"

#include <stdint.h>
#include <stdlib.h>

#include "harness/test.h"

TEST(grow, each_row_is_zeroed_and_those_before_it_stay)
{
	uint32_t *row = NULL;
	size_t count = 0;

	for (uint32_t i = 0; i < 1000; i++) {
		uint32_t *grown = array_grow(row, &count, sizeof(*row));

		CHECK(grown != NULL);
		row = grown;
		CHECK_EQ(count, i + 1);
		CHECK_EQ(row[i], 0);
		row[i] = i + 1;
	}
	for (uint32_t i = 0; i < 1000; i++) {
		CHECK_EQ(row[i], i + 1);
	}
	free(row);
}

TEST(grow, without_memory_the_array_and_its_count_stay)
{
	uint32_t *row = NULL;
	size_t count = 0;

	row = array_grow(NULL, &count, sizeof(*row));
	CHECK(row != NULL);
	row[0] = 7;
	count = SIZE_MAX / 2 + 1; /* a power of two whose double no size_t holds */
	CHECK(array_grow(row, &count, sizeof(*row)) == NULL);
	CHECK_EQ(count, SIZE_MAX / 2 + 1);
	CHECK_EQ(row[0], 7);
	free(row);
}
