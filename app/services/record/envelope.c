/* SPDX-License-Identifier: MIT */
#include "record/envelope.h"

#include <assert.h>
#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/bytes.h"
#include "base/clock.h"
#include "base/limits.h"
#include "image/field.h"
#include "image/image.h"

enum { VERSION = 1, HEAD_BYTES = 16, BLOCK_HEAD_BYTES = 12, CELL_BYTES = 20 };

/* Integers are counted as they are on the wire, and scaled with their block. */
struct envelope_channel {
	const struct channel *channel;
	struct image_field image;
	uint64_t sign;      /* the highest bit of an integer with a sign */
	uint8_t is_integer; /* that an int64_t holds */
};

/* The channels of one slave, up to @end. */
struct envelope_slave {
	uint16_t slave_pos;
	uint32_t end;
};

struct envelope {
	uint32_t block_cycles;
	uint32_t channels;
	uint32_t slaves;
	struct envelope_slave *slave;
	struct envelope_channel *channel; /* slave by slave */
	struct envelope_sum *sum;         /* of the open block */
	uint64_t block;
	uint32_t samples; /* in the open block; 0: none is open */
	uint32_t blocks;  /* that are closed */
	size_t blocks_at;
	size_t len; /* of bytes, without the open block */
	uint8_t *bytes;
};

void envelope_sum_join(struct envelope_sum *s, const struct envelope_sum *more)
{
	s->good += more->good;
	s->min = more->min < s->min ? more->min : s->min;
	s->max = more->max > s->max ? more->max : s->max;
	s->sum += more->sum;
	s->squares += more->squares;
}

uint32_t envelope_block_cycles(uint64_t period_ns)
{
	return period_ns > 0 && period_ns < (uint64_t)NS_PER_S
		       ? (uint32_t)((uint64_t)NS_PER_S / period_ns)
		       : 1;
}

/* One for each channel: of two fields of one channel the first. */
static void add_channels(struct envelope *e, const struct layout *layout)
{
	uint32_t all = layout_meta(layout)->channel_count;
	size_t count;
	const struct layout_topic *topic = layout_topics(layout, &count);

	for (size_t t = 0; t < count; t++) {
		const struct channel *last = NULL;

		for (size_t i = 0; i < topic[t].field_count; i++) {
			const struct layout_field *f = &topic[t].field[i];

			if (f->channel != last && e->channels < all) {
				e->channel[e->channels++] = (struct envelope_channel){
					.channel = f->channel,
					.image = f->image,
					.sign = f->sign,
					.is_integer = f->channel->type != CHANNEL_FLOAT &&
						      (f->sign != 0 || f->channel->bit_len < 64),
				};
				last = f->channel;
			}
		}
		e->slave[e->slaves++] =
			(struct envelope_slave){ topic[t].slave->slave_pos, e->channels };
	}
}

static size_t block_bytes(uint32_t channels)
{
	return BLOCK_HEAD_BYTES + (size_t)channels * CELL_BYTES;
}

static void put_head(struct envelope *e)
{
	uint8_t *at = e->bytes + HEAD_BYTES;

	put_le32(e->bytes, VERSION);
	put_le32(e->bytes + 4, e->block_cycles);
	put_le32(e->bytes + 12, e->channels);
	for (uint32_t i = 0; i < e->channels; i++) {
		const char *name = e->channel[i].channel->name;
		size_t len = strnlen(name, LIMIT_NAME_BYTES);

		put_le16(at, (uint16_t)len);
		memcpy(at + 2, name, len);
		at += 2 + len;
	}
	e->blocks_at = (size_t)(at - e->bytes);
	e->len = e->blocks_at;
}

int envelope_create(const struct layout *layout, struct envelope **ret_envelope)
{
	const struct sample_meta *meta = layout_meta(layout);
	struct envelope *e = calloc(1, sizeof(*e));
	size_t channels = meta->channel_count;
	size_t slaves;
	size_t head = HEAD_BYTES + channels * (2 + sizeof(((struct channel *)NULL)->name));

	(void)layout_topics(layout, &slaves);
	if (e != NULL) {
		e->slave = calloc(slaves + 1, sizeof(e->slave[0]));
		e->channel = calloc(channels + 1, sizeof(e->channel[0]));
		e->sum = calloc(channels + 1, sizeof(e->sum[0]));
		e->bytes = malloc(head + (ENVELOPE_BLOCKS + 1) * block_bytes((uint32_t)channels));
	}
	if (e == NULL || e->slave == NULL || e->channel == NULL || e->sum == NULL ||
	    e->bytes == NULL) {
		envelope_destroy(e);
		return -ENOMEM;
	}
	e->block_cycles = envelope_block_cycles(meta->period_ns);
	add_channels(e, layout);
	assert(e->channels <= channels && e->slaves <= slaves);
	put_head(e);
	*ret_envelope = e;
	return 0;
}

void envelope_destroy(struct envelope *e)
{
	if (e != NULL) {
		free(e->slave);
		free(e->channel);
		free(e->sum);
		free(e->bytes);
		free(e);
	}
}

static uint8_t *put_float(uint8_t *at, double value)
{
	float number = (float)value;
	uint32_t bits;

	memcpy(&bits, &number, sizeof(bits));
	put_le32(at, bits);
	return at + 4;
}

/* What was counted of the channel's raw numbers, in physical values. */
static struct envelope_sum physical(const struct envelope_channel *c, const struct envelope_sum *s)
{
	double scale = c->channel->scale;
	double offset = c->channel->offset;
	double good = (double)s->good;

	if (!c->is_integer) {
		return *s;
	}
	return (struct envelope_sum){
		.good = s->good,
		.min = (scale < 0 ? s->max : s->min) * scale + offset,
		.max = (scale < 0 ? s->min : s->max) * scale + offset,
		.sum = s->sum * scale + offset * good,
		.squares = s->squares * scale * scale + 2 * scale * offset * s->sum +
			   offset * offset * good,
	};
}

static uint8_t *put_sum(uint8_t *at, const struct envelope_sum *s)
{
	double good = (double)s->good;

	put_le32(at, (uint32_t)s->good);
	at = put_float(at + 4, s->good > 0 ? s->min : (double)NAN);
	at = put_float(at, s->good > 0 ? s->max : (double)NAN);
	at = put_float(at, s->good > 0 ? s->sum / good : (double)NAN);
	/* By rounding, what was offset may be a little below zero. */
	return put_float(at, s->good > 0 ? sqrt(fmax(s->squares, 0) / good) : (double)NAN);
}

/* The open block behind the closed ones; there is always room for it. */
static void put_open_block(struct envelope *e)
{
	uint8_t *at = e->bytes + e->len;

	put_le64(at, e->block);
	put_le32(at + 8, e->samples);
	at += BLOCK_HEAD_BYTES;
	for (uint32_t i = 0; i < e->channels; i++) {
		struct envelope_sum sum = physical(&e->channel[i], &e->sum[i]);

		at = put_sum(at, &sum);
	}
}

static void open_block(struct envelope *e, uint64_t block)
{
	if (e->samples > 0) {
		put_open_block(e);
		e->len += block_bytes(e->channels);
		e->blocks++;
	}
	for (uint32_t i = 0; i < e->channels; i++) {
		e->sum[i] = ENVELOPE_SUM_NONE;
	}
	e->block = block;
	e->samples = 0;
}

static inline void add_value(const struct envelope_channel *c, const uint8_t *image,
			     struct envelope_sum *sum)
{
	uint64_t raw = image_field_get(image, c->image);
	double value;

	if (c->is_integer) {
		envelope_sum_add(sum, (double)(int64_t)((raw ^ c->sign) - c->sign));
		return;
	}
	value = image_raw_to_physical(c->channel, raw);
	if (!isnan(value)) {
		envelope_sum_add(sum, value);
	}
}

void envelope_add(struct envelope *e, const struct sample_header *header, const uint8_t *image)
{
	uint64_t block = header->cycle / e->block_cycles;
	const struct envelope_channel *c = e->channel;
	struct envelope_sum *sum = e->sum;

	assert(e->blocks < ENVELOPE_BLOCKS);
	if (e->samples == 0 || block != e->block) {
		open_block(e, block);
	}
	e->samples++;
	for (uint32_t i = 0; i < e->slaves; i++) {
		const struct envelope_channel *end = e->channel + e->slave[i].end;

		if (!sample_is_good(header, e->slave[i].slave_pos)) {
			sum += end - c;
			c = end;
		}
		for (; c < end; c++, sum++) {
			add_value(c, image, sum);
		}
	}
}

int envelope_is_full(const struct envelope *e)
{
	return e->blocks == ENVELOPE_BLOCKS;
}

size_t envelope_size(const struct envelope *e)
{
	/* Behind a sample there is always an open block. */
	return e->samples == 0 ? 0 : e->len + block_bytes(e->channels);
}

const uint8_t *envelope_bytes(struct envelope *e)
{
	put_le32(e->bytes + 8, e->blocks + 1);
	put_open_block(e);
	return e->bytes;
}

void envelope_clear(struct envelope *e)
{
	e->blocks = 0;
	e->len = e->blocks_at;
	e->samples = 0;
}

int envelope_parse(const uint8_t *data, size_t len, struct envelope_view *ret)
{
	struct envelope_view v = { .data = data, .names_at = HEAD_BYTES };
	size_t at = HEAD_BYTES;

	if (len < HEAD_BYTES) {
		return -EBADMSG;
	}
	if (get_le32(data) != VERSION) {
		return -ENOTSUP;
	}
	v.block_cycles = get_le32(data + 4);
	v.blocks = get_le32(data + 8);
	v.channels = get_le32(data + 12);
	for (uint32_t i = 0; i < v.channels; i++) {
		size_t left = len - at;

		if (left < 2 || get_le16(data + at) > left - 2) {
			return -EBADMSG;
		}
		at += 2 + (size_t)get_le16(data + at);
	}
	v.blocks_at = at;
	v.block_bytes = block_bytes(v.channels);
	if (v.block_cycles == 0 || (len - at) % v.block_bytes != 0 ||
	    (len - at) / v.block_bytes != v.blocks) {
		return -EBADMSG;
	}
	*ret = v;
	return 0;
}

struct mcap_text envelope_channel(const struct envelope_view *v, uint32_t i)
{
	size_t at = v->names_at;

	assert(i < v->channels);
	while (i-- > 0) {
		at += 2 + (size_t)get_le16(v->data + at);
	}
	return (struct mcap_text){ (const char *)v->data + at + 2, get_le16(v->data + at) };
}

uint64_t envelope_block(const struct envelope_view *v, uint32_t i, uint32_t *ret_samples)
{
	const uint8_t *at = v->data + v->blocks_at + i * v->block_bytes;

	assert(i < v->blocks);
	*ret_samples = get_le32(at + 8);
	return get_le64(at) * v->block_cycles;
}

static double get_float(const uint8_t *at)
{
	uint32_t bits = get_le32(at);
	float number;

	memcpy(&number, &bits, sizeof(number));
	return (double)number;
}

struct envelope_sum envelope_get(const struct envelope_view *v, uint32_t i, uint32_t channel)
{
	const uint8_t *at = v->data + v->blocks_at + i * v->block_bytes + BLOCK_HEAD_BYTES +
			    (size_t)channel * CELL_BYTES;
	uint32_t good = get_le32(at);
	double rms = get_float(at + 16);

	assert(i < v->blocks && channel < v->channels);
	if (good == 0) {
		return ENVELOPE_SUM_NONE;
	}
	return (struct envelope_sum){ .good = good,
				      .min = get_float(at + 4),
				      .max = get_float(at + 8),
				      .sum = get_float(at + 12) * good,
				      .squares = rms * rms * good };
}
