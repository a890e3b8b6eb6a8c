/* SPDX-License-Identifier: MIT */
/* What the frames that come back to the master show of its first output bit and of the AL states.
 */
#ifndef TESTS_SIM_SCENARIOS_OUTPUT_WATCH_H
#define TESTS_SIM_SCENARIOS_OUTPUT_WATCH_H

#include "sim/harness/virtual_master.h"

/* Since output_watch_begin(). */
struct output_watch {
	int64_t since_ns;
	int64_t newest_live_ns; /* a frame with the output set, until the first without */
	int64_t first_safe_ns;  /* the first with all outputs at fail-safe; 0: none */
	int64_t first_al_ns;    /* the first that shows a slave out of OP; 0: none */
	unsigned live;
	unsigned safe;
	/* Service datagrams that were answered, and when the first and the newest was. */
	struct output_activity {
		unsigned count;
		int64_t first_ns;
		int64_t newest_ns;
	} eeprom, mailbox;
	uint16_t mailbox_station; /* whose mailbox datagrams are counted; 0: of no slave */
};

/** The master's frames are read into @watch, which is zeroed but for mailbox_station. */
void output_watch_begin(struct output_watch *watch, struct virtual_master *vm);
void output_watch_end(struct virtual_master *vm);

/** Set an output of one bit through the admin socket; a refusal ends the test. */
void output_watch_set(struct virtual_master *vm, const char *channel, uint64_t raw);

#endif
