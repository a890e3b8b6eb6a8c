/* SPDX-License-Identifier: MIT */
#include "stream/event_lane.h"

#include <inttypes.h>
#include <stdio.h>
#include <string.h>

#include "base/bytes.h"

enum { TIME_AT = 4 }; /* of the first field of an event message, behind the CDR header */

void event_lane_init(struct event_lane *e, const char *appliance)
{
	*e = (struct event_lane){ .sequence = 0 };
	snprintf(e->subject, sizeof(e->subject), "ecdaq.%s.event", appliance);
}

void event_lane_start(struct event_lane *e, const struct broker_newest *newest)
{
	e->sequence = newest == NULL ? 0 : newest->sequence;
	e->mark = newest == NULL ? (struct mark){ .has = 0 } : newest->mark;
}

int event_lane_feed_mark(const struct event_lane *e, struct feed_mark *ret_mark)
{
	if (!mark_has(&e->mark, MARK_EVENT_NEXT) || !mark_has(&e->mark, MARK_EVENT_MONO)) {
		return 0;
	}
	ret_mark->next = e->mark.value[MARK_EVENT_NEXT];
	ret_mark->mono_ns = (int64_t)e->mark.value[MARK_EVENT_MONO];
	return 1;
}

static void make(struct event_lane *e, uint64_t session, size_t len, struct broker_message *ret)
{
	*ret = (struct broker_message){ .subject = e->subject,
					.mark = e->mark,
					.after = e->sequence,
					.data = e->data,
					.len = len };
	mark_set(&ret->mark, MARK_SESSION, session);
}

static void mark_event(struct broker_message *m, uint64_t sequence, int64_t mono_ns,
		       int64_t time_ns)
{
	mark_set(&m->mark, MARK_EVENT_NEXT, sequence + 1);
	mark_set(&m->mark, MARK_EVENT_MONO, (uint64_t)mono_ns);
	mark_set(&m->mark, MARK_EVENT_TIME, (uint64_t)time_ns);
	snprintf(m->id, sizeof(m->id), "event-%" PRId64 "-%" PRIu64, mono_ns, sequence);
}

void event_lane_message(struct event_lane *e, const struct messages_event *ev, uint64_t session,
			struct broker_message *ret)
{
	make(e, session, messages_encode_event(ev, e->data), ret);
	if (ev->sequence != UINT64_MAX) {
		mark_event(ret, ev->sequence, ev->event.mono_ns, ev->utc_ns);
	} else {
		snprintf(ret->id, sizeof(ret->id), "%" PRIu64 "-%s-%" PRId64, session,
			 event_name(ev->event.id), ev->event.value);
	}
}

int event_lane_recorded(struct event_lane *e, const uint8_t *data, size_t len, uint64_t session,
			struct broker_message *ret)
{
	uint64_t sequence;
	int64_t mono_ns;
	int64_t time_ns;

	if (len > sizeof(e->data) || messages_decode_event(data, len, &sequence, &mono_ns) < 0) {
		return 0;
	}
	time_ns = (int64_t)get_le64(data + TIME_AT);
	if (sequence == UINT64_MAX || !mark_event_is_new(&e->mark, sequence, mono_ns, time_ns)) {
		return 0;
	}
	memcpy(e->data, data, len);
	make(e, session, len, ret);
	mark_event(ret, sequence, mono_ns, time_ns);
	return 1;
}

void event_lane_stored(struct event_lane *e, const struct broker_message *message)
{
	e->sequence = message->sequence;
	e->mark = message->mark;
}
