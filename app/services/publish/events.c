/* SPDX-License-Identifier: MIT */
#include "publish/events.h"

#include <stdio.h>

#include "base/event.h"
#include "ecdaq.h"
#include "publish/samples.h"

enum { EVENTS_A_STEP = 64, TEXT_BYTES = 256, NAME_BYTES = 64 };

static void put(const struct topics *topics, const struct samples *samples, const struct event *ev)
{
	char text[TEXT_BYTES];
	char name[NAME_BYTES];
	char severity[16];
	ecdaq_EventV1 m = {
		.session = samples == NULL ? 0 : samples_table(samples)->meta.session,
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
	snprintf(severity, sizeof(severity), "%s", event_severity_to_str(event_severity(ev->id)));
	(void)topics_write(topics->event, &m, m.utc_ns);
}

void events_step(struct feed *feed, const struct topics *topics, const struct samples *samples)
{
	struct event ev;
	uint64_t lost = 0;

	for (unsigned n = 0; n < EVENTS_A_STEP && feed_read(feed, &ev, sizeof(ev), NULL, &lost);
	     n++) {
		put(topics, samples, &ev);
	}
}
