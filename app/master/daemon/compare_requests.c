/* SPDX-License-Identifier: MIT */
/* Requests of the admin socket about what is configured: compared with what is found, and as the
 * start-up SDOs that follow from it. */
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

void session_startup_request(const struct session *s, struct admin_pending *pending)
{
	size_t pos = pending->request.slave_pos;
	size_t bytes = s->bus == NULL ? 0 : bus_startup_list(s->bus, pos, NULL, 0);
	uint8_t *room;

	if (s->bus == NULL) {
		admin_pending_refuse(pending, -EAGAIN, "the bus is down");
		return;
	}
	snprintf(pending->reply.text, sizeof(pending->reply.text), "%s", s->spec.cfg->path);
	if (bytes > 0) {
		room = admin_pending_reserve(pending, bytes);
		if (room == NULL) {
			admin_pending_complete(pending, -ENOMEM);
			return;
		}
		bus_startup_list(s->bus, pos, room, bytes);
		admin_pending_answer_len(pending, bytes);
	}
	admin_pending_complete(pending, 0);
}
