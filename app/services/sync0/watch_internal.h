/* SPDX-License-Identifier: MIT */
/* Private to the files watch*.c. */
#ifndef SYNC0_WATCH_INTERNAL_H
#define SYNC0_WATCH_INTERNAL_H

#include "base/limits.h"
#include "sync0/calibration.h"
#include "sync0/checker.h"
#include "sync0/edge_file.h"
#include "sync0/gpio_lines.h"
#include "sync0/master.h"
#include "sync0/output.h"
#include "sync0/watch.h"

struct watch_line {
	uint16_t item;      /* of slaves[], from 0; WATCH_NO_ITEM: it is not configured */
	uint16_t slave_pos; /* EVENT_NO_SLAVE: it is absent. Before a session: as configured */
	int64_t cycle_ns;   /* of its SYNC0, as the master states it; 0: none */
	int64_t shift_ns;
};

#define WATCH_NO_ITEM UINT16_C(0xffff)

struct watch {
	struct watch_spec spec;
	struct output *out;
	struct master *master;
	struct checker *checker; /* of the session; NULL: none */
	int has_session;
	int lines_changed;        /* a line was opened or closed: restart the check */
	struct gpio_lines *lines; /* NULL: simulated */
	struct edge_file *edges;  /* the simulation's; NULL: not open */
	struct calibration calibration;
	uint64_t line_of_slave[LIMIT_SLAVES]; /* plus one; 0: none */
	struct watch_line line[LIMIT_SYNC0_LINES];
	size_t line_count;
	int64_t since_ns;  /* edges are received from here on */
	int64_t newest_ns; /* edge of the file */
	int64_t tried_ns;
	int64_t stepped_ns; /* 0: not yet */
	uint64_t windows;   /* and alarms, of the sessions before this one */
	uint64_t alarms;
	char page_error[OUTPUT_WHY_BYTES]; /* why the page is not published */
	char master_path[CONFIG_PATH_BYTES];
};

int64_t watch_now_ns(const struct watch *w);
/** Whether edges are received at all. */
int watch_has_source(const struct watch *w);
void watch_set_state(struct watch *w, enum sync0_state state);
/** The status page's lines: which they are, of which slaves. */
void watch_name_lines(struct watch *w);
/** Make a checker for the master's open session. */
void watch_begin_session(struct watch *w);
void watch_end_session(struct watch *w);
/** Give the master's cycles to the checker. 0 when its session has ended. */
int watch_read_master(struct watch *w);

#endif
