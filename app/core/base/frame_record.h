/* SPDX-License-Identifier: MIT */
/*
 * A slot of the ring of captured frames ("frames" in the run directory): this, then the frame. The
 * ring is there while somebody captures (ADMIN_CAPTURE). A change of layout is a new kind of ring.
 */
#ifndef BASE_FRAME_RECORD_H
#define BASE_FRAME_RECORD_H

#include <assert.h>
#include <stdint.h>

#include "base/limits.h"

#define FRAME_RING_KIND "frame1"

enum frame_direction { FRAME_OUT = 0, FRAME_IN = 1 };

struct frame_record {
	int64_t mono_ns; /* CLOCK_MONOTONIC: handed to the NIC, or taken from it */
	int32_t error;   /* 0; -errno: the NIC has refused it */
	uint16_t frame_bytes;
	uint8_t direction; /* enum frame_direction */
	uint8_t reserved;
};

static_assert(sizeof(struct frame_record) == 16, "part of the ring's format");

enum { FRAME_SLOT_BYTES = sizeof(struct frame_record) + LIMIT_FRAME_BYTES };

#endif
