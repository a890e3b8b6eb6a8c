/* SPDX-License-Identifier: MIT */
/*
 * From the areas of the process image to its datagrams: where to cut, which command, and which
 * working counter to expect. SOEM's own expectation is wrong where slaves share a byte. Pure.
 */
#ifndef BUS_PLAN_H
#define BUS_PLAN_H

#include <stddef.h>
#include <stdint.h>

#include "bus/exchange_plan.h"

/* One SyncManager's buffer in the process image. */
struct plan_area {
	uint32_t start; /* byte */
	uint32_t end;   /* one past */
	uint16_t slave_pos;
	uint8_t sm;
	uint8_t is_output;
	uint8_t is_lrw_forbidden; /* its slave does not support LRW */
};

enum { PLAN_AREAS = LIMIT_SLAVES * 8 };

/**
 * Fill chunk_*, chunk_count and wkc_expected of @plan (the rest is set already): as few as can be,
 * one a frame; or, if is_split, one for what each slave has in one place, many a frame. No
 * area is split (T41). LRW, or LWR and LRD where a slave in the chunk forbids LRW. 0; -E2BIG with
 * *ret_area the index of an area that fits no frame, or -1 when LIMIT_FRAMES are too few.
 */
int plan_chunks(struct exchange_plan *plan, const struct plan_area *area, size_t count,
		int *ret_area);

#endif
