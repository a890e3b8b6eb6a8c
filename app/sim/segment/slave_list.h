/* SPDX-License-Identifier: MIT */
/*
 * Slaves and how they are connected, as text: "ek1100(el2828,el3104),ek1100(el2004)". A comma goes
 * on from the slave before it, at its lowest free port. Parentheses hold what hangs on one port of
 * the slave before them: port 1, or the one named, "name(2:el2828)". Context: blocking.
 */
#ifndef SIM_SEGMENT_SLAVE_LIST_H
#define SIM_SEGMENT_SLAVE_LIST_H

#include <stddef.h>

enum { SLAVE_LIST_NAME_BYTES = 96 };

struct slave_list_entry {
	char name[SLAVE_LIST_NAME_BYTES];
	int parent;           /* place in the list; -1: the master */
	unsigned parent_port; /* 1 to 3 */
};

/**
 * Parse @text. Returns how many slaves, 1 to @capacity; -EINVAL with the reason in @why: not of
 * this form, a port is taken twice, or too many.
 */
int slave_list_parse(const char *text, struct slave_list_entry *ret_entry, size_t capacity,
		     char *why, size_t why_bytes);

#endif
