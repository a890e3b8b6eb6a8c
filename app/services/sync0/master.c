/* SPDX-License-Identifier: MIT */
#include "sync0/master.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "image/image.h"
#include "reader/reader.h"

/* Samples of the past, from which the map learns at the start. */
#define LEARN_NS (5 * NS_PER_S)

/* FB1111-Piccolo: DC time at which SYNC0 shall fire once. */
enum { SHOT_INDEX = 0x7000, SHOT_SUBINDEX = 2, SHOT_BITS = 64 };

struct master {
	struct reader *reader;
	int has_session;
	struct slave_set slaves;
	const struct channel *shot_channel[LIMIT_SLAVES];
	uint64_t shot_ns[LIMIT_SLAVES];
};

struct master *master_create(const char *path)
{
	struct master *m = calloc(1, sizeof(*m));

	if (m != NULL && reader_create(path, READER_AT_NEWEST, &m->reader) < 0) {
		free(m);
		return NULL;
	}
	return m;
}

void master_destroy(struct master *m)
{
	if (m != NULL) {
		reader_destroy(m->reader);
		free(m);
	}
}

static void seek_back(struct master *m)
{
	uint64_t back = (uint64_t)LEARN_NS / reader_table(m->reader)->meta.period_ns;
	uint64_t newest = reader_newest(m->reader);
	uint64_t oldest = reader_oldest(m->reader);

	reader_seek(m->reader, newest - oldest > back ? newest - back : oldest);
}

int master_open(struct master *m)
{
	uint64_t lost;

	if (m->has_session) {
		return 1;
	}
	if (reader_next(m->reader, &lost) != READER_BEGUN) {
		int error = reader_error(m->reader);

		return error == -EPROTO || error == -EPROTONOSUPPORT || error == -E2BIG ? -EPROTO
											: 0;
	}
	/* The ring of a master that has gone says nothing of now. */
	if (reader_is_orphaned(m->reader)) {
		reader_skip_session(m->reader);
		return 0;
	}
	m->has_session = 1;
	seek_back(m);
	master_watch_shots(m, &(struct slave_set){ .word = { 0 } });
	return 1;
}

const struct channel_table *master_table(const struct master *m)
{
	return reader_table(m->reader);
}

void master_watch_shots(struct master *m, const struct slave_set *slaves)
{
	const struct channel_table *t = reader_table(m->reader);
	const struct channel *ch = t->channels;

	m->slaves = *slaves;
	memset(m->shot_channel, 0, sizeof(m->shot_channel));
	memset(m->shot_ns, 0, sizeof(m->shot_ns));
	for (uint32_t i = 0; i < t->meta.channel_count; i++) {
		if (ch[i].index == SHOT_INDEX && ch[i].subindex == SHOT_SUBINDEX &&
		    ch[i].bit_len == SHOT_BITS && ch[i].direction == CHANNEL_OUTPUT &&
		    slave_set_has(slaves, ch[i].slave_pos)) {
			m->shot_channel[ch[i].slave_pos] = &ch[i];
		}
	}
}

/* A changed time arms the slave; one that stands there at the first look has armed it before. */
static void find_shots(struct master *m, const uint8_t *image, struct master_item *ret)
{
	for (uint16_t pos = 0; pos < LIMIT_SLAVES; pos++) {
		uint64_t value;

		if (m->shot_channel[pos] == NULL) {
			continue;
		}
		value = image_get_raw(image, m->shot_channel[pos]);
		if (value != m->shot_ns[pos]) {
			ret->shot[ret->shots++] = (struct master_shot){
				.slave_pos = pos,
				.dc_ns = value <= INT64_MAX / 4 ? (int64_t)value : 0,
			};
		}
		m->shot_ns[pos] = value;
	}
}

static void make_item(struct master *m, struct master_item *ret)
{
	struct sample_header h = *reader_header(m->reader);

	*ret = (struct master_item){
		.has_dc = h.dc_time_ns != 0,
		.cycle = { .cycle = (int64_t)h.cycle,
			   .due_dc_ns = h.dc_time_ns,
			   .dc_diff_ns = h.dc_diff_ns,
			   .is_judged = !(h.flags & SAMPLE_NOT_OP) },
	};
	/* The frame left right after the wake, and passed the reference half a round trip later. */
	if (h.frame_dc_ns != 0 && h.round_trip_ns >= 0 &&
	    !(h.flags & (SAMPLE_LOST | SAMPLE_SKIPPED))) {
		ret->cycle.frame_dc_ns = h.frame_dc_ns;
		ret->cycle.frame_mono_ns = h.wake_mono_ns + h.round_trip_ns / 2;
		ret->cycle.frame_latency_ns = h.round_trip_ns / 2;
	}
	find_shots(m, reader_image(m->reader), ret);
}

int master_next(struct master *m, struct master_item *ret)
{
	uint64_t lost;

	for (;;) {
		switch (reader_next(m->reader, &lost)) {
		case READER_SAMPLE:
			make_item(m, ret);
			return 1;
		case READER_LOST:
			break;
		case READER_EMPTY:
			return 0;
		case READER_BEGUN:
		case READER_WAITING:
		case READER_ENDED:
			m->has_session = 0;
			return -EPIPE;
		}
	}
}
