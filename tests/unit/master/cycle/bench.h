/* SPDX-License-Identifier: MIT */
/* A cycle against a scripted exchange: two slaves, one output, a counter of each, virtual time. */
#ifndef TESTS_UNIT_MASTER_CYCLE_BENCH_H
#define TESTS_UNIT_MASTER_CYCLE_BENCH_H

#include <stdint.h>

#include "base/event.h"
#include "base/ring.h"
#include "base/sample.h"
#include "base/slave_set.h"
#include "cycle/cycle.h"

#define PERIOD_NS 1000000

/* Image: output byte, then a 16-bit counter of each of two slaves. */
enum { IMAGE_BYTES = 5, OUTPUT_BYTES = 1, BENCH_SLAVES = 2, BENCH_CHANNELS = 3 };

/* What the bus returns; the test changes it between steps. */
struct world {
	mono_t now;
	int64_t late_ns; /* of the next wake */
	uint16_t counter[2];
	enum exchange_status status;
	int64_t dc_offset_ns; /* DC time minus host time */
	int64_t transit_ns;
	int64_t hold_ns; /* between the sending and the wire, in no round trip */
	int is_timeless; /* the reference's time in the frame is implausible */
	uint64_t slaves_low;
	int64_t dc_diff_ns;
	uint16_t al_status; /* of all slaves ORed */
	uint16_t al_wkc;
	unsigned late;
	unsigned doubled;
	uint8_t seen_output;
	uint64_t written;             /* samples in the ring when the last frame was sent */
	uint64_t conversions_from_dc; /* 1: counters follow the DC time as real slaves do */
};

struct got {
	struct sample_header h;
	uint8_t image[IMAGE_BYTES];
};

extern struct world world;
extern struct cycle_stats stats;
extern struct config cfg;
extern struct board board;
extern struct exchange_plan plan;
extern const struct channel channels[BENCH_CHANNELS];
extern const struct slave_info slaves[BENCH_SLAVES];
extern struct ring_reader *reader;
extern struct cycle *cy;

/* 1 in a thread that only reads the DC time: its host clock is always 0. */
extern _Thread_local int is_dc_reader;

/* A new cycle, in phase CYCLE_CLOCKS. */
void start(void);
/* End what the last start() made; nothing before the first. */
void stop(void);
/* In OP, with 20 good samples behind it, of which next_sample() gives none. */
void start_in_op(void);
void steps(unsigned n);
/* The lamp, through the local board. */
void set_led(uint64_t raw);

/* The next sample of the ring; the test ends if there is none. */
struct got next_sample(void);
/* The next event of @id; the test ends if there is none. */
struct event next_event(enum event_id id);
/* Events of @id from here on. */
unsigned count_events(enum event_id id);
void check_event(struct event ev, uint16_t slave_pos, int64_t value, int32_t arg0, int32_t arg1);

#endif
