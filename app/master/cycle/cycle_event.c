/* SPDX-License-Identifier: MIT */
/* Events of the cycle, each kind limited in rate. */
#include "base/ring.h"
#include "cycle/cycle_internal.h"

enum {
	EVENT_WINDOW_CYCLES = 1000, /* in this many cycles ... */
	EVENT_WINDOW_LIMIT = 20,    /* ... at most this many events of one kind */
};

void cycle_emit(struct cycle *cycle, struct event *ev)
{
	struct event_gate *gate = &cycle->gate[ev->id < EVENT_COUNT ? ev->id : 0];
	uint64_t window = cycle->steps / EVENT_WINDOW_CYCLES;

	/* A broken cable must not flood the ring; the counters have every one. */
	if (gate->window != window) {
		*gate = (struct event_gate){ .window = window, .count = 0 };
	}
	if (gate->count++ >= EVENT_WINDOW_LIMIT) {
		return;
	}
	ev->mono_ns = cycle->sample.wake_mono_ns;
	ev->tai_ns = cycle->sample.wake_tai_ns;
	ev->cycle = cycle->sample.cycle;
	ring_push(cycle->spec.events, ev, sizeof(*ev), NULL, 0);
}

void cycle_note(struct cycle *cy, enum event_id id, int64_t value, int64_t arg0, int64_t arg1)
{
	struct event ev = {
		.id = (uint16_t)id,
		.slave_pos = EVENT_NO_SLAVE,
		.value = value,
		.arg = { arg0 > INT32_MAX ? INT32_MAX : (int32_t)arg0,
			 arg1 > INT32_MAX ? INT32_MAX : (int32_t)arg1 },
	};

	cycle_emit(cy, &ev);
}
