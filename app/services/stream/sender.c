/* SPDX-License-Identifier: MIT */
#include "stream/sender.h"

#include <errno.h>
#include <inttypes.h>
#include <libdeflate.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/host_clock.h"

static void add(_Atomic uint64_t *field, uint64_t value)
{
	atomic_fetch_add_explicit(field, value, memory_order_relaxed);
}

static void set(_Atomic uint64_t *field, uint64_t value)
{
	atomic_store_explicit(field, value, memory_order_relaxed);
}

/* The description of the session, before its first block, unless it is the newest one there. */
static int send_description(struct sender *s)
{
	struct broker_message m = { .subject = s->channels,
				    .after = BROKER_ANY,
				    .data = s->description,
				    .len = strlen(s->description) };
	int r = 0;

	mark_set(&m.mark, MARK_SESSION, s->session);
	snprintf(m.id, sizeof(m.id), "%" PRIu64 "-channels-%08lx", s->session,
		 (unsigned long)libdeflate_crc32(0, s->description, m.len));
	if (strcmp(m.id, s->channels_id) != 0) {
		r = broker_store(s->broker, &m, 1, s->problem);
	}
	if (r == 0) {
		snprintf(s->channels_id, sizeof(s->channels_id), "%s", m.id);
		free(s->description);
		s->description = NULL;
	}
	return r;
}

int sender_flush(struct sender *s)
{
	size_t count;
	int r = 0;

	if (s->lanes == NULL) {
		return 0;
	}
	count = lanes_messages(s->lanes, s->message);
	if (count > 0 && s->description != NULL) {
		r = send_description(s);
	}
	r = r < 0 || count == 0 ? r : broker_store(s->broker, s->message, count, s->problem);
	if (r < 0) {
		return r;
	}
	s->flushed_ns = host_clock_ns(CLOCK_MONOTONIC);
	if (count == 0) {
		return 0;
	}
	for (size_t i = 0; i < count; i++) {
		const uint64_t *value = s->message[i].mark.value;

		add(&s->now->cycles, value[MARK_NEXT_CYCLE] - value[MARK_FIRST_CYCLE]);
	}
	s->position = (struct position){ 1, s->session,
					 s->message[count - 1].mark.value[MARK_FIRST_CYCLE] };
	add(&s->now->blocks, count);
	add(&s->now->bytes_sent, lanes_stored(s->lanes, s->message, count));
	set(&s->now->next_cycle, lanes_next_cycle(s->lanes));
	s->stored++;
	return 0;
}

int sender_put_event(struct sender *s, struct broker_message *m)
{
	int r = broker_store(s->broker, m, 1, s->problem);

	if (r == 0) {
		event_lane_stored(&s->events, m);
		add(&s->now->events, 1);
		s->stored++;
	}
	return r;
}

/* Cycles that neither the ring nor a recording has. */
static int send_gap(struct sender *s, uint64_t first, uint64_t count, int64_t utc_ns)
{
	char text[256];
	int64_t tai_ns = host_clock_ns(CLOCK_TAI);
	struct messages_event ev = {
		.event = { .id = EVENT_STREAM_GAP,
			   .mono_ns = host_clock_ns(CLOCK_MONOTONIC),
			   .tai_ns = tai_ns,
			   .cycle = first,
			   .value = (int64_t)first,
			   .arg = { count > INT32_MAX ? INT32_MAX : (int32_t)count },
			   .slave_pos = EVENT_NO_SLAVE },
		.sequence = UINT64_MAX,
		.utc_ns = utc_ns,
		.text = text,
	};
	struct broker_message m;
	int r = sender_flush(s);

	if (r < 0) {
		return r;
	}
	event_format(&ev.event, text, sizeof(text));
	event_lane_message(&s->events, &ev, s->session, &m);
	r = sender_put_event(s, &m);
	if (r == 0) {
		add(&s->now->gaps, 1);
		add(&s->now->cycles_missing, count);
		s->next_cycle = first + count;
	}
	return r;
}

int sender_mind_gap(struct sender *s, uint64_t cycle, int64_t utc_ns)
{
	if (!s->has_next || cycle <= s->next_cycle) {
		return 0;
	}
	return send_gap(s, s->next_cycle, cycle - s->next_cycle, utc_ns);
}

int sender_take(struct sender *s, size_t lane, uint64_t cycle, const void *data, size_t len)
{
	int r = lanes_add(s->lanes, lane, cycle, data, len);

	if (r == -EAGAIN) {
		r = sender_flush(s);
		r = r < 0 ? r : lanes_add(s->lanes, lane, cycle, data, len);
	}
	if (r < 0 && s->problem[0] == '\0') {
		snprintf(s->problem, sizeof(s->problem), "%s: %s: %s",
			 lanes_subject(s->lanes, lane), strerror(-r),
			 r == -EMSGSIZE ? "raise max_payload of the server" : "no memory");
	}
	return r;
}

/* Where each lane continues. What an expired stream no longer has was sent, as far as known. */
static int start_lanes(struct sender *s, uint64_t session)
{
	for (size_t i = 0; i < lanes_count(s->lanes); i++) {
		struct broker_newest newest;
		struct lane_start start = { .sequence = 0 };
		int r = broker_newest(s->broker, lanes_subject(s->lanes, i), &newest, s->problem);

		if (r < 0) {
			return r;
		}
		if (r > 0) {
			start.sequence = newest.sequence;
			if (mark_is_block(&newest.mark) &&
			    newest.mark.value[MARK_SESSION] == session) {
				start.next_cycle = newest.mark.value[MARK_NEXT_CYCLE];
			}
		}
		lanes_start(s->lanes, i, start);
	}
	return 0;
}

static int make_lanes(struct sender *s, const struct topics *topics)
{
	size_t count = topics->count > 0 ? topics->count : 1;
	int r;

	lanes_destroy(s->lanes);
	s->lanes = NULL;
	if (count > s->capacity) {
		free(s->message);
		s->message = calloc(count, sizeof(s->message[0]));
		s->capacity = s->message == NULL ? 0 : count;
	}
	r = s->message == NULL ? -ENOMEM : lanes_create(topics, s->appliance, &s->lanes);
	if (r < 0) {
		snprintf(s->problem, sizeof(s->problem), "%s", strerror(-r));
		return r;
	}
	lanes_set_bounds(s->lanes,
			 &(struct lanes_bounds){ .block_cycles = s->cfg->stream_block_cycles,
						 .payload_bytes = broker_payload_limit(s->broker),
						 .memory_bytes = s->cfg->stream_memory_bytes });
	return 0;
}

int sender_begin_session(struct sender *s, const struct topics *topics)
{
	uint64_t next;
	int r = sender_flush(s);

	r = r < 0 ? r : make_lanes(s, topics);
	r = r < 0 ? r : start_lanes(s, topics->session);
	if (r < 0) {
		return r;
	}
	free(s->description);
	s->description = topics_document(topics, s->appliance);
	if (s->description == NULL) {
		snprintf(s->problem, sizeof(s->problem), "%s", strerror(ENOMEM));
		return -ENOMEM;
	}
	next = lanes_next_cycle(s->lanes);
	s->session = topics->session;
	s->has_next = next > 0 && next < UINT64_MAX;
	s->next_cycle = next;
	set(&s->now->session, s->session);
	return 0;
}

void sender_done(struct sender *s)
{
	lanes_destroy(s->lanes);
	free(s->message);
	free(s->description);
	s->description = NULL;
	s->lanes = NULL;
	s->message = NULL;
	s->capacity = 0;
}
