/* SPDX-License-Identifier: MIT */
#include "record/sample_feed.h"

#include <errno.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>

#include "base/clock.h"
#include "reader/utc.h"

#define EVENT_LEAD_NS (100 * NS_PER_MS)

struct sample_feed {
	struct reader *reader;
	struct sink *sink;
	struct layout *layout;
	struct utc *utc;
	int has_ended; /* the reader has said so */
	uint64_t next_cycle;
	int has_next;          /* next_cycle is known: what is not it is a gap */
	uint64_t first_cycle;  /* taken by this feed, where it knew of none before */
	int is_catching_up;    /* what is before next_cycle was recorded before */
	int has_lost_slots;    /* since the newest sample taken */
	uint64_t missed_start; /* slots that had left the ring when we came */
	int64_t utc_ns;        /* of the newest sample */
};

/* A resume point beyond what the master has made is not of this ring, whatever it says. */
static int resume_is_believable(struct sample_feed *s, const struct store_state *resume)
{
	if (resume->session != sample_feed_number(s) || resume->cycles == 0) {
		return 0;
	}
	return resume->next_cycle <=
	       (reader_read_newest(s->reader) ? reader_header(s->reader)->cycle + 1 : 0);
}

static void go_to_start(struct sample_feed *s)
{
	uint64_t oldest = reader_oldest(s->reader);

	reader_seek(s->reader, oldest);
	s->has_ended = 0;
	s->is_catching_up = s->has_next;
	s->missed_start = s->has_next ? 0 : oldest;
}

int sample_feed_create(struct reader *reader, struct sink *sink, enum config_record_values values,
		       struct sample_feed **ret_session)
{
	const struct channel_table *table = reader_table(reader);
	const struct store_state *resume = sink_resume_point(sink);
	struct sample_feed *s = calloc(1, sizeof(*s));
	int r;

	if (s == NULL) {
		return -ENOMEM;
	}
	s->reader = reader;
	s->sink = sink;
	s->utc = utc_create(&table->meta);
	r = s->utc == NULL ? -ENOMEM : layout_create(table, values, &s->layout);
	if (r < 0) {
		sample_feed_destroy(s);
		return r;
	}
	s->has_next = resume_is_believable(s, resume);
	s->next_cycle = s->has_next ? resume->next_cycle : 0;
	go_to_start(s);
	sink_begin_session(sink, s->layout, s->has_next ? SINK_KNOWN_SESSION : SINK_NEW_SESSION);
	*ret_session = s;
	return 0;
}

void sample_feed_destroy(struct sample_feed *s)
{
	if (s == NULL) {
		return;
	}
	utc_destroy(s->utc);
	layout_destroy(s->layout);
	free(s);
}

uint64_t sample_feed_number(const struct sample_feed *s)
{
	return reader_table(s->reader)->meta.session;
}

uint64_t sample_feed_missed_start(const struct sample_feed *s)
{
	return s->missed_start;
}

void sample_feed_rewind(struct sample_feed *s)
{
	const struct store_state *resume = sink_resume_point(s->sink);

	if (resume->session == sample_feed_number(s)) {
		s->next_cycle = resume->cycles > 0 ? resume->next_cycle : s->first_cycle;
		s->has_next = s->has_next || resume->cycles > 0;
	}
	go_to_start(s);
}

void sample_feed_note_clock(struct sample_feed *s, const struct clock_quality *quality)
{
	utc_note_clock(s->utc, quality);
}

static int map_sample(struct sample_feed *s, const struct sample_header *h)
{
	struct timemap_state state;
	int r = utc_feed(s->utc, h, &s->utc_ns);

	if (r < 0) {
		return r;
	}
	switch (utc_changed(s->utc, &state)) {
	case UTC_UNCHANGED:
		break;
	case UTC_UPDATED:
		return sink_timemap(s->sink, &state);
	case UTC_STEPPED:
		return sink_clock_step(s->sink, &state);
	}
	return 0;
}

static int put_gap(struct sample_feed *s, uint64_t first, uint64_t count, const char *why)
{
	char text[160];
	struct messages_event ev = {
		.event = { .id = EVENT_RECORD_GAP,
			   .cycle = first,
			   .value = (int64_t)first,
			   .arg = { count > INT32_MAX ? INT32_MAX : (int32_t)count },
			   .slave_pos = EVENT_NO_SLAVE },
		.sequence = UINT64_MAX,
		.utc_ns = s->utc_ns,
		.text = text,
	};
	int r;

	snprintf(text, sizeof(text),
		 "recording has a gap: %" PRIu64 " cycles from %" PRIu64 " on: %s", count, first,
		 why);
	r = sink_event(s->sink, &ev);
	if (r == 0) {
		sink_count_gap(s->sink, count);
	}
	return r;
}

/* A sample that is not the one that should follow. */
static int mind_gap(struct sample_feed *s, uint64_t cycle)
{
	int r;

	if (!s->has_next || cycle == s->next_cycle) {
		return 0;
	}
	if (cycle > s->next_cycle) {
		r = put_gap(s, s->next_cycle, cycle - s->next_cycle,
			    s->has_lost_slots || s->is_catching_up
				    ? "they had left the ring before they could be read"
				    : "the master made no sample for them");
	} else {
		r = put_gap(s, cycle, 0, "the cycle number went back");
	}
	if (r == 0) {
		s->next_cycle = cycle; /* told: if the sample itself fails now, not again */
	}
	return r;
}

static int take_sample(struct sample_feed *s)
{
	const struct sample_header *h = reader_header(s->reader);
	int r;

	if (s->is_catching_up && h->cycle < s->next_cycle) {
		return 0;
	}
	r = map_sample(s, h);
	r = r < 0 ? r : sink_open_file(s->sink, h->cycle, s->utc_ns);
	r = r < 0 ? r : mind_gap(s, h->cycle);
	r = r < 0 ? r : sink_sample(s->sink, h, reader_image(s->reader), s->utc_ns);
	if (r < 0) {
		return r;
	}
	s->has_lost_slots = 0;
	s->is_catching_up = 0;
	s->first_cycle = s->has_next ? s->first_cycle : h->cycle;
	s->has_next = 1;
	s->next_cycle = h->cycle + 1;
	return 0;
}

enum sample_feed_result sample_feed_read(struct sample_feed *s, unsigned most)
{
	for (unsigned n = 0; n < most && !s->has_ended; n++) {
		uint64_t lost;

		switch (reader_next(s->reader, &lost)) {
		case READER_SAMPLE:
			if (take_sample(s) < 0) {
				reader_seek(s->reader, reader_cursor(s->reader) - 1);
				return SAMPLE_FEED_STUCK;
			}
			if (sink_state(s->sink) != SINK_READY) {
				return SAMPLE_FEED_STUCK;
			}
			break;
		case READER_LOST:
			s->has_lost_slots = 1;
			break;
		case READER_EMPTY:
			return SAMPLE_FEED_EMPTY;
		case READER_BEGUN:
		case READER_WAITING:
		case READER_ENDED:
			s->has_ended = 1;
			break;
		}
	}
	return s->has_ended ? SAMPLE_FEED_ENDED : SAMPLE_FEED_MORE;
}

int sample_feed_is_behind(const struct sample_feed *s, const struct event *ev)
{
	return utc_of_tai(s->utc, ev->tai_ns) > s->utc_ns;
}

int sample_feed_sync0(struct sample_feed *s, const struct sync0_result *result, uint64_t sequence)
{
	int64_t utc_ns = utc_of_tai(s->utc, result->tai_ns);
	int r = sink_open_file(s->sink, s->next_cycle, s->utc_ns != 0 ? s->utc_ns : utc_ns);

	return r < 0 ? r : sink_sync0(s->sink, result, utc_ns, sequence);
}

int sample_feed_event(struct sample_feed *s, const struct event *ev, uint64_t sequence)
{
	int64_t utc_ns = utc_of_tai(s->utc, ev->tai_ns);
	char text[256];
	/* The next sample's SYNC0 may be a little older than the event: its time must not be pushed
	 * up. */
	int64_t start_ns = s->utc_ns != 0 ? s->utc_ns : utc_ns - EVENT_LEAD_NS;
	int r = sink_open_file(s->sink, s->next_cycle, start_ns);

	event_format(ev, text, sizeof(text));
	return r < 0 ? r
		     : sink_event(s->sink, &(struct messages_event){ .event = *ev,
								     .sequence = sequence,
								     .utc_ns = utc_ns,
								     .text = text });
}
