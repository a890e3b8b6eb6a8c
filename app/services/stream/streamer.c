/* SPDX-License-Identifier: MIT */
#include "stream/streamer.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "base/host_clock.h"
#include "program/appliance.h"
#include "program/trouble.h"
#include "reader/feed.h"
#include "stream/history.h"
#include "stream/live.h"
#include "stream/own_status.h"
#include "stream/sender.h"

enum {
	ITEMS_PER_STEP = 5000, /* messages read in one step */
	EVENTS_PER_STEP = 64,
	LINE_BYTES = 512,
};

#define IDLE_NS (5 * NS_PER_MS)
#define FOLLOW_NS (100 * NS_PER_MS)
#define BLOCK_NS NS_PER_S /* no sample waits longer for its block to be full */
#define STATUS_NS (500 * NS_PER_MS)
#define RETRY_FIRST_NS NS_PER_S
#define RETRY_LAST_NS (30 * NS_PER_S)

struct streamer {
	struct sender sender;
	const struct config *cfg;
	void (*report)(const char *line);
	struct own_status own;
	int64_t status_ns;
	struct trouble trouble;

	struct live *live;
	struct history *history; /* NULL: not reading recordings */
	struct feed *feed;
	uint64_t session;
	int is_checked;      /* the ring was found to continue what the stream has */
	int is_tried;        /* recordings were read for this session of the ring */
	uint64_t progressed; /* cycles that they had for it */
	int has_ended;       /* the session before was read to its end */
};

static int64_t now_ns(void)
{
	return host_clock_ns(CLOCK_MONOTONIC);
}

static void add(_Atomic uint64_t *field, uint64_t value)
{
	atomic_fetch_add_explicit(field, value, memory_order_relaxed);
}

static void set(_Atomic uint64_t *field, uint64_t value)
{
	atomic_store_explicit(field, value, memory_order_relaxed);
}

static void set_state(struct streamer *s, enum stream_state state)
{
	atomic_store_explicit(&s->own.now.state, state, memory_order_relaxed);
}

static int prepare(struct streamer *s, char *error, size_t error_bytes)
{
	int r = appliance_name(s->cfg->stream_appliance, s->sender.appliance);

	if (r < 0) {
		snprintf(error, error_bytes,
			 "stream.appliance: the host's name cannot be used: set it");
		return r;
	}
	snprintf(s->sender.blocks, sizeof(s->sender.blocks), "ecdaq.%s.*.block",
		 s->sender.appliance);
	snprintf(s->sender.channels, sizeof(s->sender.channels), "ecdaq.%s.channels",
		 s->sender.appliance);
	event_lane_init(&s->sender.events, s->sender.appliance);
	r = own_status_init(&s->own, s->cfg, s->sender.appliance);
	if (r < 0) {
		snprintf(error, error_bytes, "run directory: %s", strerror(-r));
		return r;
	}
	r = broker_create(s->cfg, s->sender.appliance, &s->sender.broker, s->sender.problem);
	if (r < 0) {
		snprintf(error, error_bytes, "%s", s->sender.problem);
	}
	return r;
}

int streamer_create(const struct config *cfg, void (*report)(const char *line),
		    struct streamer **ret_streamer, char *error, size_t error_bytes)
{
	struct streamer *s = calloc(1, sizeof(*s));
	int r;

	if (s == NULL) {
		snprintf(error, error_bytes, "%s", strerror(ENOMEM));
		return -ENOMEM;
	}
	s->cfg = cfg;
	s->sender.cfg = cfg;
	s->sender.now = &s->own.now;
	s->report = report;
	trouble_init(&s->trouble, report, RETRY_FIRST_NS, RETRY_LAST_NS);
	r = prepare(s, error, error_bytes);
	if (r < 0) {
		streamer_destroy(s);
		return r;
	}
	*ret_streamer = s;
	return 0;
}

static void close_sources(struct streamer *s)
{
	live_destroy(s->live);
	history_destroy(s->history);
	feed_destroy(s->feed);
	s->live = NULL;
	s->history = NULL;
	s->feed = NULL;
	sender_done(&s->sender);
}

static void tell_recovery(struct streamer *s)
{
	char line[LINE_BYTES];

	if (trouble_is_over(&s->trouble)) {
		snprintf(line, sizeof(line), "%s: stream %s: sending",
			 broker_server(s->sender.broker), s->cfg->stream_name);
		s->report(line);
	}
	s->own.now.message[0] = '\0';
}

/* Something failed: begin again. */
static void back_off(struct streamer *s)
{
	broker_disconnect(s->sender.broker);
	close_sources(s);
	snprintf(s->own.now.message, sizeof(s->own.now.message), "%s", s->sender.problem);
	trouble_found(&s->trouble, s->sender.problem);
	set_state(s, STREAM_CONNECTING);
}

/* What the stream has of this appliance, and the sources from their beginnings. */
static int begin(struct streamer *s)
{
	char path[CONFIG_PATH_BYTES];
	struct broker_newest newest;
	int r = broker_newest(s->sender.broker, s->sender.blocks, &newest, s->sender.problem);

	close_sources(s);
	if (r > 0 && mark_is_block(&newest.mark)) {
		s->sender.position = (struct position){ 1, newest.mark.value[MARK_SESSION],
							newest.mark.value[MARK_FIRST_CYCLE] };
	}
	r = r < 0 ? r
		  : broker_newest(s->sender.broker, s->sender.events.subject, &newest,
				  s->sender.problem);
	if (r >= 0) {
		event_lane_start(&s->sender.events, r > 0 ? &newest : NULL);
		r = broker_newest(s->sender.broker, s->sender.channels, &newest, s->sender.problem);
	}
	if (r < 0) {
		return r;
	}
	snprintf(s->sender.channels_id, sizeof(s->sender.channels_id), "%s",
		 r > 0 ? newest.id : "");
	r = live_create(s->cfg, &s->live);
	r = r < 0 ? r : config_run_path(s->cfg, CONFIG_RUN_EVENTS, path, sizeof(path));
	s->feed = r < 0 ? NULL : feed_create(FEED_EVENTS, path, FEED_AT_OLDEST);
	s->is_checked = 0;
	if (s->feed == NULL) {
		snprintf(s->sender.problem, sizeof(s->sender.problem), "%s", strerror(ENOMEM));
		return -ENOMEM;
	}
	return 0;
}

static int begin_history(struct streamer *s, uint64_t cycle)
{
	int r;

	history_destroy(s->history);
	s->history = NULL;
	s->is_tried = 1;
	s->progressed = 0;
	r = history_create(s->cfg->record_dir, s->sender.position.session, cycle, &s->history);
	/* No recordings: what the ring has not is a gap. */
	return r == -ENOMEM ? r : 0;
}

/* 1 if recordings may have what comes before the ring's @cycle. */
static int needs_history(const struct streamer *s, uint64_t cycle)
{
	if (!s->sender.position.is_known || (s->is_tried && s->progressed == 0)) {
		return 0;
	}
	if (s->sender.position.session == s->sender.session) {
		return lanes_next_cycle(s->sender.lanes) < cycle;
	}
	return !(s->has_ended && live_is_whole(s->live));
}

/* Returns 1 if the session of the recording lacks cycles before those that were asked for. */
static int history_is_late(struct streamer *s, uint64_t *cycle)
{
	if (s->sender.session != s->sender.position.session) {
		return 0;
	}
	*cycle = lanes_next_cycle(s->sender.lanes);
	return *cycle < s->sender.position.first_cycle;
}

static int begin_recording(struct streamer *s)
{
	const struct topics *topics = history_topics(s->history);
	uint64_t cycle;
	int r = sender_begin_session(&s->sender, topics);

	if (r == 0 && s->progressed == 0 && history_is_late(s, &cycle)) {
		s->sender.position.first_cycle = cycle;
		r = begin_history(s, cycle);
	}
	return r;
}

static int take_recorded(struct streamer *s)
{
	const struct history_item *item = history_item(s->history);
	int r = sender_mind_gap(&s->sender, item->cycle, (int64_t)item->time_ns);

	r = r < 0 ? r : sender_take(&s->sender, item->lane, item->cycle, item->data, item->len);
	if (r < 0) {
		return r;
	}
	s->progressed += item->cycle >= lanes_next_cycle(s->sender.lanes);
	s->sender.next_cycle =
		item->cycle >= s->sender.next_cycle ? item->cycle + 1 : s->sender.next_cycle;
	s->sender.has_next = 1;
	return lanes_are_full(s->sender.lanes) ? sender_flush(&s->sender) : 0;
}

static int take_recorded_event(struct streamer *s)
{
	const struct history_item *item = history_item(s->history);
	struct broker_message m;

	return event_lane_recorded(&s->sender.events, item->data, item->len, s->sender.session, &m)
		       ? sender_put_event(&s->sender, &m)
		       : 0;
}

/* Behind the recordings comes the ring, from where the stream is then. */
static int end_history(struct streamer *s)
{
	int r = sender_flush(&s->sender);

	history_destroy(s->history);
	s->history = NULL;
	return r < 0 ? r : begin(s);
}

static int step_history(struct streamer *s)
{
	int r = 0;

	set_state(s, STREAM_RECORDINGS);
	for (int n = 0; n < ITEMS_PER_STEP && r == 0 && s->history != NULL; n++) {
		switch (history_next(s->history)) {
		case HISTORY_BEGUN:
			r = begin_recording(s);
			break;
		case HISTORY_MESSAGE:
			r = take_recorded(s);
			break;
		case HISTORY_EVENT:
			r = take_recorded_event(s);
			break;
		case HISTORY_END:
			r = end_history(s);
			break;
		}
	}
	return r;
}

static int take_sample(struct streamer *s)
{
	uint64_t cycle = live_cycle(s->live);
	int r;

	if (!s->is_checked) {
		if (needs_history(s, cycle)) {
			return begin_history(s, s->sender.position.session == s->sender.session
							? lanes_next_cycle(s->sender.lanes)
							: s->sender.position.first_cycle);
		}
		s->is_checked = 1;
		s->is_tried = 0;
		s->has_ended = 0;
	}
	if (s->sender.has_next && cycle < s->sender.next_cycle &&
	    cycle < lanes_next_cycle(s->sender.lanes)) {
		return 0;
	}
	r = sender_mind_gap(&s->sender, cycle, live_utc_ns(s->live));
	for (size_t i = 0; i < lanes_count(s->sender.lanes) && r == 0; i++) {
		size_t len;
		const uint8_t *data = live_message(s->live, i, &len);

		r = sender_take(&s->sender, i, cycle, data, len);
	}
	if (r == 0) {
		s->sender.next_cycle = cycle + 1;
		s->sender.has_next = 1;
		r = lanes_are_full(s->sender.lanes) ? sender_flush(&s->sender) : 0;
	}
	return r;
}

/* Events of the ring, each in an exchange of its own: none is sent before one that was lost. */
static int step_events(struct streamer *s)
{
	char text[256];
	struct messages_event ev = { .text = text };
	struct feed_mark mark;
	uint64_t lost = 0;
	int r = 0;

	(void)feed_open(s->feed, event_lane_feed_mark(&s->sender.events, &mark) ? &mark : NULL);
	for (int n = 0; n < EVENTS_PER_STEP && r == 0; n++) {
		struct broker_message m;

		if (!feed_read(s->feed, &ev.event, sizeof(ev.event), &ev.sequence, &lost)) {
			break;
		}
		ev.utc_ns = live_utc_of_tai(s->live, ev.event.tai_ns);
		event_format(&ev.event, text, sizeof(text));
		event_lane_message(&s->sender.events, &ev, s->sender.session, &m);
		r = sender_put_event(&s->sender, &m);
	}
	add(&s->own.now.events_lost, lost);
	return r;
}

/* The ring has nothing more for now. */
static int step_idle(struct streamer *s)
{
	int is_due = s->sender.lanes != NULL && (lanes_are_due(s->sender.lanes) ||
						 now_ns() - s->sender.flushed_ns >= BLOCK_NS);
	int r = is_due ? sender_flush(&s->sender) : 0;

	return r < 0 ? r : step_events(s);
}

/* No master: what it left in recordings is sent, once. */
static int step_waiting(struct streamer *s)
{
	set_state(s, STREAM_WAITING);
	if (s->sender.position.is_known && !s->has_ended && !s->is_tried) {
		return begin_history(s, s->sender.position.first_cycle);
	}
	return step_events(s);
}

/* *@ret_wait_ns is set where there is nothing more to do. */
static int step_live(struct streamer *s, int64_t *ret_wait_ns)
{
	int r = 0;

	for (int n = 0; n < ITEMS_PER_STEP && r == 0 && s->history == NULL; n++) {
		switch (live_next(s->live)) {
		case LIVE_BEGUN:
			s->is_checked = 0;
			r = sender_begin_session(&s->sender, live_topics(s->live));
			break;
		case LIVE_SAMPLE:
			set_state(s, STREAM_LIVE);
			r = take_sample(s);
			break;
		case LIVE_EMPTY:
			*ret_wait_ns = IDLE_NS;
			return step_idle(s);
		case LIVE_ENDED:
			s->has_ended = s->is_checked;
			s->is_tried = 0;
			r = sender_flush(&s->sender);
			break;
		case LIVE_WAITING:
			*ret_wait_ns = FOLLOW_NS;
			return step_waiting(s);
		case LIVE_LOST:
			s->has_ended = 0;
			r = sender_flush(&s->sender);
			return r < 0 ? r : begin(s);
		case LIVE_FAILED:
			snprintf(s->sender.problem, sizeof(s->sender.problem), "%s",
				 strerror(ENOMEM));
			return -ENOMEM;
		}
	}
	return r;
}

static int connect_and_begin(struct streamer *s)
{
	int r = broker_connect(s->sender.broker, s->sender.problem);

	r = r < 0 ? r : begin(s);
	if (r == 0) {
		add(&s->own.now.connects, 1);
		s->has_ended = 0;
		s->is_tried = 0;
	}
	return r;
}

static void put_status(struct streamer *s)
{
	if (now_ns() - s->status_ns < STATUS_NS) {
		return;
	}
	s->status_ns = now_ns();
	if (s->live != NULL) {
		live_follow_clock(s->live);
	}
	snprintf(s->own.now.server, sizeof(s->own.now.server), "%s",
		 broker_server(s->sender.broker));
	set(&s->own.now.lag_cycles, s->live == NULL ? 0 : live_lag(s->live));
	own_status_put(&s->own);
}

int64_t streamer_step(struct streamer *s)
{
	uint64_t stored = s->sender.stored;
	int64_t wait_ns = 0;
	int r = 0;

	s->sender.problem[0] = '\0';
	if (!broker_is_connected(s->sender.broker) && !trouble_is_due(&s->trouble)) {
		wait_ns = FOLLOW_NS;
	} else if (!broker_is_connected(s->sender.broker)) {
		r = connect_and_begin(s);
	} else {
		r = s->history != NULL ? step_history(s) : step_live(s, &wait_ns);
	}
	if (r < 0) {
		back_off(s);
	} else if (s->sender.stored != stored) {
		tell_recovery(s);
	}
	put_status(s);
	return wait_ns;
}

void streamer_destroy(struct streamer *s)
{
	if (s == NULL) {
		return;
	}
	if (s->sender.broker != NULL && broker_is_connected(s->sender.broker)) {
		(void)sender_flush(&s->sender);
	}
	close_sources(s);
	broker_destroy(s->sender.broker);
	own_status_close(&s->own);
	free(s);
}
