/* SPDX-License-Identifier: MIT */
/*
 * One row of the fault matrix: a fault, how it is repaired, what must be reported, and its bounds.
 * Each trial is a bus of its own (crystals, clocks, moment of the fault), held against the value
 * oracle in every sample.
 */
#ifndef TESTS_SIM_SCENARIOS_FAULT_TRIAL_H
#define TESTS_SIM_SCENARIOS_FAULT_TRIAL_H

#include "sim/harness/virtual_master.h"

enum { FAULT_TRIAL_SLAVES = 3, FAULT_LINES = 4 };

struct fault_trial {
	struct virtual_bench b;
	struct virtual_master vm;
	struct ring_reader *events;
	uint64_t seed;
	int64_t repaired_ns;
	int64_t not_op_ns; /* newest time out of OP after the repair; 0: none */
	int64_t served_ns; /* by repair_it(): when a request was answered again; 0: not asked */
	uint64_t samples;  /* since the fault */
	uint64_t flagged;  /* number of the first that was not as in peace; 0: none */
	uint64_t bad;      /* samples of which not all slaves were good */
	uint64_t good;     /* values that were called good and compared */
	uint64_t false_good;
	unsigned was_out;  /* ms that the bus was not in OP */
	unsigned rounds;   /* how often it fell out of OP */
	int is_told;       /* the message had the row's words */
	char message[256]; /* the newest that was not empty */
	char asked[256];   /* by break_it(): what a request was answered with */
};

struct fault_row {
	const char *name;
	const char *setting;                    /* of the configuration; NULL: none */
	void (*prepare)(struct fault_trial *t); /* before the bring-up */
	const char *breaks[FAULT_LINES];        /* lines of sim/fault.h */
	const char *repairs[FAULT_LINES];
	void (*break_it)(struct fault_trial *t);
	void (*repair_it)(struct fault_trial *t);
	unsigned out_ms;          /* from the fault to the repair; 0: it repairs itself */
	unsigned repair_takes_ms; /* until the last of @repairs is done: not counted */
	int is_repeated;          /* the fault again whenever the bus is in OP, until the repair */
	int must_be_out;          /* at the repair: nothing but the repair leads back */
	uint16_t event;           /* enum event_id that must come */
	uint16_t slave;           /* of that; EVENT_NO_SLAVE: of none */
	int64_t value;            /* of that; 0: any */
	const char *words;        /* in the message meanwhile; NULL: the event says it all */
	unsigned least_ms; /* from the end of the fault, or its start, to OP: no trial is faster */
	unsigned worst_ms; /* and none slower */
	unsigned detect;   /* at most so many cycles to the first sample that is flagged; 0: none is
			    */
	int has_bad_limits; /* of the samples that are not good in all slaves, from the fault on: */
	unsigned least_bad;
	unsigned worst_bad;
	unsigned rounds; /* at most so many falls out of OP; 0: one */
};

/** Open a bus for @row, break it, repair it, wait until all is well. A failed check ends the test.
 */
void fault_trial_run(struct fault_trial *t, const struct fault_row *row, uint64_t seed);
/** ms from the end of the fault to OP. */
double fault_trial_back_ms(const struct fault_trial *t);

#endif
