/* SPDX-License-Identifier: MIT */
#include "bus/plan.h"

#include <errno.h>

#include "base/slave_set.h"
#include "bus/exchange_frame.h"

/* What one slave adds to an LRW, ETG.1000.4; to LRD or LWR it adds 1. */
enum { WKC_READ = 1, WKC_WRITE = 2 };

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

/* Once for each slave that is read and, in LRW, twice for each that is written, whatever it maps
 * there. */
static uint16_t expected_wkc(const struct plan_area *area, size_t count, uint32_t from, uint32_t to,
			     enum exchange_kind kind, struct slave_set *ret_slaves)
{
	uint8_t adds[LIMIT_SLAVES] = { 0 };
	uint16_t wkc = 0;

	*ret_slaves = slave_set_empty();
	for (size_t i = 0; i < count; i++) {
		if (area[i].start < to && area[i].end > from) {
			adds[area[i].slave_pos] |= area[i].is_output ? WKC_WRITE : WKC_READ;
			slave_set_add(ret_slaves, area[i].slave_pos);
		}
	}
	for (size_t i = 0; i < LIMIT_SLAVES; i++) {
		wkc = (uint16_t)(wkc + (kind == EXCHANGE_LRW ? adds[i] : adds[i] != 0));
	}
	return wkc;
}

/*
 * The end of what begins at @from and should be in one chunk: the contiguous areas of one slave,
 * and whatever shares a byte with them.
 */
static uint32_t group_end(const struct plan_area *area, size_t count, uint32_t from, uint32_t bytes)
{
	uint32_t end = from;
	uint32_t next = bytes;
	size_t i = 0;
	int owner = -1;

	while (i < count) {
		int is_first = owner < 0 && area[i].start <= from && area[i].end > from;
		int is_next = area[i].start == end && (int)area[i].slave_pos == owner;
		int is_shared = area[i].start < end && area[i].end > end;

		if (is_first || ((is_next || is_shared) && area[i].end > end)) {
			owner = is_first ? (int)area[i].slave_pos : owner;
			end = area[i].end;
			i = 0;
		} else {
			i++;
		}
	}
	/* Bytes without an owner go with those before them. */
	for (i = 0; i < count; i++) {
		if (area[i].start >= end && area[i].start > from && area[i].start < next) {
			next = area[i].start;
		}
	}
	return next;
}

static int is_lrw_forbidden(const struct plan_area *area, size_t count, uint32_t from, uint32_t to)
{
	for (size_t i = 0; i < count; i++) {
		if (area[i].is_lrw_forbidden && area[i].start < to && area[i].end > from) {
			return 1;
		}
	}
	return 0;
}

/* The frame that is being filled. */
struct filling {
	unsigned frame;
	uint32_t used; /* of its capacity */
};

static void add_chunk(struct exchange_plan *plan, const struct plan_area *area, size_t count,
		      uint32_t from, uint32_t to, struct filling *fill)
{
	unsigned n = plan->chunk_count++;
	enum exchange_kind kind = EXCHANGE_LRW;
	int is_half; /* the inputs follow in the same frame */

	if (is_lrw_forbidden(area, count, from, to)) {
		kind = from < plan->output_bytes ? EXCHANGE_LWR : EXCHANGE_LRD;
	}
	is_half = kind == EXCHANGE_LWR && to == plan->output_bytes;
	plan->chunk_kind[n] = (uint8_t)kind;
	plan->chunk_bytes[n] = to - from;
	plan->chunk_wkc[n] = expected_wkc(area, count, from, to, kind, &plan->chunk_slaves[n]);
	plan->chunk_frame[n] = (uint8_t)fill->frame;
	plan->wkc_expected = (uint16_t)(plan->wkc_expected + plan->chunk_wkc[n]);
	fill->used += to - from + EXCHANGE_OVERHEAD;
	if ((!plan->is_split && !is_half) ||
	    fill->used >= exchange_frame_capacity(plan, fill->frame)) {
		*fill = (struct filling){ .frame = fill->frame + 1 };
	}
}

int plan_chunks(struct exchange_plan *plan, const struct plan_area *area, size_t count,
		int *ret_area)
{
	struct filling fill = { 0 };
	uint32_t from = 0;

	plan->chunk_count = 0;
	plan->wkc_expected = 0;
	while (from < plan->image_bytes) {
		uint32_t end = plan->is_split ? group_end(area, count, from, plan->image_bytes)
					      : plan->image_bytes;
		uint32_t to = from + exchange_frame_capacity(plan, fill.frame) - fill.used;
		int blocked = -1;

		if (fill.frame == LIMIT_FRAMES || plan->chunk_count == LIMIT_CHUNKS) {
			*ret_area = -1;
			return -E2BIG;
		}
		if (to < end && fill.used > 0) {
			fill = (struct filling){ .frame = fill.frame + 1 };
			continue;
		}
		to = find_cut(area, count, from, to < end ? to : end, &blocked);
		if (to == from) {
			*ret_area = blocked;
			return -E2BIG;
		}
		if (from < plan->output_bytes && to > plan->output_bytes &&
		    is_lrw_forbidden(area, count, from, to)) {
			to = plan->output_bytes;
		}
		add_chunk(plan, area, count, from, to, &fill);
		from = to;
	}
	return 0;
}
