/* SPDX-License-Identifier: MIT */
/*
 * The test bench: a line of slaves on virtual time, FB1111-Piccolo boards by default, a host clock,
 * a plan of faults, and an oscilloscope on every SYNC0 pin. Masters come and go (virtual_master.h).
 */
#ifndef TESTS_SIM_HARNESS_VIRTUAL_BENCH_H
#define TESTS_SIM_HARNESS_VIRTUAL_BENCH_H

#include <stdint.h>

#include "base/limits.h"
#include "segment/in_process.h"
#include "segment/segment.h"

/* 2026-11-19: TAI that the host's clock starts at. */
#define VIRTUAL_TAI_START_NS (INT64_C(1795000000) * NS_PER_S)

enum { VIRTUAL_EDGES = 128 }; /* that are remembered of each slave */

/* Fill the spec of the slave at @position; a negative errno ends the test. */
typedef int (*virtual_slave_maker)(int position, struct segment_slave_spec *ret_spec);

/** A maker's slave of the catalogue, by @name. */
int virtual_bench_slave(const char *name, int position, struct segment_slave_spec *ret_spec);

struct virtual_spec {
	unsigned slaves;          /* 0: 2 */
	virtual_slave_maker make; /* NULL: FB1111-Piccolo boards */
	double ppm[LIMIT_SLAVES]; /* crystals, in order */
	double host_ppm;
	uint64_t seed;         /* clocks' start, wake latencies, faults */
	int64_t tai_start_ns;  /* 0: VIRTUAL_TAI_START_NS; -1: 1970 */
	int64_t wake_sigma_ns; /* 0: 3 us; -1: none */
	int64_t wake_spike_ns;
	uint32_t spikes_per_million;
};

/* The edges of one slot of the grid, in true time. */
struct virtual_slot {
	int64_t slot;
	int64_t first_ns;
	int64_t last_ns;
	unsigned slaves; /* that had an edge in it */
};

/* The oscilloscope: edges of one slot of the grid, compared between slaves. */
struct virtual_scope {
	int64_t period_ns;
	int is_measuring;
	int64_t edge_ns[LIMIT_SLAVES];    /* of the newest edge, its true time */
	uint64_t system_ns[LIMIT_SLAVES]; /* its system time */
	uint64_t edges[LIMIT_SLAVES];
	struct virtual_slot newest[VIRTUAL_EDGES]; /* slots, by their number */
	int64_t spread_max_ns; /* largest distance between two slaves, while measuring */
	uint64_t compared;
	int64_t past_slot[LIMIT_SLAVES][VIRTUAL_EDGES]; /* of the newest edges, by slot */
	int64_t past_ns[LIMIT_SLAVES][VIRTUAL_EDGES];   /* true times of those */
};

struct virtual_bench {
	struct virtual_spec spec;
	struct segment *segment;
	struct in_process *host;
	struct fault_plan *faults;
	struct virtual_scope scope;
	/* Every SYNC0 edge; NULL: none looks. */
	void (*each_edge)(void *user, unsigned slave, int64_t t_ns, uint64_t system_time_ns);
	void *user; /* of that */
};

/** Ends the test if it cannot be built. Free with virtual_bench_done(). */
void virtual_bench_init(struct virtual_bench *bench, const struct virtual_spec *spec);
void virtual_bench_done(struct virtual_bench *bench);

/** Add one line of sim/fault.h; its times count from now. */
void virtual_bench_fault(struct virtual_bench *bench, const char *line);
/** True time now. */
int64_t virtual_bench_now_ns(const struct virtual_bench *bench);
/** True time of the SYNC0 edge of @slave that belongs to @dc_time_ns; 0: there was none, or it was
 * too long ago (VIRTUAL_EDGES). */
int64_t virtual_bench_edge_ns(const struct virtual_bench *bench, unsigned slave,
			      int64_t dc_time_ns);
/** Write one byte of the registers of the slave with @station address, behind the master's back. */
void virtual_bench_write(struct virtual_bench *bench, uint16_t station, uint16_t address,
			 uint8_t value);
/** The AL status register of @slave: its state and the error bit. */
unsigned virtual_bench_al_status(const struct virtual_bench *bench, unsigned slave);
/** Discard the measurements and start new ones. */
void virtual_bench_measure(struct virtual_bench *bench);

#endif
