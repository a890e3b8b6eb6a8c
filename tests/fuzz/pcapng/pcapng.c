/* SPDX-License-Identifier: MIT */
/* Capture files from anywhere: every byte that a packet promises must be there. */
#include "wire/pcapng.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

/* So that no compiler leaves the reading out. */
static volatile unsigned touched;

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
	struct pcapng_packet packet;
	struct pcapng file;
	unsigned sum = 0;

	if (pcapng_open(&file, data, size) < 0) {
		return 0;
	}
	while (pcapng_next(&file, &packet) == 1) {
		if (packet.interface >= file.interface_count || packet.bytes < data ||
		    packet.len > (size_t)(data + size - packet.bytes)) {
			__builtin_trap();
		}
		for (size_t i = 0; i < packet.len; i++) {
			sum += packet.bytes[i];
		}
	}
	touched = sum;
	return 0;
}
