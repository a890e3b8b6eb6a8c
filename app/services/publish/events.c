/* SPDX-License-Identifier: MIT */
#include "publish/events.h"

#include <stdio.h>
#include <string.h>

#include "base/event.h"
#include "ecdaq.h"
#include "publish/samples.h"

enum { EVENTS_A_STEP = 64, TEXT_BYTES = 256, NAME_BYTES = 64 };

static const char *severity_name(uint16_t id)
{
	switch (event_severity(id)) {
	case EVENT_INFO:
		return "info";
	case EVENT_NOTICE:
		return "notice";
	case EVENT_WARNING:
		return "warning";
	case EVENT_ERROR:
		break;
	}
	return "error";
}

void events_follow(struct events *events)
{
	if (events->ring != NULL && ring_is_replaced(events->ring)) {
		events_close(events);
	}
	if (events->ring != NULL || ring_reader_open(events->path, &events->ring) < 0) {
		return;
	}
	if (strcmp(ring_kind(events->ring), "event") != 0 ||
	    ring_payload_bytes(events->ring) != sizeof(struct event)) {
		events_close(events);
		return;
	}
	/* What happened before we came is in the recording; of a new master we tell all. */
	if (events->was_open) {
		ring_seek(events->ring, ring_oldest(events->ring));
	}
	events->was_open = 1;
}

static void put(const struct topics *topics, const struct samples *samples, const struct event *ev)
{
	char text[TEXT_BYTES];
	char name[NAME_BYTES];
	char severity[16];
	ecdaq_EventV1 m = {
		.session = samples == NULL ? 0 : samples_table(samples)->meta->session,
		.cycle = ev->cycle,
		.utc_ns = samples == NULL ? ev->tai_ns : samples_utc_of_tai(samples, ev->tai_ns),
		.name = name,
		.severity = severity,
		.slave = ev->slave_pos == EVENT_NO_SLAVE ? -1 : ev->slave_pos,
		.value = ev->value,
		.arg0 = ev->arg[0],
		.arg1 = ev->arg[1],
		.text = text,
	};

	event_format(ev, text, sizeof(text));
	snprintf(name, sizeof(name), "%s", event_name(ev->id));
	snprintf(severity, sizeof(severity), "%s", severity_name(ev->id));
	(void)topics_write(topics->event, &m, m.utc_ns);
}

void events_step(struct events *events, const struct topics *topics, const struct samples *samples)
{
	struct event ev;
	uint64_t lost;

	for (unsigned n = 0; events->ring != NULL && n < EVENTS_A_STEP; n++) {
		enum ring_result result = ring_read(events->ring, &ev, sizeof(ev), &lost);

		if (result != RING_OK && result != RING_LOST) {
			return;
		}
		if (result == RING_OK) {
			put(topics, samples, &ev);
		}
	}
}

void events_close(struct events *events)
{
	ring_reader_destroy(events->ring);
	events->ring = NULL;
}
