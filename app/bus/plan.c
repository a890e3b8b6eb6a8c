/* SPDX-License-Identifier: MIT */
#include "bus/plan.h"

#include <errno.h>

#include "bus/exchange_frame.h"

enum { WKC_READ = 1, WKC_WRITE = 2 }; /* what one slave adds to an LRW, ETG.1000.4 */

/* The furthest cut in (@from, @to] that splits no area; @from when there is none, *ret_area what is
 * in the way. */
static uint32_t find_cut(const struct plan_area *area, size_t count, uint32_t from, uint32_t to,
			 int *ret_area)
{
	size_t i = 0;

	while (i < count) {
		if (area[i].start < to && area[i].end > to) {
			to = area[i].start;
			*ret_area = (int)i;
			i = 0;
			if (to <= from) {
				return from;
			}
		} else {
			i++;
		}
	}
	return to;
}

/* LRW adds once for each slave that reads and twice for each that is written, whatever it maps
 * there. */
static uint16_t expected_wkc(const struct plan_area *area, size_t count, uint32_t from, uint32_t to)
{
	uint8_t adds[LIMIT_SLAVES] = { 0 };
	uint16_t wkc = 0;

	for (size_t i = 0; i < count; i++) {
		if (area[i].start < to && area[i].end > from) {
			adds[area[i].slave_pos] |= area[i].is_output ? WKC_WRITE : WKC_READ;
		}
	}
	for (size_t i = 0; i < LIMIT_SLAVES; i++) {
		wkc = (uint16_t)(wkc + adds[i]);
	}
	return wkc;
}

int plan_chunks(struct exchange_plan *plan, const struct plan_area *area, size_t count,
		int *ret_area)
{
	uint32_t from = 0;

	plan->chunk_count = 0;
	plan->wkc_expected = 0;
	while (from < plan->image_bytes) {
		unsigned n = plan->chunk_count;
		uint32_t to = from + exchange_frame_capacity(plan, n);
		int blocked = -1;

		if (n == LIMIT_FRAMES) {
			*ret_area = -1;
			return -E2BIG;
		}
		if (to > plan->image_bytes) {
			to = plan->image_bytes;
		}
		to = find_cut(area, count, from, to, &blocked);
		if (to == from) {
			*ret_area = blocked;
			return -E2BIG;
		}
		plan->chunk_bytes[n] = to - from;
		plan->chunk_wkc[n] = expected_wkc(area, count, from, to);
		plan->wkc_expected = (uint16_t)(plan->wkc_expected + plan->chunk_wkc[n]);
		plan->chunk_count++;
		from = to;
	}
	return 0;
}
