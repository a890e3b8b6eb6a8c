/* SPDX-License-Identifier: MIT */
#include "publish/sample_writer.h"

#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "ecdaq.h"
#include "image/field.h"
#include "image/image.h"
#include "ros2.h"

/* The messages of one slave; their sequences point to the buffers below. */
struct slave_out {
	ecdaq_SampleV1 sample;
	ecdaq_BlockV1 block;
	struct image_field *field; /* of the channels, in their order */
	double *values;
	uint64_t *raw;
	uint64_t *cycle;
	int64_t *dc_time_ns;
	int64_t *utc_ns;
	uint32_t *flags;
	bool *is_good;
	double *adc;
	uint64_t *counter;
	int64_t *sample_time_ns;
	double *block_values;
	uint64_t *block_raw;
	const struct channel *adc_channel; /* NULL: the slave has no such input */
	const struct channel *counter_channel;
	const struct channel *sample_time_channel;
};

struct sample_writer {
	struct reader *reader;
	const struct channel_table *table; /* the reader's */
	const struct topics *topics;
	struct sample_counts *counts;
	struct utc *utc;
	uint32_t block_cycles;
	uint64_t cycle;
	int64_t utc_ns;
	struct slave_out *out;
};

/* The generated sequences differ in type only. */
#define SEQUENCE_SET(sequence, buffer, n)                                                          \
	do {                                                                                       \
		(sequence)._buffer = (buffer);                                                     \
		(sequence)._length = (uint32_t)(n);                                                \
		(sequence)._maximum = (uint32_t)(n);                                               \
		(sequence)._release = false;                                                       \
	} while (0)

static const struct channel *input(const struct channel_table *t, uint32_t slave, const char *entry)
{
	int i = channel_table_find_entry(t, slave, entry, CHANNEL_INPUT);

	return i < 0 ? NULL : &t->channels[i];
}

static int make_out(struct slave_out *out, const struct channel_table *t, uint32_t slave,
		    uint32_t cycles)
{
	size_t n = t->count[slave] > 0 ? t->count[slave] : 1;
	size_t k = cycles > 0 ? cycles : 1;

	out->field = calloc(n, sizeof(out->field[0]));
	out->values = calloc(n, sizeof(double));
	out->raw = calloc(n, sizeof(uint64_t));
	out->cycle = calloc(k, sizeof(uint64_t));
	out->dc_time_ns = calloc(k, sizeof(int64_t));
	out->utc_ns = calloc(k, sizeof(int64_t));
	out->flags = calloc(k, sizeof(uint32_t));
	out->is_good = calloc(k, sizeof(bool));
	out->adc = calloc(k, sizeof(double));
	out->counter = calloc(k, sizeof(uint64_t));
	out->sample_time_ns = calloc(k, sizeof(int64_t));
	out->block_values = calloc(n * k, sizeof(double));
	out->block_raw = calloc(n * k, sizeof(uint64_t));
	if (out->field == NULL || out->values == NULL || out->raw == NULL || out->cycle == NULL ||
	    out->dc_time_ns == NULL || out->utc_ns == NULL || out->flags == NULL ||
	    out->is_good == NULL || out->adc == NULL || out->counter == NULL ||
	    out->sample_time_ns == NULL || out->block_values == NULL || out->block_raw == NULL) {
		return -ENOMEM;
	}
	for (uint32_t i = 0; i < t->count[slave]; i++) {
		out->field[i] = image_field_of(channel_table_at(t, slave, i));
	}
	out->adc_channel = input(t, slave, "adc");
	out->counter_channel = input(t, slave, "counter");
	out->sample_time_channel = input(t, slave, "sample_time");
	out->sample.slave = (uint16_t)slave;
	out->sample.session = t->meta.session;
	SEQUENCE_SET(out->sample.values, out->values, t->count[slave]);
	SEQUENCE_SET(out->sample.raw, out->raw, t->count[slave]);
	out->block.slave = (uint16_t)slave;
	out->block.session = t->meta.session;
	out->block.channel_count = t->count[slave];
	return 0;
}

static void free_out(struct slave_out *out)
{
	free(out->field);
	free(out->values);
	free(out->raw);
	free(out->cycle);
	free(out->dc_time_ns);
	free(out->utc_ns);
	free(out->flags);
	free(out->is_good);
	free(out->adc);
	free(out->counter);
	free(out->sample_time_ns);
	free(out->block_values);
	free(out->block_raw);
}

static int make_all(struct sample_writer *s)
{
	uint32_t slaves = s->table->meta.slave_count;

	s->utc = utc_create(&s->table->meta);
	s->out = calloc(slaves > 0 ? slaves : 1, sizeof(*s->out));
	if (s->utc == NULL || s->out == NULL) {
		return -ENOMEM;
	}
	for (uint32_t i = 0; i < slaves; i++) {
		int r = make_out(&s->out[i], s->table, i, s->block_cycles);

		if (r < 0) {
			return r;
		}
	}
	return 0;
}

int sample_writer_create(struct reader *reader, const struct config *cfg,
			 const struct topics *topics, struct sample_counts *counts,
			 struct sample_writer **ret_samples)
{
	struct sample_writer *s = calloc(1, sizeof(*s));
	int r;

	if (s == NULL) {
		return -ENOMEM;
	}
	s->reader = reader;
	s->table = reader_table(reader);
	s->topics = topics;
	s->counts = counts;
	s->block_cycles = cfg->dds_block_cycles;
	r = make_all(s);
	if (r < 0) {
		sample_writer_destroy(s);
		return r;
	}
	*ret_samples = s;
	return 0;
}

static void put(struct sample_writer *s, dds_entity_t writer, const void *message)
{
	s->counts->failed += topics_write(writer, message, s->utc_ns) < 0;
}

/* The same sample for ROS 2. One writer for all slaves: the type has no key. */
static void mirror(struct sample_writer *s, struct slave_out *out)
{
	const ecdaq_SampleV1 *m = &out->sample;
	ecdaq_msgs_msg_dds__Sample_ twin = {
		.slave_ = m->slave,
		.session_ = m->session,
		.cycle_ = m->cycle,
		.dc_time_ns_ = m->dc_time_ns,
		.utc_ns_ = m->utc_ns,
		.flags_ = m->flags,
		.is_good_ = m->is_good,
		.adc_ = m->adc,
		.counter_ = m->counter,
		.sample_time_ns_ = m->sample_time_ns,
	};

	SEQUENCE_SET(twin.values_, out->values, m->values._length);
	SEQUENCE_SET(twin.raw_, out->raw, m->raw._length);
	put(s, s->topics->ros2_sample, &twin);
}

static void flush_block(struct sample_writer *s, struct slave_out *out)
{
	ecdaq_BlockV1 *b = &out->block;
	uint32_t n = b->count;

	if (n == 0) {
		return;
	}
	SEQUENCE_SET(b->cycle, out->cycle, n);
	SEQUENCE_SET(b->dc_time_ns, out->dc_time_ns, n);
	SEQUENCE_SET(b->utc_ns, out->utc_ns, n);
	SEQUENCE_SET(b->flags, out->flags, n);
	SEQUENCE_SET(b->is_good, out->is_good, n);
	SEQUENCE_SET(b->adc, out->adc, n);
	SEQUENCE_SET(b->counter, out->counter, n);
	SEQUENCE_SET(b->sample_time_ns, out->sample_time_ns, n);
	SEQUENCE_SET(b->values, out->block_values, n * b->channel_count);
	SEQUENCE_SET(b->raw, out->block_raw, n * b->channel_count);
	put(s, s->topics->block, b);
	b->count = 0;
}

void sample_writer_destroy(struct sample_writer *s)
{
	if (s == NULL) {
		return;
	}
	for (uint32_t i = 0; s->out != NULL && i < s->table->meta.slave_count; i++) {
		flush_block(s, &s->out[i]);
		free_out(&s->out[i]);
	}
	free(s->out);
	utc_destroy(s->utc);
	free(s);
}

static void add_to_block(struct sample_writer *s, struct slave_out *out)
{
	const ecdaq_SampleV1 *m = &out->sample;
	ecdaq_BlockV1 *b = &out->block;
	size_t n = b->channel_count;
	size_t k = b->count;

	if (s->block_cycles == 0) {
		return;
	}
	out->cycle[k] = m->cycle;
	out->dc_time_ns[k] = m->dc_time_ns;
	out->utc_ns[k] = m->utc_ns;
	out->flags[k] = m->flags;
	out->is_good[k] = m->is_good;
	out->adc[k] = m->adc;
	out->counter[k] = m->counter;
	out->sample_time_ns[k] = m->sample_time_ns;
	memcpy(out->block_values + k * n, out->values, n * sizeof(double));
	memcpy(out->block_raw + k * n, out->raw, n * sizeof(uint64_t));
	b->count++;
	if (b->count == s->block_cycles) {
		flush_block(s, out);
	}
}

static uint64_t raw_of(const struct channel *ch, const uint8_t *image)
{
	return ch == NULL ? 0 : image_get_raw(image, ch);
}

static void put_slave(struct sample_writer *s, uint32_t slave)
{
	const struct sample_header *h = reader_header(s->reader);
	const uint8_t *image = reader_image(s->reader);
	struct slave_out *out = &s->out[slave];
	ecdaq_SampleV1 *m = &out->sample;

	m->cycle = h->cycle;
	m->dc_time_ns = h->dc_time_ns;
	m->utc_ns = s->utc_ns;
	m->flags = h->flags;
	m->is_good = sample_is_good(h, (uint16_t)slave) != 0;
	for (uint32_t i = 0; i < s->table->count[slave]; i++) {
		out->raw[i] = image_field_get(image, out->field[i]);
		out->values[i] =
			image_raw_to_physical(channel_table_at(s->table, slave, i), out->raw[i]);
	}
	m->adc = out->adc_channel == NULL ? NAN : image_get_physical(image, out->adc_channel);
	m->counter = raw_of(out->counter_channel, image);
	m->sample_time_ns = (int64_t)raw_of(out->sample_time_channel, image);
	put(s, s->topics->sample, m);
	if (s->topics->ros2_sample > 0) {
		mirror(s, out);
	}
	add_to_block(s, out);
}

static void put_cycle(struct sample_writer *s)
{
	/* Without memory for a new map the old one goes on for this sample. */
	(void)utc_feed(s->utc, reader_header(s->reader), &s->utc_ns);
	for (uint32_t i = 0; i < s->table->meta.slave_count; i++) {
		put_slave(s, i);
	}
	s->cycle = reader_header(s->reader)->cycle;
	s->counts->published++;
}

enum sample_writer_result sample_writer_step(struct sample_writer *s, unsigned most)
{
	uint64_t lost = 0;

	for (unsigned n = 0; n < most; n++) {
		switch (reader_next(s->reader, &lost)) {
		case READER_SAMPLE:
			put_cycle(s);
			break;
		case READER_LOST:
			s->counts->missed += lost;
			break;
		case READER_EMPTY:
			return SAMPLE_WRITER_EMPTY;
		case READER_BEGUN:
		case READER_WAITING:
		case READER_ENDED:
			return SAMPLE_WRITER_ENDED;
		}
	}
	return SAMPLE_WRITER_MORE;
}

const struct channel_table *sample_writer_table(const struct sample_writer *s)
{
	return s->table;
}

uint64_t sample_writer_cycle(const struct sample_writer *s)
{
	return s->cycle;
}

int64_t sample_writer_utc_of_tai(const struct sample_writer *s, int64_t tai_ns)
{
	return utc_of_tai(s->utc, tai_ns);
}

void sample_writer_note_tai_offset(struct sample_writer *s, int32_t tai_offset_s)
{
	utc_note_tai_offset(s->utc, tai_offset_s);
}

enum utc_change sample_writer_utc_changed(struct sample_writer *s, struct timemap_state *ret)
{
	return utc_changed(s->utc, ret);
}
