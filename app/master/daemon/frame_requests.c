/* SPDX-License-Identifier: MIT */
/* Requests of the admin socket about the cyclic frames. */
#include <errno.h>
#include <stdlib.h>
#include <string.h>

#include "bus/exchange_list.h"
#include "daemon/session_internal.h"

/* Of all chunks, and those of registers and fillers. */
enum { DATAGRAMS_MAX = LIMIT_CHUNKS + 4 * LIMIT_FRAMES };

static_assert(DATAGRAMS_MAX * sizeof(struct admin_datagram) <= ADMIN_TRANSFER_BYTES, "one answer");
static_assert((int)ADMIN_WKC_UNKNOWN == (int)EXCHANGE_WKC_UNKNOWN, "one meaning");

static void answer_list(struct admin_pending *pending, const struct exchange_datagram *list,
			size_t count)
{
	uint8_t *room = admin_pending_reserve(pending, count * sizeof(struct admin_datagram));

	if (room == NULL) {
		admin_pending_complete(pending, -ENOMEM);
		return;
	}
	for (size_t i = 0; i < count; i++) {
		const struct admin_datagram dg = {
			.command = list[i].command,
			.frame = list[i].frame,
			.bytes = list[i].bytes,
			.address = list[i].address,
			.wkc_expected = list[i].wkc_expected,
			.wkc = list[i].wkc,
		};

		memcpy(room + i * sizeof(dg), &dg, sizeof(dg));
	}
	admin_pending_answer_len(pending, count * sizeof(struct admin_datagram));
	admin_pending_complete(pending, 0);
}

void session_list_datagrams(struct session *s, struct admin_pending *pending)
{
	const struct exchange_plan *plan = s->bus == NULL ? NULL : bus_plan(s->bus);
	struct exchange_datagram *list;
	int r;

	if (plan == NULL || plan->slave_count == 0) {
		admin_pending_refuse(pending, -EAGAIN,
				     s->bus == NULL ? "the bus is down"
						    : "the process data are not mapped");
		return;
	}
	list = calloc(DATAGRAMS_MAX, sizeof(*list));
	if (list == NULL) {
		admin_pending_complete(pending, -ENOMEM);
		return;
	}
	r = exchange_list(plan, s->exchange, list, DATAGRAMS_MAX);
	if (r < 0) {
		admin_pending_complete(pending, r);
	} else {
		answer_list(pending, list, (size_t)r);
	}
	free(list);
}
