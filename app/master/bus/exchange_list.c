/* SPDX-License-Identifier: MIT */
#include "bus/exchange_list.h"

#include <errno.h>

#include "bus/exchange.h"
#include "bus/exchange_frame.h"
#include "wire/datagram.h"

struct list {
	const struct exchange_plan *plan;
	const struct exchange *ex;
	struct exchange_datagram *ret;
	size_t capacity;
	size_t count;
};

/* What is known of the datagram whose header is at @at. */
static void describe(const struct list *list, const struct exchange_frame *ef, size_t at,
		     struct exchange_datagram *dg)
{
	enum exchange_seen which = EXCHANGE_SEEN_NONE;
	unsigned chunk = 0;

	dg->wkc_expected = EXCHANGE_WKC_UNKNOWN;
	for (unsigned i = 0; i < ef->part_count; i++) {
		if (ef->part[i].at == at) {
			which = EXCHANGE_SEEN_CHUNK;
			chunk = ef->part[i].chunk;
			dg->wkc_expected = list->plan->chunk_wkc[chunk];
		}
	}
	if (at == ef->dc) {
		which = EXCHANGE_SEEN_DC;
	} else if (at == ef->al) {
		which = EXCHANGE_SEEN_AL;
		dg->wkc_expected = list->plan->slave_count;
	} else if (at == ef->diff) {
		which = EXCHANGE_SEEN_DIFF;
	} else if (at == ef->mailboxes) {
		which = EXCHANGE_SEEN_MAILBOXES;
		dg->wkc_expected = list->plan->mailbox_bits;
	}
	dg->wkc =
		list->ex == NULL ? EXCHANGE_WKC_UNKNOWN : exchange_wkc_seen(list->ex, which, chunk);
}

static int add_frame(struct list *list, unsigned number)
{
	struct exchange_frame ef;
	struct ecat_datagram found;
	size_t pos = 0;
	int r = exchange_frame_build(list->plan, number, &ef);

	if (r < 0) {
		return r;
	}
	while (ecat_frame_next(ef.bytes, ef.len, &pos, &found) == 1) {
		struct exchange_datagram *dg = &list->ret[list->count];

		if (list->count == list->capacity) {
			return -E2BIG;
		}
		*dg = (struct exchange_datagram){
			.command = found.cmd,
			.frame = (uint8_t)number,
			.bytes = found.data_len,
			.address = ecat_logical_address(&found),
		};
		describe(list, &ef, (size_t)(found.data - ef.bytes) - ECAT_DATAGRAM_HEADER_BYTES,
			 dg);
		list->count++;
	}
	return 0;
}

int exchange_list(const struct exchange_plan *plan, const struct exchange *ex,
		  struct exchange_datagram *ret, size_t capacity)
{
	struct list list = { .plan = plan, .ex = ex, .ret = ret, .capacity = capacity };

	if (plan->chunk_count > LIMIT_CHUNKS || exchange_frame_count(plan) > LIMIT_FRAMES) {
		return -EINVAL;
	}
	for (unsigned i = 0; i < exchange_frame_count(plan); i++) {
		int r = add_frame(&list, i);

		if (r < 0) {
			return r;
		}
	}
	return (int)list.count;
}
