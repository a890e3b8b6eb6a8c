/* SPDX-License-Identifier: MIT */
#include "web/trigger.h"

#include <math.h>

const char *trigger_kind_to_str(enum trigger_kind kind)
{
	static const char *const names[] = {
		[TRIGGER_NONE] = "none",       [TRIGGER_RISING] = "rising",
		[TRIGGER_FALLING] = "falling", [TRIGGER_ABOVE] = "above",
		[TRIGGER_BELOW] = "below",     [TRIGGER_ENTERS] = "enters",
		[TRIGGER_LEAVES] = "leaves",   [TRIGGER_BAD] = "bad",
		[TRIGGER_LOST] = "lost",       [TRIGGER_EVENT] = "event",
	};

	return names[kind];
}

int trigger_has_channel(const struct trigger *trigger)
{
	return trigger->kind != TRIGGER_NONE && trigger->kind != TRIGGER_LOST &&
	       trigger->kind != TRIGGER_EVENT;
}

void trigger_begin(struct trigger_search *search, const struct trigger *trigger, uint64_t first)
{
	*search = (struct trigger_search){ .trigger = trigger, .value_before = (double)NAN };
	if (trigger->last >= first && trigger->last != 0) {
		search->found_cycle = trigger->last;
		search->is_found = 1;
	}
}

static int is_between(const struct trigger *t, double value)
{
	return (value >= t->level && value <= t->level2) ||
	       (value >= t->level2 && value <= t->level);
}

/* The first of a row: what is before a missing cycle is not known and counts as good. */
static int is_first_bad(const struct trigger_search *s, int is_next, int is_bad, int was_bad)
{
	return is_bad && s->has_before && !(is_next && was_bad);
}

static int is_event(struct trigger_search *s, uint64_t cycle)
{
	const struct trigger *t = s->trigger;

	while (s->next_event < t->event_count && t->events[s->next_event] < cycle) {
		s->next_event++;
	}
	return s->next_event < t->event_count && t->events[s->next_event] == cycle;
}

static int is_passed(struct trigger_search *s, const struct sample_header *header, double now)
{
	const struct trigger *t = s->trigger;
	int is_next = s->has_before && header->cycle == s->cycle_before + 1;
	/* Across a gap nothing is known: NaN compares as false. */
	double before = is_next ? s->value_before : (double)NAN;

	switch (t->kind) {
	case TRIGGER_RISING:
		return before < t->level && now >= t->level;
	case TRIGGER_FALLING:
		return before > t->level && now <= t->level;
	case TRIGGER_ABOVE:
		return now >= t->level;
	case TRIGGER_BELOW:
		return now <= t->level;
	case TRIGGER_ENTERS:
		return !isnan(before) && !is_between(t, before) && is_between(t, now);
	case TRIGGER_LEAVES:
		return is_between(t, before) && !isnan(now) && !is_between(t, now);
	case TRIGGER_BAD:
		return is_first_bad(s, is_next, isnan(now), isnan(s->value_before));
	case TRIGGER_LOST:
		return is_first_bad(s, is_next,
				    (header->flags & (SAMPLE_LOST | SAMPLE_SKIPPED)) != 0,
				    s->is_lost_before);
	case TRIGGER_EVENT:
		return is_event(s, header->cycle);
	case TRIGGER_NONE:
	case TRIGGER_KINDS:
		break;
	}
	return 0;
}

void trigger_add(struct trigger_search *s, const struct sample_header *header, double value)
{
	const struct trigger *t = s->trigger;

	if (is_passed(s, header, value) && header->cycle >= t->before &&
	    (!s->is_found || header->cycle > s->found_cycle + t->hold)) {
		s->is_found = 1;
		s->found_cycle = header->cycle;
	}
	s->has_before = 1;
	s->cycle_before = header->cycle;
	s->value_before = value;
	s->is_lost_before = (header->flags & (SAMPLE_LOST | SAMPLE_SKIPPED)) != 0;
}
