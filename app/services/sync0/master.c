/* SPDX-License-Identifier: MIT */
#include "sync0/master.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "base/ring.h"
#include "image/image.h"

/* Samples of the past, from which the map learns at the start. */
#define LEARN_NS (5 * NS_PER_S)

/* FB1111-Piccolo: DC time at which SYNC0 shall fire once. */
enum { SHOT_INDEX = 0x7000, SHOT_SUBINDEX = 2, SHOT_BITS = 64 };

struct master {
	const char *path;
	struct ring_reader *ring; /* NULL: none open */
	int is_done;              /* it has ended: kept open until another takes its place */
	const struct sample_meta *meta;
	uint8_t *payload;
	uint64_t slaves;
	const struct channel *shot_channel[LIMIT_SLAVES];
	uint64_t shot_ns[LIMIT_SLAVES];
};

struct master *master_create(const char *path)
{
	struct master *m = calloc(1, sizeof(*m));

	if (m != NULL) {
		m->path = path;
	}
	return m;
}

static void close_session(struct master *m)
{
	ring_reader_destroy(m->ring);
	free(m->payload);
	m->ring = NULL;
	m->payload = NULL;
	m->meta = NULL;
	m->is_done = 0;
}

void master_destroy(struct master *m)
{
	if (m != NULL) {
		close_session(m);
		free(m);
	}
}

static int is_sound(const struct master *m)
{
	size_t bytes;
	const struct sample_meta *meta = ring_meta(m->ring, &bytes);

	return strcmp(ring_kind(m->ring), "sample") == 0 && bytes >= sizeof(*meta) &&
	       meta->version == SAMPLE_VERSION && meta->slave_count <= LIMIT_SLAVES &&
	       meta->channel_count <= LIMIT_CHANNELS && meta->period_ns > 0 &&
	       meta->period_ns < (uint64_t)NS_PER_S && meta->image_bytes <= LIMIT_IMAGE_BYTES &&
	       bytes >= sizeof(*meta) + meta->slave_count * sizeof(struct slave_info) +
				meta->channel_count * sizeof(struct channel) &&
	       ring_payload_bytes(m->ring) >= sizeof(struct sample_header) + meta->image_bytes;
}

static void seek_back(struct master *m)
{
	uint64_t back = (uint64_t)LEARN_NS / m->meta->period_ns;
	uint64_t newest = ring_newest(m->ring);
	uint64_t oldest = ring_oldest(m->ring);

	ring_seek(m->ring, newest - oldest > back ? newest - back : oldest);
}

int master_open(struct master *m)
{
	size_t bytes;

	if (m->ring != NULL && !m->is_done) {
		return 1;
	}
	if (m->ring != NULL && !ring_is_replaced(m->ring)) {
		return 0;
	}
	close_session(m);
	if (ring_reader_open(m->path, &m->ring) < 0) {
		m->ring = NULL;
		return 0;
	}
	if (!is_sound(m)) {
		close_session(m);
		return -EPROTO;
	}
	m->meta = ring_meta(m->ring, &bytes);
	m->payload = malloc(ring_payload_bytes(m->ring));
	if (m->payload == NULL) {
		close_session(m);
		return 0;
	}
	/* The ring of a master that has gone says nothing of now. */
	if (ring_is_orphaned(m->ring)) {
		m->is_done = 1;
		return 0;
	}
	seek_back(m);
	master_watch_shots(m, 0);
	return 1;
}

const struct sample_meta *master_meta(const struct master *m)
{
	return m->meta;
}

void master_watch_shots(struct master *m, uint64_t slaves)
{
	const struct channel *ch = sample_meta_channels(m->meta);

	m->slaves = slaves;
	memset(m->shot_channel, 0, sizeof(m->shot_channel));
	memset(m->shot_ns, 0, sizeof(m->shot_ns));
	for (uint32_t i = 0; i < m->meta->channel_count; i++) {
		if (ch[i].index == SHOT_INDEX && ch[i].subindex == SHOT_SUBINDEX &&
		    ch[i].bit_len == SHOT_BITS && ch[i].direction == CHANNEL_OUTPUT &&
		    ch[i].slave_pos < LIMIT_SLAVES && (slaves >> ch[i].slave_pos & 1) != 0 &&
		    image_channel_fits(&ch[i], m->meta->image_bytes)) {
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
	struct sample_header h;

	memcpy(&h, m->payload, sizeof(h));
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
	find_shots(m, m->payload + sizeof(h), ret);
}

int master_next(struct master *m, struct master_item *ret)
{
	/* Asked before reading: what was pushed before the producer went is then read. */
	int is_gone = ring_cursor(m->ring) >= ring_newest(m->ring) &&
		      (ring_is_orphaned(m->ring) || ring_is_replaced(m->ring));
	uint64_t lost;

	for (;;) {
		switch (ring_read(m->ring, m->payload, ring_payload_bytes(m->ring), &lost)) {
		case RING_OK:
			make_item(m, ret);
			return 1;
		case RING_LOST:
			break;
		case RING_EMPTY:
			if (!is_gone) {
				return 0;
			}
			m->is_done = 1;
			return -EPIPE;
		case RING_CLOSED:
		case RING_DAMAGED:
			m->is_done = 1;
			return -EPIPE;
		}
	}
}
