/* SPDX-License-Identifier: MIT */
/* A duration on the command line. Context: blocking. */
#ifndef PROGRAM_ARGS_DURATION_H
#define PROGRAM_ARGS_DURATION_H

#include "base/args.h"

args_parse_value args_duration; /* int64_t ns, above 0: "500us"; a plain number is in s */

#endif
