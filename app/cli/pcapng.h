/* SPDX-License-Identifier: MIT */
/* A capture file in pcapng, written as it goes: Ethernet, times in ns. Context: blocking. */
#ifndef CLI_PCAPNG_H
#define CLI_PCAPNG_H

#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

enum pcapng_direction { PCAPNG_INBOUND = 1, PCAPNG_OUTBOUND = 2 };

struct pcapng_frame {
	int64_t utc_ns; /* Unix time, from 1970 on */
	enum pcapng_direction direction;
	uint64_t dropped; /* frames that are missing before this one */
	const uint8_t *bytes;
	size_t len;
};

/** Section and interface @name (31 characters at most). Errors: ferror(). */
void pcapng_put_head(FILE *out, const char *name);
void pcapng_put_frame(FILE *out, const struct pcapng_frame *frame);

#endif
