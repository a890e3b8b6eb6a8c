/* SPDX-License-Identifier: MIT */
/* Compiled bounds. Exceeding one is a configuration error that names it. */
#ifndef BASE_LIMITS_H
#define BASE_LIMITS_H

enum limits {
	LIMIT_SLAVES = 512,
	LIMIT_CHANNELS = 16384,
	LIMIT_OUTPUTS = 4096,      /* of the channels */
	LIMIT_IMAGE_BYTES = 32768, /* outputs and inputs together */
	LIMIT_FRAMES = 64,         /* cyclic frames in one exchange */
	/* Process data datagrams in one exchange: outputs and inputs of each slave, and one more
	 * for each frame that ends between them. */
	LIMIT_CHUNKS = 2 * LIMIT_SLAVES + LIMIT_FRAMES,
	LIMIT_SYNC0_LINES = 64,   /* GPIO lines that ecdaq-sync0 watches */
	LIMIT_FRAME_BYTES = 1514, /* Ethernet header and payload, without FCS */
	LIMIT_NAME_BYTES = 64,    /* with the closing zero */
	LIMIT_UNIT_BYTES = 16,    /* of a channel, the same */
};

#endif
