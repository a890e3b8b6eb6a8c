/* SPDX-License-Identifier: MIT */
/* The request of the admin socket that compares what is configured with what is found. */
#include <errno.h>
#include <stdio.h>
#include <string.h>

#include "bus/differences.h"
#include "daemon/session_internal.h"

static int answer(struct admin_pending *pending, const struct differences *list)
{
	size_t bytes = list->count * sizeof(*list->at);
	uint8_t *room;

	if (bytes == 0) {
		return 0;
	}
	room = admin_pending_reserve(pending, bytes);
	if (room == NULL) {
		return -ENOMEM;
	}
	memcpy(room, list->at, bytes);
	admin_pending_answer_len(pending, bytes);
	return 0;
}

void session_compare_request(const struct session *s, struct admin_pending *pending)
{
	struct differences list = { .at = NULL };
	int r = differences_of_bus(s->bus, s->spec.cfg, &list);

	r = r < 0 ? r : answer(pending, &list);
	differences_free(&list);
	if (r == 0) {
		snprintf(pending->reply.text, sizeof(pending->reply.text), "%s", s->spec.cfg->path);
	}
	admin_pending_complete(pending, r);
}
