/* SPDX-License-Identifier: MIT */
/*
 * Terminals by a line of text: "io slave=0" answers what slave 0 has at its terminals, "io slave=0
 * KEY=VALUE..." sets some of them first. Which keys there are is the device's business.
 */
#ifndef SIM_SEGMENT_IO_LINE_H
#define SIM_SEGMENT_IO_LINE_H

#include <stddef.h>

#include "segment/segment.h"

/**
 * Do @line. 0 with what the terminals have in @answer; -EINVAL with why not (what stood before the
 * wrong word is done); -ENOENT: it is no io line, @answer untouched.
 */
int io_line(struct segment *segment, const char *line, char *answer, size_t answer_bytes);

#endif
