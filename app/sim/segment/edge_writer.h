/* SPDX-License-Identifier: MIT */
/*
 * Every SYNC0 edge as a line: slave, CLOCK_MONOTONIC ns, DC ns (sync0/edge_file.h). Into a file, of
 * which it may keep the newest part only; or, each at once, into a pipe. Context: the segment's
 * loop; it never waits for a reader.
 */
#ifndef SIM_SEGMENT_EDGE_WRITER_H
#define SIM_SEGMENT_EDGE_WRITER_H

#include <stdint.h>

struct edge_writer;

/**
 * Make @path anew; a pipe is waited for until somebody reads it. Of a file, at least the newest
 * @keep_bytes stay; older ones become a hole, so that it takes no more room and a reader's place in
 * it stays right. 0: all stay. 0 or -errno. Free with edge_writer_close().
 */
int edge_writer_open(const char *path, uint64_t keep_bytes, struct edge_writer **ret_writer);
/** NULL is fine. */
void edge_writer_close(struct edge_writer *ew);
void edge_writer_put(struct edge_writer *ew, unsigned slave, int64_t mono_ns, uint64_t dc_ns);
/**
 * Hand readers what was put, if the last time is so long ago that it is due. 0; -EOPNOTSUPP or
 * another -errno, once: the file system makes no holes, and all stays from now on.
 */
int edge_writer_flush(struct edge_writer *ew, int64_t now_ns);

#endif
