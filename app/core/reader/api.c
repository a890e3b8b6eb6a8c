/* SPDX-License-Identifier: MIT */
#include "reader/api.h"

#include <assert.h>
#include <errno.h>
#include <math.h>
#include <poll.h>
#include <stdlib.h>
#include <time.h>

#include "base/clock.h"
#include "base/event.h"
#include "base/platform.h"
#include "base/run_path.h"
#include "base/sample.h"
#include "config/config.h"
#include "image/image.h"
#include "reader/feed.h"
#include "reader/reader.h"
#include "reader/table.h"
#include "reader/utc.h"

/* Installed programs compare with these numbers. */
static_assert((int)ECDAQ_SAMPLE_UNCHECKED == (int)SAMPLE_UNCHECKED,
	      "flags are handed on as they are");
static_assert((int)ECDAQ_FLOAT == (int)CHANNEL_FLOAT, "types are handed on as they are");

enum { STEP_MS = 2, TEXT_BYTES = 256 };

#define TAI_CHECK_NS NS_PER_S

struct ecdaq_reader {
	struct reader *reader;
	struct utc *utc; /* of the session */
	const struct channel_table *table;
	struct ecdaq_slave *slaves;
	struct ecdaq_channel *channels;
	struct ecdaq_sample sample;
	uint64_t lost;
	int64_t tai_noted_ns; /* CLOCK_MONOTONIC */
	int has_sample;
	int problem; /* negative errno; 0: none */
};

struct ecdaq_events {
	struct feed *feed;
	struct ecdaq_event event;
	uint64_t lost;
	char text[TEXT_BYTES];
};

int ecdaq_reader_open(const char *run_dir, enum ecdaq_start start, struct ecdaq_reader **ret_reader)
{
	struct ecdaq_reader *r = calloc(1, sizeof(*r));
	char path[CONFIG_PATH_BYTES];
	int result;

	if (r == NULL) {
		return -ENOMEM;
	}
	result = run_path(run_dir, CONFIG_RUN_SAMPLES, path, sizeof(path));
	if (result == 0) {
		result = reader_create(
			path, start == ECDAQ_FROM_OLDEST ? READER_AT_OLDEST : READER_AT_NEWEST,
			&r->reader);
	}
	if (result < 0) {
		free(r);
		return result;
	}
	*ret_reader = r;
	return 0;
}

static void forget_session(struct ecdaq_reader *r)
{
	utc_destroy(r->utc);
	free(r->slaves);
	free(r->channels);
	r->utc = NULL;
	r->slaves = NULL;
	r->channels = NULL;
	r->table = NULL;
	r->has_sample = 0;
	r->tai_noted_ns = 0;
}

void ecdaq_reader_close(struct ecdaq_reader *reader)
{
	if (reader == NULL) {
		return;
	}
	forget_session(reader);
	reader_destroy(reader->reader);
	free(reader);
}

static struct ecdaq_slave public_slave(const struct slave_info *s)
{
	return (struct ecdaq_slave){ .name = s->name,
				     .device = s->device,
				     .position = s->slave_pos,
				     .vendor = s->vendor,
				     .product = s->product,
				     .revision = s->revision,
				     .serial = s->serial };
}

static struct ecdaq_channel public_channel(const struct channel *c)
{
	return (struct ecdaq_channel){ .name = c->name,
				       .unit = c->unit,
				       .slave = c->slave_pos,
				       .type = c->type,
				       .is_output = c->direction == CHANNEL_OUTPUT,
				       .bit_offset = c->bit_offset,
				       .bit_len = c->bit_len,
				       .index = c->index,
				       .subindex = c->subindex,
				       .scale = c->scale,
				       .offset = c->offset };
}

static int begin_session(struct ecdaq_reader *r)
{
	const struct channel_table *table = reader_table(r->reader);

	forget_session(r);
	r->slaves = calloc(table->meta.slave_count + 1u, sizeof(r->slaves[0]));
	r->channels = calloc(table->meta.channel_count + 1u, sizeof(r->channels[0]));
	r->utc = utc_create(&table->meta);
	if (r->slaves == NULL || r->channels == NULL || r->utc == NULL) {
		forget_session(r);
		return -ENOMEM;
	}
	for (uint32_t i = 0; i < table->meta.slave_count; i++) {
		r->slaves[i] = public_slave(&table->slaves[i]);
	}
	for (uint32_t i = 0; i < table->meta.channel_count; i++) {
		r->channels[i] = public_channel(&table->channels[i]);
	}
	r->table = table;
	return ECDAQ_READ_SESSION;
}

static int64_t mono_ns(void)
{
	struct timespec ts;

	clock_gettime(CLOCK_MONOTONIC, &ts);
	return (int64_t)ts.tv_sec * NS_PER_S + ts.tv_nsec;
}

/* The TAI offset of the kernel changes when the host gets the time from the network. */
static void note_tai_offset(struct ecdaq_reader *r)
{
	int64_t now_ns = mono_ns();
	int32_t offset_s;

	if (now_ns - r->tai_noted_ns >= TAI_CHECK_NS && platform_tai_offset_s(&offset_s) == 0) {
		utc_note_tai_offset(r->utc, offset_s);
		r->tai_noted_ns = now_ns;
	}
}

static int take_sample(struct ecdaq_reader *r)
{
	const struct sample_header *h = reader_header(r->reader);
	int64_t utc_ns = 0;
	int result;

	if (r->table == NULL) {
		return -ENOMEM; /* the session could not be begun */
	}
	note_tai_offset(r);
	result = utc_feed(r->utc, h, &utc_ns);
	if (result < 0) {
		return result;
	}
	r->sample = (struct ecdaq_sample){ .session = r->table->meta.session,
					   .cycle = h->cycle,
					   .dc_time_ns = h->dc_time_ns,
					   .utc_ns = utc_ns,
					   .flags = h->flags,
					   .wake_latency_ns = h->wake_latency_ns,
					   .round_trip_ns = h->round_trip_ns,
					   .phase_error_ns = h->phase_error_ns,
					   .wkc = h->wkc,
					   .wkc_expected = h->wkc_expected,
					   .image_bytes = r->table->meta.image_bytes,
					   .image = reader_image(r->reader) };
	r->has_sample = 1;
	return ECDAQ_READ_SAMPLE;
}

static int step(struct ecdaq_reader *r)
{
	r->problem = 0;
	switch (reader_next(r->reader, &r->lost)) {
	case READER_SAMPLE:
		return take_sample(r);
	case READER_LOST:
		return ECDAQ_READ_LOST;
	case READER_BEGUN:
		return begin_session(r);
	case READER_ENDED:
		r->problem = reader_error(r->reader);
		return ECDAQ_READ_ENDED;
	case READER_WAITING:
		r->problem = reader_error(r->reader);
		return ECDAQ_READ_TIMEOUT;
	case READER_EMPTY:
		return ECDAQ_READ_TIMEOUT;
	}
	return ECDAQ_READ_TIMEOUT;
}

int ecdaq_reader_next(struct ecdaq_reader *reader, int timeout_ms)
{
	int64_t deadline_ns = mono_ns() + timeout_ms * NS_PER_MS;

	for (;;) {
		int result = step(reader);

		if (result != ECDAQ_READ_TIMEOUT || (timeout_ms >= 0 && mono_ns() >= deadline_ns)) {
			return result;
		}
		/* A reader maps no lock and no futex of the producer: it looks again. */
		poll(NULL, 0, STEP_MS);
	}
}

const char *ecdaq_reader_problem(const struct ecdaq_reader *reader)
{
	return reader->problem == 0 ? "" : reader_problem(reader->reader);
}

const struct ecdaq_sample *ecdaq_reader_sample(const struct ecdaq_reader *reader)
{
	return reader->has_sample ? &reader->sample : NULL;
}

uint64_t ecdaq_reader_lost(const struct ecdaq_reader *reader)
{
	return reader->lost;
}

int ecdaq_reader_is_good(const struct ecdaq_reader *reader, uint32_t slave)
{
	return reader->has_sample && slave < ecdaq_reader_slave_count(reader) &&
	       sample_is_good(reader_header(reader->reader), (uint16_t)slave);
}

uint64_t ecdaq_reader_period_ns(const struct ecdaq_reader *reader)
{
	return reader->table == NULL ? 0 : reader->table->meta.period_ns;
}

uint32_t ecdaq_reader_slave_count(const struct ecdaq_reader *reader)
{
	return reader->table == NULL ? 0 : reader->table->meta.slave_count;
}

uint32_t ecdaq_reader_channel_count(const struct ecdaq_reader *reader)
{
	return reader->table == NULL ? 0 : reader->table->meta.channel_count;
}

const struct ecdaq_slave *ecdaq_reader_slave(const struct ecdaq_reader *reader, uint32_t position)
{
	return position < ecdaq_reader_slave_count(reader) ? &reader->slaves[position] : NULL;
}

const struct ecdaq_channel *ecdaq_reader_channel(const struct ecdaq_reader *reader, uint32_t index)
{
	return index < ecdaq_reader_channel_count(reader) ? &reader->channels[index] : NULL;
}

int ecdaq_reader_find(const struct ecdaq_reader *reader, const char *name)
{
	return reader->table == NULL ? -ENOENT
				     : image_channel_find(reader->table->channels,
							  reader->table->meta.channel_count, name);
}

double ecdaq_reader_value(const struct ecdaq_reader *reader, uint32_t channel)
{
	if (!reader->has_sample || channel >= ecdaq_reader_channel_count(reader)) {
		return NAN;
	}
	return image_get_physical(reader->sample.image, &reader->table->channels[channel]);
}

uint64_t ecdaq_reader_raw(const struct ecdaq_reader *reader, uint32_t channel)
{
	if (!reader->has_sample || channel >= ecdaq_reader_channel_count(reader)) {
		return 0;
	}
	return image_get_raw(reader->sample.image, &reader->table->channels[channel]);
}

int ecdaq_events_open(const char *run_dir, enum ecdaq_start start, struct ecdaq_events **ret_events)
{
	struct ecdaq_events *e = calloc(1, sizeof(*e));
	char path[CONFIG_PATH_BYTES];
	int result;

	if (e == NULL) {
		return -ENOMEM;
	}
	result = run_path(run_dir, CONFIG_RUN_EVENTS, path, sizeof(path));
	if (result == 0) {
		e->feed = feed_create(FEED_EVENTS, path,
				      start == ECDAQ_FROM_OLDEST ? FEED_AT_OLDEST : FEED_AT_NEWEST);
		result = e->feed == NULL ? -ENOMEM : 0;
	}
	if (result < 0) {
		free(e);
		return result;
	}
	*ret_events = e;
	return 0;
}

void ecdaq_events_close(struct ecdaq_events *events)
{
	if (events == NULL) {
		return;
	}
	feed_destroy(events->feed);
	free(events);
}

const struct ecdaq_event *ecdaq_events_next(struct ecdaq_events *events)
{
	struct event ev;

	if (feed_open(events->feed, NULL) < 0 ||
	    feed_read(events->feed, &ev, sizeof(ev), NULL, &events->lost) == 0) {
		return NULL;
	}
	event_format(&ev, events->text, sizeof(events->text));
	events->event = (struct ecdaq_event){
		.mono_ns = ev.mono_ns,
		.tai_ns = ev.tai_ns,
		.cycle = ev.cycle,
		.slave = ev.slave_pos == EVENT_NO_SLAVE ? -1 : ev.slave_pos,
		.name = event_name(ev.id),
		.severity = event_severity_to_str(event_severity(ev.id)),
		.text = events->text,
	};
	return &events->event;
}

uint64_t ecdaq_events_lost(const struct ecdaq_events *events)
{
	return events->lost;
}

const char *ecdaq_version(void)
{
	return ECDAQ_VERSION;
}
