/* SPDX-License-Identifier: MIT */
/*
 * When a picture of samples is taken: conditions on one channel's values, on samples and on events,
 * with a hold-off. Fed with samples in the order of their cycles. Context: any.
 */
#ifndef WEB_TRIGGER_H
#define WEB_TRIGGER_H

#include <stdint.h>

#include "base/sample.h"

enum trigger_kind {
	TRIGGER_NONE,
	TRIGGER_RISING,  /* the value passes @level upwards */
	TRIGGER_FALLING, /* downwards */
	TRIGGER_ABOVE,   /* it is @level or more */
	TRIGGER_BELOW,   /* it is @level or less */
	TRIGGER_ENTERS,  /* it comes between @level and @level2 */
	TRIGGER_LEAVES,  /* it was between them and is not any more */
	TRIGGER_BAD,     /* the first sample that is not good for the channel's slave */
	TRIGGER_LOST,    /* the first cycle without a frame: SAMPLE_LOST or SAMPLE_SKIPPED */
	TRIGGER_EVENT,   /* a cycle of @events */
	TRIGGER_KINDS,
};

/** "rising"; "none". */
const char *trigger_kind_to_str(enum trigger_kind kind);

struct trigger {
	enum trigger_kind kind;
	uint32_t channel; /* index in the table */
	double level;
	double level2;
	uint64_t before; /* cycles of the picture that are before it */
	uint64_t hold;   /* cycles after a trigger in which there is no other one */
	uint64_t last;   /* the cycle of the last one; 0: there was none */
	/* TRIGGER_EVENT: cycles with an event, ascending. */
	const uint64_t *events;
	uint32_t event_count;
};

/** Does the kind depend on the channel's value, or on its slave? */
int trigger_has_channel(const struct trigger *trigger);

/* A search for the newest one. */
struct trigger_search {
	const struct trigger *trigger;
	uint64_t found_cycle;
	int is_found;
	/* Of the sample before. */
	int has_before;
	uint64_t cycle_before;
	double value_before;
	int is_lost_before;
	uint32_t next_event;
};

/** In samples from cycle @first on. A last trigger from there on is found until there is another.
 */
void trigger_begin(struct trigger_search *search, const struct trigger *trigger, uint64_t first);
/** The next sample; @value NaN: it is not good for the channel's slave. */
void trigger_add(struct trigger_search *search, const struct sample_header *header, double value);

#endif
