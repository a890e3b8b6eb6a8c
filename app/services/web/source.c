/* SPDX-License-Identifier: MIT */
#include "web/source.h"

#include <assert.h>
#include <errno.h>
#include <stdlib.h>

#include "base/clock.h"
#include "base/event.h"
#include "base/platform.h"
#include "base/sync0.h"
#include "reader/feed.h"
#include "reader/reader.h"
#include "reader/utc.h"

/* One step never takes long: other clients wait for it. */
enum { SAMPLES_PER_STEP = 2000, RECORDS_PER_STEP = 100, TEXT_BYTES = 256 };
#define FOLLOW_NS (100 * NS_PER_MS)

struct source {
	enum config_record_values values;
	struct outbox *box;
	struct reader *reader;
	struct feed *events;
	struct feed *sync0;
	struct layout *layout;
	struct utc *utc;
	uint32_t slave_count;      /* of the session, for slaves_bad */
	uint32_t session;          /* number of sessions begun here */
	uint64_t session_position; /* in the outbox */
	int is_reading;            /* the reader is inside of it */
	int64_t followed_ns;
	uint32_t wanted[SOURCE_SLOTS]; /* subscribers */
	uint64_t next[SOURCE_SLOTS];   /* number of the next message */
};

static uint32_t kind_channel(enum messages_kind kind)
{
	return (uint32_t)kind + 1;
}

static int open_feeds(struct source *s, const struct config *cfg)
{
	char path[CONFIG_PATH_BYTES];
	int r = config_run_path(cfg, CONFIG_RUN_EVENTS, path, sizeof(path));

	if (r < 0) {
		return r;
	}
	s->events = feed_create(FEED_EVENTS, path, FEED_AT_NEWEST);
	r = config_run_path(cfg, CONFIG_RUN_SYNC0, path, sizeof(path));
	if (r < 0) {
		return r;
	}
	s->sync0 = feed_create(FEED_SYNC0, path, FEED_AT_NEWEST);
	return s->events == NULL || s->sync0 == NULL ? -ENOMEM : 0;
}

int source_create(const struct config *cfg, struct outbox *box, struct source **ret_source)
{
	struct source *s = calloc(1, sizeof(*s));
	char path[CONFIG_PATH_BYTES];
	int r = s == NULL ? -ENOMEM : config_run_path(cfg, CONFIG_RUN_SAMPLES, path, sizeof(path));

	if (r >= 0) {
		s->box = box;
		s->values = cfg->record_values;
		r = reader_create(path, READER_AT_NEWEST, &s->reader);
	}
	r = r < 0 ? r : open_feeds(s, cfg);
	if (r < 0) {
		source_destroy(s);
		return r;
	}
	*ret_source = s;
	return 0;
}

static void end_session(struct source *s)
{
	utc_destroy(s->utc);
	layout_destroy(s->layout);
	s->utc = NULL;
	s->layout = NULL;
	s->is_reading = 0;
}

void source_destroy(struct source *s)
{
	if (s != NULL) {
		end_session(s);
		feed_destroy(s->events);
		feed_destroy(s->sync0);
		reader_destroy(s->reader);
		free(s);
	}
}

void source_want(struct source *s, uint32_t channel, int change)
{
	s->wanted[source_slot(channel)] += (uint32_t)change;
}

/* The message that was encoded to outbox_reserve(). */
static void put(struct source *s, uint32_t channel, int64_t utc_ns, size_t len)
{
	outbox_put(s->box, &(struct outbox_message){ .channel = channel,
						     .number = s->next[source_slot(channel)]++,
						     .time_ns = utc_ns,
						     .len = len });
}

static void begin_session(struct source *s)
{
	const struct channel_table *table = reader_table(s->reader);

	end_session(s);
	s->session = s->session % (UINT32_MAX / SOURCE_IDS - 1) + 1;
	s->session_position = outbox_head(s->box);
	s->slave_count = table->meta.slave_count;
	s->utc = utc_create(&table->meta);
	/* Subscriptions of slaves end with the session: nobody has one of this yet. */
	for (uint32_t slot = SOURCE_FIRST_SLAVE; slot < SOURCE_SLOTS; slot++) {
		s->wanted[slot] = 0;
		s->next[slot] = 0;
	}
	if (s->utc == NULL || layout_create(table, s->values, &s->layout) < 0 ||
	    layout_largest_bytes(s->layout) > SOURCE_LARGEST_BYTES) {
		end_session(s);
		reader_skip_session(s->reader);
		return;
	}
	s->is_reading = 1;
}

static void put_timemap(struct source *s)
{
	uint32_t channel = kind_channel(MESSAGE_TIMEMAP);
	struct timemap_state state;

	if (utc_changed(s->utc, &state) != UTC_UNCHANGED && s->wanted[channel] > 0) {
		put(s, channel, state.utc_ns,
		    messages_encode_timemap(&state, outbox_reserve(s->box)));
	}
}

static void put_sample(struct source *s)
{
	const struct sample_header *header = reader_header(s->reader);
	uint32_t channel = kind_channel(MESSAGE_CYCLE);
	const struct layout_topic *topic;
	size_t count;
	int64_t utc_ns;

	if (utc_feed(s->utc, header, &utc_ns) < 0) {
		return;
	}
	put_timemap(s);
	if (s->wanted[channel] > 0) {
		put(s, channel, utc_ns,
		    messages_encode_cycle(header, s->slave_count, outbox_reserve(s->box)));
	}
	topic = layout_topics(s->layout, &count);
	for (size_t i = 0; i < count; i++) {
		channel = source_slave_channel(s->session, i);
		if (s->wanted[source_slot(channel)] > 0) {
			put(s, channel, utc_ns,
			    layout_encode(&topic[i], header, reader_image(s->reader),
					  (uint64_t)utc_ns, outbox_reserve(s->box),
					  SOURCE_LARGEST_BYTES));
		}
	}
}

/* Samples that left the ring unread: subscribers count them as dropped. */
static void count_lost(struct source *s, uint64_t lost)
{
	s->next[kind_channel(MESSAGE_CYCLE)] += lost;
	for (uint32_t slot = SOURCE_FIRST_SLAVE; slot < SOURCE_SLOTS; slot++) {
		s->next[slot] += lost;
	}
}

/* 0: nothing more for now. */
static int read_sample(struct source *s)
{
	uint64_t lost;

	switch (reader_next(s->reader, &lost)) {
	case READER_SAMPLE:
		put_sample(s);
		return 1;
	case READER_LOST:
		count_lost(s, lost);
		return 1;
	case READER_BEGUN:
		begin_session(s);
		return 1;
	case READER_ENDED:
		s->is_reading = 0;
		return 1;
	case READER_EMPTY:
	case READER_WAITING:
		return 0;
	}
	return 0;
}

/* Before the first session, the kernel's TAI offset is unknown: CLOCK_TAI is taken for UTC. */
static int64_t utc_of(const struct source *s, int64_t tai_ns)
{
	return s->utc == NULL ? tai_ns : utc_of_tai(s->utc, tai_ns);
}

static void read_events(struct source *s)
{
	uint32_t channel = kind_channel(MESSAGE_EVENT);
	char text[TEXT_BYTES];
	struct messages_event message = { .text = text };
	uint64_t lost;

	for (int n = 0; n < RECORDS_PER_STEP; n++) {
		lost = 0;
		if (!feed_read(s->events, &message.event, sizeof(message.event), &message.sequence,
			       &lost)) {
			return;
		}
		s->next[channel] += lost;
		if (s->wanted[channel] > 0) {
			event_format(&message.event, text, sizeof(text));
			message.utc_ns = utc_of(s, message.event.tai_ns);
			put(s, channel, message.utc_ns,
			    messages_encode_event(&message, outbox_reserve(s->box)));
		}
	}
}

static void read_sync0(struct source *s)
{
	uint32_t channel = kind_channel(MESSAGE_SYNC0);
	struct sync0_result result;
	uint64_t lost;

	for (int n = 0; n < RECORDS_PER_STEP; n++) {
		lost = 0;
		if (!feed_read(s->sync0, &result, sizeof(result), NULL, &lost)) {
			return;
		}
		s->next[channel] += lost;
		if (s->wanted[channel] > 0) {
			int64_t utc_ns = utc_of(s, result.tai_ns);

			put(s, channel, utc_ns,
			    messages_encode_sync0(&result, utc_ns, outbox_reserve(s->box)));
		}
	}
}

/* What need not be done at every step. */
static void follow(struct source *s, int64_t now_ns)
{
	const struct platform platform = platform_posix();
	struct clock_quality quality;

	if (now_ns - s->followed_ns < FOLLOW_NS) {
		return;
	}
	s->followed_ns = now_ns;
	(void)feed_open(s->events, NULL);
	(void)feed_open(s->sync0, NULL);
	if (s->utc != NULL && platform.clock_quality(platform.ctx, &quality) == 0) {
		utc_note_clock(s->utc, &quality);
	}
}

void source_poll(struct source *s, int64_t now_ns)
{
	follow(s, now_ns);
	for (int n = 0; n < SAMPLES_PER_STEP && read_sample(s); n++) {
	}
	read_events(s);
	read_sync0(s);
}

uint32_t source_session(const struct source *s)
{
	return s->layout == NULL ? 0 : s->session;
}

uint64_t source_session_position(const struct source *s)
{
	return s->session_position;
}

const struct layout_topic *source_slaves(const struct source *s, size_t *ret_count)
{
	*ret_count = 0;
	return s->layout == NULL ? NULL : layout_topics(s->layout, ret_count);
}

const struct sample_meta *source_meta(const struct source *s)
{
	return s->layout == NULL ? NULL : layout_meta(s->layout);
}

const char *source_topic(const struct source *s, uint32_t channel)
{
	const struct layout_topic *topic;
	size_t count;
	uint32_t slot = source_slot(channel);

	if (channel >= kind_channel(0) && channel < SOURCE_FIRST_SLAVE) {
		return messages_topic((enum messages_kind)(channel - 1));
	}
	topic = source_slaves(s, &count);
	if (channel / SOURCE_IDS == source_session(s) && slot >= SOURCE_FIRST_SLAVE &&
	    slot - SOURCE_FIRST_SLAVE < count) {
		return topic[slot - SOURCE_FIRST_SLAVE].topic;
	}
	return "";
}

int source_has_channel(const struct source *s, uint32_t channel)
{
	return source_topic(s, channel)[0] != '\0';
}

uint64_t source_next(const struct source *s, uint32_t channel)
{
	return s->next[source_slot(channel)];
}

const char *source_problem(const struct source *s)
{
	return s->is_reading ? "" : reader_problem(s->reader);
}

int64_t source_utc_minus_tai(const struct source *s)
{
	return utc_of(s, 0);
}
