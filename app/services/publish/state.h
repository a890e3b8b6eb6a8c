/* SPDX-License-Identifier: MIT */
/*
 * The TRANSIENT_LOCAL topics, which late readers receive as well: ecdaq/channels, ecdaq/status,
 * ecdaq/timemap, ecdaq/idl. Context: publisher's thread.
 */
#ifndef PUBLISH_STATE_H
#define PUBLISH_STATE_H

#include "base/status.h"
#include "base/timemap.h"
#include "config/config.h"
#include "publish/commands.h"
#include "publish/sample_writer.h"
#include "publish/topics.h"
#include "reader/table.h"

struct state_view {
	const struct status_page *page;    /* NULL: none */
	const struct channel_table *table; /* NULL: no master runs */
	struct sample_counts samples;
	struct commands_counts commands;
};

void state_put_idl(const struct topics *topics);
/** 0 or -ENOMEM. */
int state_put_channels(const struct topics *topics, const struct config *cfg,
		       const struct channel_table *table);
void state_put_status(const struct topics *topics, const struct state_view *view);
void state_put_timemap(const struct topics *topics, uint64_t session,
		       const struct timemap_state *map);

#endif
