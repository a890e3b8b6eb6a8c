/* SPDX-License-Identifier: MIT */
/*
 * Fault lines at run time, one a datagram on a Unix socket; answered with "ok" or why not. A line
 * that begins with "io" is a hand at the slaves' terminals (sim/io_line.h).
 */
#ifndef SIM_SIMULATOR_CONTROL_H
#define SIM_SIMULATOR_CONTROL_H

#include <stddef.h>
#include <stdint.h>

#include "segment/fault.h"
#include "segment/segment.h"

/** The socket or -errno with one line in @error. */
int control_open(const char *path, char *error, size_t error_bytes);
/** Take all lines that wait; their times count from @now_ns. Never blocks. */
void control_serve(int fd, struct fault_plan *plan, struct segment *segment, int64_t now_ns);

#endif
