/* SPDX-License-Identifier: MIT */
/*
 * Edges in a text file, one a line:
 *
 *   SLAVE MONO_NS [DC_NS [SEQNO]]    as ecdaq-sim --edges writes them, and ecdaq-sync0 --dump
 *   c CYCLE DUE_DC_NS FRAME_DC_NS FRAME_MONO_NS LATENCY_NS DC_DIFF_NS JUDGED
 *                                    the master's data of a cycle (--dump)
 *   s SLAVE AT_DC_NS DUE_DC_NS       the time of its one-shot was set (--dump); checker_shot()
 *   l SLAVE MODE CYCLE_NS SHIFT_NS NAME  what the master states of the slave (--dump)
 *   # comment
 *
 * Nothing in it is trusted. Context: blocking.
 */
#ifndef SYNC0_EDGE_FILE_H
#define SYNC0_EDGE_FILE_H

#include <stdint.h>
#include <stdio.h>

#include "sync0/checker.h"
#include "sync0/edge.h"

enum edge_item_kind {
	EDGE_ITEM_NONE,
	EDGE_ITEM_EDGE,
	EDGE_ITEM_CYCLE,
	EDGE_ITEM_SHOT,
	EDGE_ITEM_LINE
};

struct edge_shot {
	uint16_t slave_pos;
	int64_t at_dc_ns;
	int64_t due_dc_ns;
};

struct edge_item {
	enum edge_item_kind kind;
	struct edge edge; /* its line is the slave's position */
	struct checker_cycle cycle;
	struct edge_shot shot;
	struct checker_line line;
	char name[32]; /* of its slave */
};

/** Take a line apart. 0, or -EINVAL (ret untouched). */
int edge_line_parse(const char *line, struct edge_item *ret);

/** Write what edge_line_parse() takes as EDGE_ITEM_LINE. */
void edge_file_write_line(FILE *out, const struct checker_line *line, const char *name);

struct edge_file;

enum edge_file_from { EDGE_FILE_START, EDGE_FILE_END };

/**
 * Open @path, at its start or after the last complete line. 0 or -errno; -ESPIPE: from its start,
 * and it is no regular file. Free with edge_file_close().
 */
int edge_file_open(const char *path, enum edge_file_from from, struct edge_file **ret_file);
void edge_file_close(struct edge_file *ef);
/** The next item. 1; 0: none now; -EBADMSG: a line that is none, see edge_file_line(). */
int edge_file_next(struct edge_file *ef, struct edge_item *ret);
/** Number of the line that was read last, from 1. */
uint64_t edge_file_line(const struct edge_file *ef);
/** 1 if another file has taken its place, or it was truncated: open it again. */
int edge_file_is_replaced(const struct edge_file *ef);

#endif
