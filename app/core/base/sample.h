/* SPDX-License-Identifier: MIT */
/*
 * What a slot of the sample ring holds: one sample_header, without those words of slaves_bad that
 * the slaves of the bus do not need (sample_head_bytes()), then the process image (outputs first,
 * inputs behind), exactly as it was on the wire in that cycle. A change of layout is a new
 * SAMPLE_VERSION; readers refuse any other.
 *
 * Cycle k belongs to the SYNC0 edge at dc_time_ns(k) = dc_time_ns(0) + k * period_ns. There is one
 * sample for every k: a cycle that the master missed has one, too, flagged SAMPLE_SKIPPED.
 */
#ifndef BASE_SAMPLE_H
#define BASE_SAMPLE_H

#include <assert.h>
#include <stddef.h>
#include <stdint.h>

#include "base/limits.h"
#include "base/slave_set.h"

#define SAMPLE_VERSION 4u

enum sample_flag {
	SAMPLE_LOST = 1u << 0,    /* no frame back before the receive deadline: inputs are stale */
	SAMPLE_LATE = 1u << 1,    /* a frame of an earlier cycle arrived and was dropped */
	SAMPLE_WKC_LOW = 1u << 2, /* fewer slaves answered than expected: see slaves_bad */
	SAMPLE_NOT_OP = 1u << 3,  /* the bus is not in OP */
	SAMPLE_FAIL_SAFE = 1u << 4,   /* outputs hold their fail-safe values */
	SAMPLE_SKIPPED = 1u << 5,     /* the master overran: no frame was sent for this SYNC0 */
	SAMPLE_BAD_COUNTER = 1u << 6, /* a slave's conversion counter did not advance as it must */
	SAMPLE_DC_UNLOCKED = 1u << 7, /* the master's servo is not locked to the reference clock */
	SAMPLE_DOUBLED = 1u << 8,     /* a frame came back twice; the second was dropped */
	SAMPLE_UNCHECKED = 1u << 9, /* first sample of a slave in OP: no counter to compare with */
};

struct sample_header {
	uint64_t cycle;       /* index of the SYNC0 edge; one more in every sample */
	int64_t dc_time_ns;   /* DC time of that edge, ns since 2000-01-01; 0 without DC */
	int64_t wake_mono_ns; /* CLOCK_MONOTONIC at the wake */
	int64_t wake_tai_ns;  /* CLOCK_TAI at the wake, ns since 1970 */
	int64_t frame_dc_ns;  /* DC time at which the frame passed the reference clock; 0: none */
	int32_t wake_latency_ns; /* wake minus deadline */
	int32_t round_trip_ns;   /* frame out to frame back; -1: lost */
	int32_t phase_error_ns;  /* frame against SYNC0 plus set point, as the servo saw it */
	int32_t dc_diff_ns;      /* largest |0x092C| of the slaves, upper estimate; -1: not read */
	uint32_t flags;          /* enum sample_flag */
	uint16_t wkc;            /* working counter of the process data, sum over its datagrams */
	uint16_t wkc_expected;
	struct slave_set slaves_bad; /* whose sample is not good (reader/table.h) */
};

static_assert(offsetof(struct sample_header, slaves_bad) == 64, "part of the ring's format");

/* Bytes of the header in the ring: 72 up to 64 slaves, 8 more for each further 64. */
static inline uint32_t sample_head_bytes(uint32_t slave_count)
{
	return (uint32_t)offsetof(struct sample_header, slaves_bad) +
	       slave_set_words(slave_count) * (uint32_t)sizeof(uint64_t);
}

enum channel_type {
	CHANNEL_BOOL = 1,  /* 1 bit */
	CHANNEL_UINT = 2,  /* 1 to 64 bits */
	CHANNEL_INT = 3,   /* 1 to 64 bits, two's complement */
	CHANNEL_FLOAT = 4, /* 32 or 64 bits, IEEE 754 */
};

enum channel_direction { CHANNEL_INPUT = 0, CHANNEL_OUTPUT = 1 }; /* from the master's side */

/* One mapped variable. physical = raw * scale + offset, in @unit. */
struct channel {
	char name[LIMIT_NAME_BYTES]; /* "piccolo0.adc": slave name, dot, entry name */
	char unit[LIMIT_UNIT_BYTES]; /* "" where raw counts are all there is */
	uint16_t slave_pos;          /* 0-based place on the ring */
	uint16_t index;              /* CoE object, 0x6000 */
	uint8_t subindex;
	uint8_t type;        /* enum channel_type */
	uint8_t direction;   /* enum channel_direction */
	uint8_t bit_len;     /* 1 to 64 */
	uint32_t bit_offset; /* from the start of the process image */
	uint32_t reserved;
	double scale;
	double offset;
	double min; /* plausible range, physical; not below max: there is none (image_has_range())
		     */
	double max;
};

static_assert(sizeof(struct channel) == 128, "part of the ring's format");

/* One slave of the segment, as found. */
struct slave_info {
	char name[32];   /* "piccolo0": configured, or made from the device name and position */
	char device[64]; /* name in the slave's SII */
	uint32_t vendor;
	uint32_t product;
	uint32_t revision;
	uint32_t serial;
	uint16_t slave_pos;
	uint16_t station_addr;
	uint16_t alias;
	uint8_t has_dc;
	uint8_t is_dc_reference;
	int32_t dc_delay_ns;
	int32_t counter_channel; /* its conversion counter in the channel table; -1: none */
	uint32_t input_bits;
	uint32_t output_bits;
	uint32_t sync0_cycle_ns; /* a multiple or a fraction of the period; 0: no cyclic SYNC0 */
	int32_t sync0_shift_ns;  /* against the multiples of that: SII and configuration */
	uint16_t config_item;    /* of slaves[], from 1; 0: it is not configured */
	uint16_t reserved[3];
};

static_assert(sizeof(struct slave_info) == 152, "part of the ring's format");

/* The meta area of the sample ring: this, slave_count slave_info, channel_count channel. */
struct sample_meta {
	uint32_t version; /* SAMPLE_VERSION */
	uint32_t slave_count;
	uint32_t channel_count;
	uint32_t image_bytes;  /* outputs and inputs */
	uint32_t output_bytes; /* the first of them */
	int32_t tai_offset_s;  /* TAI - UTC of the kernel at start; 0: unset, CLOCK_TAI is UTC */
	uint64_t period_ns;
	uint64_t session; /* CLOCK_TAI at start: identifies one run of the master */
};

static_assert(sizeof(struct sample_meta) == 40, "part of the ring's format");

static inline const struct slave_info *sample_meta_slaves(const struct sample_meta *meta)
{
	return (const struct slave_info *)(const void *)(meta + 1);
}

static inline const struct channel *sample_meta_channels(const struct sample_meta *meta)
{
	return (const struct channel *)(const void *)(sample_meta_slaves(meta) + meta->slave_count);
}

#endif
