/* SPDX-License-Identifier: MIT */
/* The seconds of a recording from anywhere: each that was accepted can be read. */
#include <assert.h>
#include <stddef.h>
#include <stdint.h>

#include "record/envelope.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
	struct envelope_view v;
	uint64_t sum = 0;

	if (envelope_parse(data, size, &v) < 0) {
		return 0;
	}
	assert(v.block_cycles > 0);
	for (uint32_t k = 0; k < v.channels && k < 64; k++) {
		struct mcap_text name = envelope_channel(&v, k);

		for (uint32_t i = 0; i < name.len; i++) {
			sum += (uint8_t)name.at[i];
		}
	}
	for (uint32_t i = 0; i < v.blocks; i++) {
		uint32_t samples;

		sum += envelope_block(&v, i, &samples);
		for (uint32_t k = 0; k < v.channels; k++) {
			sum += envelope_get(&v, i, k).good;
		}
	}
	return sum == UINT64_MAX;
}
