/* SPDX-License-Identifier: MIT */
/* Compiled bounds. Exceeding one is a configuration error that names it. */
#ifndef BASE_LIMITS_H
#define BASE_LIMITS_H

enum limits {
	LIMIT_SLAVES = 64,
	LIMIT_CHANNELS = 2048,
	LIMIT_IMAGE_BYTES = 8192, /* outputs and inputs together */
	LIMIT_FRAMES = 8,         /* cyclic frames in one exchange */
	LIMIT_CHUNKS = 160,       /* process data datagrams in one exchange */
	LIMIT_FRAME_BYTES = 1514, /* Ethernet header and payload, without FCS */
	LIMIT_NAME_BYTES = 64,    /* with the closing zero */
};

#endif
