/* SPDX-License-Identifier: MIT */
/*
 * A bus of FB1111-Piccolo boards as tables: what the scan makes of them. Outputs of all slaves
 * first (9 bytes each), then their inputs (13 each, and 2 for each further channel).
 */
#ifndef TESTS_COST_PICCOLOS_H
#define TESTS_COST_PICCOLOS_H

#include <stdint.h>

#include "base/limits.h"
#include "base/ring.h"
#include "base/sample.h"

enum {
	PICCOLO_OUTPUT_BYTES = 9, /* led and 7 bits, oneshot_time */
	PICCOLO_INPUT_BYTES = 13, /* adc, counter, sample_time, status */
	PICCOLO_CHANNELS = 6,
	PICCOLO_PERIOD_NS = 1000000,
	PICCOLO_SLOTS = 1024,
};

/* The meta area of a sample ring. */
struct piccolos {
	struct sample_meta *meta;
	uint32_t meta_bytes;
	const struct slave_info *slaves;
	const struct channel *channels;
	uint32_t slave_count;
	uint32_t channel_count;
	uint32_t slave_channels; /* of one slave */
	uint32_t input_bytes;    /* of one slave */
	uint32_t image_bytes;
	uint32_t output_bytes;
};

/** @slave_channels: of each slave, PICCOLO_CHANNELS or more; the further ones are inputs in volt.
 * Ends the program without memory. Free with piccolos_done(). */
struct piccolos piccolos_make(unsigned slave_count, unsigned slave_channels);
void piccolos_done(struct piccolos *p);

/** Push the sample of @cycle into @ring, with the noise that the times of a real cycle have and one
 * or two counts of it in each adc. Every 7th slave's led is on. */
void piccolos_push(const struct piccolos *p, struct ring *ring, uint64_t cycle);

/** What the slaves put into the inputs of @image for the SYNC0 edge at @dc_ns: a sine of 1 Hz, a
 * counter of edges, the time, a status of 0. */
void piccolos_sample(const struct piccolos *p, int64_t dc_ns, uint8_t *image);

/** A ring of @payload_bytes in @path, with the tables in its meta area if it is one of samples.
 * Ends the program if it cannot be made. */
struct ring *piccolos_ring(const struct piccolos *p, const char *path, const char *kind,
			   uint32_t payload_bytes);
/** Bytes of one sample. */
uint32_t piccolos_sample_bytes(const struct piccolos *p);

#endif
