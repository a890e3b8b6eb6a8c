/* SPDX-License-Identifier: MIT */
/* What a cycle works on. */
#ifndef CYCLE_CYCLE_SPEC_H
#define CYCLE_CYCLE_SPEC_H

#include <stddef.h>

#include "base/board.h"
#include "base/platform.h"
#include "base/ring.h"
#include "base/sample.h"
#include "base/status.h"
#include "bus/exchange.h"
#include "config/config.h"

enum cycle_writer { CYCLE_WRITER_LOCAL, CYCLE_WRITER_PROGRAM, CYCLE_WRITER_REMOTE, CYCLE_WRITERS };

struct control;

/* All of it outlives the cycle. */
struct cycle_spec {
	const struct config *cfg;
	struct platform platform;
	struct exchange *exchange;
	const struct exchange_plan *plan;
	const struct slave_info *slaves;
	size_t slave_count;
	const struct channel *channels;
	size_t channel_count;
	struct ring *samples;
	struct ring *events;
	struct cycle_stats *stats;
	struct board *boards[CYCLE_WRITERS]; /* NULL: no such writer */
	struct control *control;             /* the control program; NULL: none */
};

#endif
