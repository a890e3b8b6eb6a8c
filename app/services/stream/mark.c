/* SPDX-License-Identifier: MIT */
#include "stream/mark.h"

#include <errno.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>

#include "base/clock.h"

/* Two programs map one event to UTC a little differently; a machine takes longer to restart. */
#define TIME_MARGIN_NS NS_PER_S

static const char *const names[MARK_FIELDS] = {
	[MARK_SESSION] = "Ecdaq-Session",       [MARK_FIRST_CYCLE] = "Ecdaq-First-Cycle",
	[MARK_NEXT_CYCLE] = "Ecdaq-Next-Cycle", [MARK_EVENT_NEXT] = "Ecdaq-Event-Next",
	[MARK_EVENT_MONO] = "Ecdaq-Event-Mono", [MARK_EVENT_TIME] = "Ecdaq-Event-Time",
};

const char *mark_name(enum mark_field field)
{
	return names[field];
}

int mark_has(const struct mark *mark, enum mark_field field)
{
	return (mark->has >> field & 1u) != 0;
}

void mark_set(struct mark *mark, enum mark_field field, uint64_t value)
{
	mark->value[field] = value;
	mark->has |= 1u << field;
}

void mark_format(const struct mark *mark, enum mark_field field, char buf[MARK_TEXT_BYTES])
{
	snprintf(buf, MARK_TEXT_BYTES, "%" PRIu64, mark->value[field]);
}

void mark_take(struct mark *mark, enum mark_field field, const char *text)
{
	char *end;
	uint64_t value;

	if (text[0] < '0' || text[0] > '9') { /* strtoull() takes blanks and signs */
		return;
	}
	errno = 0;
	value = strtoull(text, &end, 10);
	if (*end == '\0' && errno == 0) {
		mark_set(mark, field, value);
	}
}

int mark_is_block(const struct mark *mark)
{
	return mark_has(mark, MARK_SESSION) && mark_has(mark, MARK_FIRST_CYCLE) &&
	       mark_has(mark, MARK_NEXT_CYCLE) &&
	       mark->value[MARK_FIRST_CYCLE] < mark->value[MARK_NEXT_CYCLE];
}

int mark_event_is_new(const struct mark *mark, uint64_t sequence, int64_t mono_ns, int64_t time_ns)
{
	if (!mark_has(mark, MARK_EVENT_NEXT) || sequence >= mark->value[MARK_EVENT_NEXT]) {
		return 1;
	}
	/* Each ecdaqd counts from 0: what is later is of a later one, by the clock that goes on
	 * over its restarts, or by the one that goes on over those of the machine. */
	return mono_ns > (int64_t)mark->value[MARK_EVENT_MONO] ||
	       time_ns > (int64_t)mark->value[MARK_EVENT_TIME] + TIME_MARGIN_NS;
}
