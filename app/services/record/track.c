/* SPDX-License-Identifier: MIT */
#include "record/track.h"

#include <stdlib.h>

#include "record/messages.h"

void track_init(struct track *t)
{
	*t = (struct track){ .cycle_channel = -1, .event_channel = -1 };
}

static uint64_t number_of(const struct mcap_item *item, const char *key)
{
	char text[32];

	return mcap_pairs_get(item, key, text, sizeof(text)) == 0 ? strtoull(text, NULL, 0) : 0;
}

static void take_metadata(struct track *t, const struct mcap_item *item)
{
	if (!mcap_text_is(item->name, "ecdaq.session")) {
		return;
	}
	t->has_session = 1;
	t->before = (struct store_state){
		.session = number_of(item, "session"),
		.next_cycle = number_of(item, "next_cycle"),
		.first_cycle = number_of(item, "first_cycle"),
		.cycles = number_of(item, "cycles_before"),
		.gaps = number_of(item, "gaps_before"),
		.missing = number_of(item, "cycles_missing_before"),
		.event_next = number_of(item, "event_next"),
		.event_mono_ns = (int64_t)number_of(item, "event_mono_ns"),
		.sequence = number_of(item, "file_sequence"),
	};
	t->event_next = t->before.event_next;
	t->event_mono_ns = t->before.event_mono_ns;
}

static void take_channel(struct track *t, const struct mcap_item *item)
{
	if (mcap_text_is(item->name, messages_topic(MESSAGE_CYCLE))) {
		t->cycle_channel = item->id;
	} else if (mcap_text_is(item->name, messages_topic(MESSAGE_EVENT))) {
		t->event_channel = item->id;
	}
}

static void report(struct track *t, uint64_t first, uint64_t count)
{
	if (t->gap != NULL) {
		t->gap(t->ctx, first, count);
	}
}

static void take_cycle(struct track *t, const struct mcap_item *item)
{
	uint64_t cycle;

	if (messages_decode_cycle(item->data, item->data_len, &cycle) < 0) {
		return;
	}
	if (t->cycles == 0) {
		t->first_cycle = cycle;
		t->start_ns = item->log_time_ns;
	} else if (cycle <= t->last_cycle) {
		t->backward++;
		report(t, cycle, 0);
	} else if (cycle > t->last_cycle + 1) {
		t->gaps++;
		t->missing += cycle - t->last_cycle - 1;
		report(t, t->last_cycle + 1, cycle - t->last_cycle - 1);
	}
	t->cycles++;
	t->last_cycle = cycle;
	t->end_ns = item->log_time_ns;
}

static void take_event(struct track *t, const struct mcap_item *item)
{
	uint64_t sequence;
	int64_t mono_ns;

	t->events++;
	if (messages_decode_event(item->data, item->data_len, &sequence, &mono_ns) == 0 &&
	    sequence != UINT64_MAX) {
		t->event_next = sequence + 1;
		t->event_mono_ns = mono_ns;
	}
}

void track_item(struct track *t, const struct mcap_item *item)
{
	if (item->kind == MCAP_ITEM_METADATA) {
		take_metadata(t, item);
	} else if (item->kind == MCAP_ITEM_CHANNEL) {
		take_channel(t, item);
	} else if (item->kind == MCAP_ITEM_MESSAGE && item->id == t->cycle_channel) {
		take_cycle(t, item);
	} else if (item->kind == MCAP_ITEM_MESSAGE && item->id == t->event_channel) {
		take_event(t, item);
	}
}

void track_visit(void *track, const struct mcap_item *item)
{
	track_item(track, item);
}

struct store_state track_state(const struct track *t)
{
	struct store_state s = t->before;

	s.event_next = t->event_next;
	s.event_mono_ns = t->event_mono_ns;
	if (t->cycles == 0) {
		return s;
	}
	if (s.cycles == 0) {
		s.first_cycle = t->first_cycle;
	} else if (t->first_cycle > s.next_cycle) { /* a gap right at the start of the file */
		s.gaps++;
		s.missing += t->first_cycle - s.next_cycle;
	}
	s.cycles += t->cycles;
	s.gaps += t->gaps;
	s.missing += t->missing;
	s.next_cycle = t->last_cycle + 1;
	return s;
}
