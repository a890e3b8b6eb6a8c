/* SPDX-License-Identifier: MIT */
/* Capture files from anywhere: every byte that a packet promises must be there, and a packet that
 * is written is read again. */
#include <stdlib.h>
#include <string.h>

#include "harness/pcapng.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

/* So that no compiler leaves the reading out. */
static volatile unsigned touched;

static void write_and_read(const struct pcapng_packet *packet)
{
	size_t bytes = PCAPNG_HEAD_BYTES + pcapng_packet_bytes(packet->len);
	uint8_t *buf = malloc(bytes);
	struct pcapng_packet again;
	struct pcapng file;

	if (buf == NULL) {
		return;
	}
	if (pcapng_write_packet(buf + pcapng_write_head(buf), packet->t_ns, packet->bytes,
				packet->len) != bytes - PCAPNG_HEAD_BYTES ||
	    pcapng_open(&file, buf, bytes) < 0 || pcapng_next(&file, &again) != 1 ||
	    again.len != packet->len || memcmp(again.bytes, packet->bytes, again.len) != 0) {
		__builtin_trap();
	}
	free(buf);
}

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
		write_and_read(&packet);
		for (size_t i = 0; i < packet.len; i++) {
			sum += packet.bytes[i];
		}
	}
	touched = sum;
	return 0;
}
