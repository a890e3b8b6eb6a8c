/* SPDX-License-Identifier: MIT */
#include "record/sample_feed.h"

#include <errno.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "base/timemap.h"

#define EVENT_LEAD_NS (100 * NS_PER_MS)

enum time_base {
	TIME_UNKNOWN,
	TIME_DC,     /* the samples' DC time */
	TIME_CYCLES, /* no DC: cycle number times period stands in for it */
};

struct sample_feed {
	struct ring_reader *ring;
	struct sink *sink;
	struct layout *layout;
	const struct sample_meta *meta;
	struct timemap *map;
	enum time_base base;
	int64_t told_map_ns; /* dc_ns of the newest time map message */
	uint8_t *payload;    /* one slot */
	uint64_t next_cycle;
	int has_next;          /* next_cycle is known: what is not it is a gap */
	int is_catching_up;    /* what is before next_cycle was recorded before */
	int has_lost_slots;    /* since the newest sample taken */
	uint64_t missed_start; /* slots that had left the ring when we came */
	int64_t utc_ns;        /* of the newest sample */
};

static int is_sample_ring(const struct ring_reader *ring, const struct layout *layout)
{
	return strcmp(ring_kind(ring), "sample") == 0 &&
	       ring_payload_bytes(ring) >=
		       sizeof(struct sample_header) + layout_meta(layout)->image_bytes;
}

/* A resume point beyond what the master has made is not of this ring, whatever it says. */
static int resume_is_believable(struct sample_feed *s, const struct store_state *resume)
{
	struct sample_header newest;

	if (resume->session != s->meta->session) {
		return 0;
	}
	if (ring_peek_newest(s->ring, &newest, sizeof(newest)) != RING_OK) {
		return resume->next_cycle == 0;
	}
	return resume->next_cycle <= newest.cycle + 1;
}

static void go_to_start(struct sample_feed *s)
{
	uint64_t oldest = ring_oldest(s->ring);

	ring_seek(s->ring, oldest);
	s->is_catching_up = s->has_next;
	s->missed_start = s->has_next ? 0 : oldest;
}

int sample_feed_create(struct ring_reader *ring, struct sink *sink,
		       struct sample_feed **ret_session)
{
	struct sample_feed *s = calloc(1, sizeof(*s));
	const struct store_state *resume = sink_resume_point(sink);
	size_t meta_bytes;
	const void *meta = ring_meta(ring, &meta_bytes);
	int r;

	if (s == NULL) {
		return -ENOMEM;
	}
	s->ring = ring;
	s->sink = sink;
	r = layout_create(meta, meta_bytes, &s->layout);
	if (r < 0) {
		goto destroy;
	}
	s->meta = layout_meta(s->layout);
	s->map = timemap_create(s->meta->tai_offset_s);
	s->payload = malloc(ring_payload_bytes(ring));
	if (s->map == NULL || s->payload == NULL) {
		r = -ENOMEM;
		goto destroy;
	}
	if (!is_sample_ring(ring, s->layout)) {
		r = -EPROTO;
		goto destroy;
	}
	s->has_next = resume_is_believable(s, resume);
	s->next_cycle = s->has_next ? resume->next_cycle : 0;
	go_to_start(s);
	sink_begin_session(sink, s->layout, s->has_next ? SINK_KNOWN_SESSION : SINK_NEW_SESSION);
	*ret_session = s;
	return 0;

destroy:
	sample_feed_destroy(s);
	return r;
}

void sample_feed_destroy(struct sample_feed *s)
{
	if (s == NULL) {
		return;
	}
	timemap_destroy(s->map);
	layout_destroy(s->layout);
	free(s->payload);
	free(s);
}

uint64_t sample_feed_number(const struct sample_feed *s)
{
	return s->meta->session;
}

uint64_t sample_feed_missed_start(const struct sample_feed *s)
{
	return s->missed_start;
}

void sample_feed_rewind(struct sample_feed *s)
{
	const struct store_state *resume = sink_resume_point(s->sink);

	if (resume->session == s->meta->session) {
		s->next_cycle = resume->next_cycle;
		s->has_next = 1;
	}
	go_to_start(s);
}

void sample_feed_note_tai_offset(struct sample_feed *s, int32_t tai_offset_s)
{
	timemap_note_tai_offset(s->map, tai_offset_s);
}

static int64_t map_time(const struct sample_feed *s, const struct sample_header *h)
{
	return s->base == TIME_DC ? h->dc_time_ns : (int64_t)(h->cycle * s->meta->period_ns);
}

/* DC came or went: times before and after have nothing in common. */
static int set_base(struct sample_feed *s, const struct sample_header *h)
{
	enum time_base base = h->dc_time_ns != 0 ? TIME_DC : TIME_CYCLES;
	struct timemap *map;

	if (base == s->base) {
		return 0;
	}
	if (s->base != TIME_UNKNOWN) {
		map = timemap_create(s->meta->tai_offset_s);
		if (map == NULL) {
			return -ENOMEM;
		}
		timemap_destroy(s->map);
		s->map = map;
	}
	s->base = base;
	s->told_map_ns = INT64_MIN;
	return 0;
}

/* What this cycle says of DC time and the host's clock. */
static enum timemap_news feed_map(struct sample_feed *s, const struct sample_header *h)
{
	int64_t half_ns = h->round_trip_ns / 2;

	if (s->base == TIME_CYCLES) {
		int64_t late_ns = h->wake_latency_ns > 0 ? h->wake_latency_ns : 0;

		return timemap_feed(s->map, map_time(s, h), h->wake_tai_ns - late_ns, late_ns);
	}
	if (h->frame_dc_ns == 0 || h->round_trip_ns < 0) {
		return TIMEMAP_QUIET;
	}
	/* The frame left right after the wake, and passed the reference clock half a round trip
	 * later. */
	return timemap_feed(s->map, h->frame_dc_ns, h->wake_tai_ns + half_ns, half_ns);
}

static int tell_map(struct sample_feed *s, enum timemap_news news)
{
	struct timemap_state state;

	timemap_get(s->map, &state);
	if (news == TIMEMAP_STEPPED) {
		s->told_map_ns = state.dc_ns;
		return sink_clock_step(s->sink, &state);
	}
	if (s->told_map_ns != INT64_MIN && state.dc_ns - s->told_map_ns < NS_PER_S &&
	    state.dc_ns >= s->told_map_ns) {
		return 0;
	}
	s->told_map_ns = state.dc_ns;
	return sink_timemap(s->sink, &state);
}

static int map_sample(struct sample_feed *s, const struct sample_header *h)
{
	enum timemap_news news;
	int r = set_base(s, h);

	if (r < 0) {
		return r;
	}
	news = feed_map(s, h);
	/* Without one frame back there is no map yet: the wake has to do. */
	s->utc_ns = timemap_is_ready(s->map) ? timemap_utc_ns(s->map, map_time(s, h))
					     : timemap_tai_to_utc_ns(s->map, h->wake_tai_ns);
	return news != TIMEMAP_QUIET ? tell_map(s, news) : 0;
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
	struct sample_header h;
	int r;

	memcpy(&h, s->payload, sizeof(h));
	if (s->is_catching_up && h.cycle < s->next_cycle) {
		return 0;
	}
	r = map_sample(s, &h);
	r = r < 0 ? r : sink_open_file(s->sink, h.cycle, s->utc_ns);
	r = r < 0 ? r : mind_gap(s, h.cycle);
	r = r < 0 ? r : sink_sample(s->sink, &h, s->payload + sizeof(h), s->utc_ns);
	if (r < 0) {
		return r;
	}
	s->has_lost_slots = 0;
	s->is_catching_up = 0;
	s->has_next = 1;
	s->next_cycle = h.cycle + 1;
	return 0;
}

enum sample_feed_result sample_feed_read(struct sample_feed *s, unsigned most)
{
	for (unsigned n = 0; n < most;) {
		uint64_t lost = 0;

		switch (ring_read(s->ring, s->payload, ring_payload_bytes(s->ring), &lost)) {
		case RING_OK:
			n++;
			if (take_sample(s) < 0) {
				ring_seek(s->ring, ring_cursor(s->ring) - 1);
				return SAMPLE_FEED_STUCK;
			}
			if (sink_state(s->sink) != SINK_READY) {
				return SAMPLE_FEED_STUCK;
			}
			break;
		case RING_LOST:
			s->has_lost_slots = 1;
			break;
		case RING_EMPTY:
			return SAMPLE_FEED_EMPTY;
		case RING_CLOSED:
		case RING_DAMAGED:
			return SAMPLE_FEED_CLOSED;
		}
	}
	return SAMPLE_FEED_MORE;
}

int sample_feed_is_behind(const struct sample_feed *s, const struct event *ev)
{
	return timemap_tai_to_utc_ns(s->map, ev->tai_ns) > s->utc_ns;
}

int sample_feed_sync0(struct sample_feed *s, const struct sync0_result *result, uint64_t sequence)
{
	int64_t utc_ns = timemap_tai_to_utc_ns(s->map, result->tai_ns);
	int r = sink_open_file(s->sink, s->next_cycle, s->utc_ns != 0 ? s->utc_ns : utc_ns);

	return r < 0 ? r : sink_sync0(s->sink, result, utc_ns, sequence);
}

int sample_feed_event(struct sample_feed *s, const struct event *ev, uint64_t sequence)
{
	int64_t utc_ns = timemap_tai_to_utc_ns(s->map, ev->tai_ns);
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
