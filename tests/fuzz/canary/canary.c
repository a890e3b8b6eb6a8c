/* SPDX-License-Identifier: MIT */
/*
 * A parser with a planted fault, three nested conditions deep. If the search does not find it, the
 * fuzz flavour is built without coverage or sanitizer, and its silence elsewhere means nothing.
 */
#include <stddef.h>
#include <stdint.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
	uint8_t field[4] = { 0 };

	if (size > 3 && data[0] == 'E' && data[1] == 'C') {
		size_t field_len = data[2];

		/* The fault: the length is believed. */
		if (field_len <= size - 3) {
			memcpy(field, data + 3, field_len);
		}
	}
	return field[0] == 1 && field[1] == 1 ? -1 : 0;
}
