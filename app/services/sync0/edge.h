/* SPDX-License-Identifier: MIT */
#ifndef SYNC0_EDGE_H
#define SYNC0_EDGE_H

#include <stdint.h>

/* One rising edge, wherever it came from. */
struct edge {
	int64_t mono_ns; /* CLOCK_MONOTONIC */
	int64_t dc_ns;   /* DC time, where the source knows it (a simulation); 0: not */
	uint32_t seqno;  /* the kernel's count on this line, from 1; 0: none */
	uint16_t line;   /* from 0 */
};

#endif
