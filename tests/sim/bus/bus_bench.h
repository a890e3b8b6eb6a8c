/* SPDX-License-Identifier: MIT */
/*
 * A bus on a simulated line of slaves, on virtual time, with a cycle of its own: exchange_run()
 * every period, half a period after SYNC0, by a plain proportional correction. No daemon, no ring.
 */
#ifndef TESTS_SIM_BUS_BUS_BENCH_H
#define TESTS_SIM_BUS_BUS_BENCH_H

#include <stdint.h>

#include "bus/bus.h"
#include "config/config.h"
#include "segment/fault.h"
#include "segment/in_process.h"
#include "segment/segment.h"

enum { BENCH_SIIS = 8, BENCH_HELD = 16 };

struct bench_spec {
	unsigned piccolos;           /* boards in line, first on the bus */
	const char *sii[BENCH_SIIS]; /* then SII-only slaves by file name in the data folder */
	const char *catalogue[BENCH_SIIS]; /* then slaves of the simulator's catalogue */
	struct {
		const uint8_t *bytes;
		size_t len;
	} image[BENCH_SIIS]; /* then SII-only slaves of these images */
	double ppm[LIMIT_SLAVES];
	double host_ppm;
	uint64_t seed;
	uint64_t clockless;   /* bit n: slave n has no distributed clock */
	uint64_t clocked;     /* bit n: slave n has an ET1100's */
	int64_t tai_start_ns; /* 0: 2026 */
	uint64_t clock_start_ns[LIMIT_SLAVES];
	const char *const *settings; /* of config_set(), NULL at the end */
};

struct bus_bench {
	struct segment *segment;
	struct in_process *host;
	struct fault_plan *faults;
	struct transport wire; /* of the host; the master's goes through the bench */
	unsigned frames_sent;
	int is_reference_mute;
	int is_loopback;        /* frames come back from a plug, no slave sees them */
	int64_t pause_every_ns; /* the segment stands still for pause_ns each time; 0: never */
	int64_t pause_ns;
	uint8_t held[BENCH_HELD][LIMIT_FRAME_BYTES]; /* sent while it stood still */
	size_t held_len[BENCH_HELD];
	unsigned held_count;
	unsigned eeprom_commands; /* writes to 0x0502 */
	struct config cfg;
	struct line *line;
	struct bus *bus;
	struct exchange *ex;
	uint8_t image[LIMIT_IMAGE_BYTES];
	mono_t deadline;
	struct exchange_result last;
	uint64_t cycles;
	uint64_t ok;
	uint64_t lost;
	uint64_t wkc_low;
	int64_t phase_error_ns;
	char error[BUS_ERROR_BYTES];
	struct status_page *page;
	uint64_t events[EVENT_COUNT];
	struct event last_event[EVENT_COUNT];
};

/** Ends the test if it cannot be built; skips it where an SII file is not there. */
struct bus_bench *bench_create(const struct bench_spec *spec);
void bench_destroy(struct bus_bench *b);
/** End the master without taking the bus down; a new one opens the same line. */
void bench_new_master(struct bus_bench *b);

/* Steps of bring-up; each returns the result of the bus call. */
int bench_find(struct bus_bench *b);  /* scan, compare */
int bench_map(struct bus_bench *b);   /* and map, clocks */
int bench_cycle(struct bus_bench *b); /* exchange begins; runs until the loop has settled */
int bench_to_op(struct bus_bench *b); /* SYNC0, SAFE-OP, OP */
/** All of it; ends the test with the bus's line on failure. */
void bench_bring_up(struct bus_bench *b);
/** @count cycles. */
void bench_run(struct bus_bench *b, unsigned count);
/** bus_watch() every 50 cycles until all are in OP; cycles it took, or ends the test after @limit.
 */
unsigned bench_recover(struct bus_bench *b, unsigned limit);
/** One look. */
struct bus_watch_report bench_watch(struct bus_bench *b);
int bench_stop(struct bus_bench *b);

/** 1: the reference's system time no longer answers (WKC 0), all else does; 0: it answers again. */
void bench_mute_reference(struct bus_bench *b, int is_mute);
/** A line of sim/fault.h; its times count from now. */
void bench_fault(struct bus_bench *b, const char *line);
/** Frames that any master sent so far. */
unsigned bench_frames_sent(const struct bus_bench *b);
/** Mails that reached a slave's mailbox whole. */
unsigned bench_mailbox_writes(const struct bus_bench *b);
/** True time. */
int64_t bench_now_ns(const struct bus_bench *b);
const struct channel *bench_channel(const struct bus_bench *b, const char *name);
uint64_t bench_value(const struct bus_bench *b, const char *name);

#endif
