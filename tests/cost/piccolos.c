/* SPDX-License-Identifier: MIT */
#include "cost/piccolos.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/bytes.h"
#include "base/clock.h"
#include "base/prng.h"

/* One channel of a board: where it is in the board's outputs or inputs. */
static const struct {
	const char *name;
	const char *unit;
	uint16_t index;
	uint8_t type;
	uint8_t direction;
	uint8_t bit_len;
	uint8_t bit_offset;
	double scale;
} entries[PICCOLO_CHANNELS] = {
	{ "led", "", 0x7000, CHANNEL_BOOL, CHANNEL_OUTPUT, 1, 0, 1 },
	{ "oneshot_time", "", 0x7000, CHANNEL_UINT, CHANNEL_OUTPUT, 64, 8, 1 },
	{ "adc", "V", 0x6000, CHANNEL_UINT, CHANNEL_INPUT, 16, 0, 3.3 / 4096 },
	{ "counter", "", 0x6000, CHANNEL_UINT, CHANNEL_INPUT, 16, 16, 1 },
	{ "sample_time", "ns", 0x6000, CHANNEL_UINT, CHANNEL_INPUT, 64, 32, 1 },
	{ "status", "", 0x6000, CHANNEL_UINT, CHANNEL_INPUT, 8, 96, 1 },
};

enum { COUNTER = 3 };

/* Channel @i of @slave; those beyond the board's own are 16 bits each behind its inputs. */
static struct channel channel_of(const struct piccolos *p, unsigned slave, unsigned i)
{
	int is_own = i < PICCOLO_CHANNELS;
	int is_output = is_own && entries[i].direction == CHANNEL_OUTPUT;
	unsigned first =
		is_output ? slave * PICCOLO_OUTPUT_BYTES : p->output_bytes + slave * p->input_bytes;
	struct channel ch = { .slave_pos = (uint16_t)slave,
			      .index = 0x6010,
			      .subindex = (uint8_t)(i + 1),
			      .type = CHANNEL_UINT,
			      .direction = CHANNEL_INPUT,
			      .bit_len = 16,
			      .scale = 10.0 / 32768 };

	if (is_own) {
		ch.index = entries[i].index;
		ch.type = entries[i].type;
		ch.direction = entries[i].direction;
		ch.bit_len = entries[i].bit_len;
		ch.bit_offset = first * 8 + entries[i].bit_offset;
		ch.scale = entries[i].scale;
		snprintf(ch.name, sizeof(ch.name), "piccolo%u.%s", slave, entries[i].name);
		snprintf(ch.unit, sizeof(ch.unit), "%s", entries[i].unit);
		return ch;
	}
	ch.bit_offset = (first + PICCOLO_INPUT_BYTES + 2 * (i - PICCOLO_CHANNELS)) * 8;
	snprintf(ch.name, sizeof(ch.name), "piccolo%u.ai%u", slave, i);
	snprintf(ch.unit, sizeof(ch.unit), "V");
	return ch;
}

static void describe(const struct piccolos *p, unsigned slave, struct slave_info *info,
		     struct channel *channels)
{
	*info = (struct slave_info){
		.vendor = 2,
		.product = 0x04570862,
		.slave_pos = (uint16_t)slave,
		.station_addr = (uint16_t)(0x1001 + slave),
		.has_dc = 1,
		.is_dc_reference = slave == 0,
		.counter_channel = (int32_t)(slave * p->slave_channels + COUNTER),
		.input_bits = p->input_bytes * 8,
		.output_bits = PICCOLO_OUTPUT_BYTES * 8,
	};
	snprintf(info->name, sizeof(info->name), "piccolo%u", slave);
	snprintf(info->device, sizeof(info->device), "FB1111-0141 Piccolo");
	for (unsigned i = 0; i < p->slave_channels; i++) {
		channels[i] = channel_of(p, slave, i);
	}
}

struct piccolos piccolos_make(unsigned slave_count, unsigned slave_channels)
{
	uint32_t input_bytes = PICCOLO_INPUT_BYTES + 2 * (slave_channels - PICCOLO_CHANNELS);
	struct piccolos p = {
		.meta_bytes = (uint32_t)(sizeof(struct sample_meta) +
					 slave_count * (sizeof(struct slave_info) +
							slave_channels * sizeof(struct channel))),
		.slave_count = slave_count,
		.channel_count = slave_count * slave_channels,
		.slave_channels = slave_channels,
		.input_bytes = input_bytes,
		.image_bytes = slave_count * (PICCOLO_OUTPUT_BYTES + input_bytes),
		.output_bytes = slave_count * PICCOLO_OUTPUT_BYTES,
	};
	struct slave_info *slaves;
	struct channel *channels;

	p.meta = calloc(1, p.meta_bytes);
	if (p.meta == NULL) {
		perror("piccolos");
		exit(1);
	}
	*p.meta = (struct sample_meta){ .version = SAMPLE_VERSION,
					.slave_count = slave_count,
					.channel_count = p.channel_count,
					.image_bytes = p.image_bytes,
					.output_bytes = p.output_bytes,
					.tai_offset_s = 37,
					.period_ns = PICCOLO_PERIOD_NS,
					.session = 1 };
	slaves = (struct slave_info *)(void *)(p.meta + 1);
	channels = (struct channel *)(void *)(slaves + slave_count);
	for (unsigned i = 0; i < slave_count; i++) {
		describe(&p, i, &slaves[i], channels + i * slave_channels);
	}
	p.slaves = slaves;
	p.channels = channels;
	return p;
}

void piccolos_done(struct piccolos *p)
{
	free(p->meta);
	p->meta = NULL;
}

void piccolos_sample(const struct piccolos *p, int64_t dc_ns, uint8_t *image)
{
	uint64_t edge = (uint64_t)dc_ns / PICCOLO_PERIOD_NS;

	for (unsigned i = 0; i < p->slave_count; i++) {
		uint8_t *in = image + p->output_bytes + (size_t)i * p->input_bytes;
		double turns = (double)(edge % 1000) / 1000 - 0.25 * i;

		put_le16(in, (uint16_t)lround((1 + 0.5 * sin(2 * M_PI * turns)) / 3.3 * 4096));
		put_le16(in + 2, (uint16_t)(edge + 100 * i));
		put_le64(in + 4, edge * PICCOLO_PERIOD_NS);
		in[12] = 0;
	}
}

static int32_t noise(struct prng *prng, uint32_t range)
{
	return (int32_t)prng_below(prng, 2 * range + 1) - (int32_t)range;
}

void piccolos_push(const struct piccolos *p, struct ring *ring, uint64_t cycle)
{
	static uint8_t image[LIMIT_IMAGE_BYTES];
	struct prng prng = { cycle * 77 };
	int64_t since_ns = (int64_t)cycle * PICCOLO_PERIOD_NS;
	int64_t dc_ns = INT64_C(800000000) * NS_PER_S + since_ns;
	int32_t late_ns = 12000 + noise(&prng, 4000);
	int32_t phase_ns = noise(&prng, 4000);
	struct sample_header h = {
		.cycle = cycle,
		.dc_time_ns = dc_ns,
		.wake_mono_ns = since_ns + late_ns,
		.wake_tai_ns = INT64_C(1766000000) * NS_PER_S + since_ns + late_ns,
		.frame_dc_ns = dc_ns + PICCOLO_PERIOD_NS / 2 + phase_ns,
		.wake_latency_ns = late_ns,
		.round_trip_ns = 40000 + noise(&prng, 8000),
		.phase_error_ns = phase_ns,
		.dc_diff_ns = 7 + noise(&prng, 7),
		.wkc = (uint16_t)(3 * p->slave_count),
		.wkc_expected = (uint16_t)(3 * p->slave_count),
	};

	piccolos_sample(p, dc_ns, image);
	for (unsigned i = 0; i < p->slave_count; i++) {
		uint8_t *adc = image + p->output_bytes + (size_t)i * p->input_bytes;

		image[i * PICCOLO_OUTPUT_BYTES] = i % 7 == 0;
		put_le16(adc, (uint16_t)(get_le16(adc) + noise(&prng, 2)));
		for (unsigned k = PICCOLO_CHANNELS; k < p->slave_channels; k++) {
			uint8_t *more = adc + PICCOLO_INPUT_BYTES + 2 * (k - PICCOLO_CHANNELS);

			put_le16(more, (uint16_t)(16384 + 100 * (int)k + noise(&prng, 2)));
		}
	}
	ring_push(ring, &h, sample_head_bytes(p->slave_count), image, p->image_bytes);
}

uint32_t piccolos_sample_bytes(const struct piccolos *p)
{
	return sample_head_bytes(p->slave_count) + p->image_bytes;
}

struct ring *piccolos_ring(const struct piccolos *p, const char *path, const char *kind,
			   uint32_t payload_bytes)
{
	int is_sample = strcmp(kind, "sample") == 0;
	struct ring *ring;
	int r = ring_create(&(struct ring_spec){ .path = path,
						 .kind = kind,
						 .payload_bytes = payload_bytes,
						 .slot_count = PICCOLO_SLOTS,
						 .meta = is_sample ? p->meta : NULL,
						 .meta_bytes = is_sample ? p->meta_bytes : 0,
						 .period_ns = PICCOLO_PERIOD_NS,
						 .file_mode = 0600 },
			    &ring);

	if (r < 0) {
		fprintf(stderr, "%s: %s\n", path, strerror(-r));
		exit(1);
	}
	return ring;
}
