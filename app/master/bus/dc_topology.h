/* SPDX-License-Identifier: MIT */
/*
 * Propagation delays from what the slaves latched: which ports are open, and when the latching
 * frame passed each. Pure. Times are unsigned 32 bit and may wrap between ports (T13); slaves
 * without receive times may be anywhere (T14).
 */
#ifndef BUS_DC_TOPOLOGY_H
#define BUS_DC_TOPOLOGY_H

#include <stddef.h>
#include <stdint.h>

enum clock_kind {
	CLOCK_NONE,          /* no distributed clock at all */
	CLOCK_RECEIVE_TIMES, /* latches port times, but has no system time: never a reference */
	CLOCK_SYSTEM_TIME,
};

enum { DC_PORTS = 4 };

struct dc_node {
	enum clock_kind kind;
	uint8_t ports;              /* bit per port that is open */
	uint32_t time_ns[DC_PORTS]; /* 0x0900.., valid unless CLOCK_NONE */
	/* found by dc_topology_solve() */
	int parent; /* position; -1: the master */
	uint8_t entry_port;
	uint8_t parent_port;
	int64_t cable_ns;   /* one way, from the parent; -1: one of the two has no receive times */
	int64_t arrival_ns; /* after the frame came to the first clock */
	int64_t delay_ns;   /* after it came to the reference clock; 0 on the reference */
};

/**
 * Fill parents, entry ports and delays of @node (in order of position). Returns the position of the
 * reference clock (the first with system time), -ENOENT if there is none, -EPROTO if the open ports
 * make no tree.
 */
int dc_topology_solve(struct dc_node *node, size_t count);

#endif
