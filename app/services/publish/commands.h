/* SPDX-License-Identifier: MIT */
/*
 * ecdaq/command -> checks (publish/gate.h) -> remote board -> ecdaq/reply. One command is pending
 * at a time, so that its reply names the cycle whose frame carried it. While an output is set by a
 * commander, the board gets a heartbeat; when the commander is lost, its outputs are reverted.
 * Context: the publisher's thread.
 */
#ifndef PUBLISH_COMMANDS_H
#define PUBLISH_COMMANDS_H

#include "config/config.h"
#include "publish/gate.h"
#include "publish/topics.h"

struct commands;

struct commands_counts {
	uint64_t accepted;
	uint64_t refused;
};

/** @cfg is kept by the caller. 0 or -errno. */
int commands_create(const struct config *cfg, struct commands **ret_commands);
/** Reverts all outputs that commanders set; the pending command is not answered. */
void commands_destroy(struct commands *commands);

/** The listener for topics_open(), notified when commanders appear and disappear. Caller deletes.
 */
dds_listener_t *commands_listener(struct commands *commands);

/** Open the master's board, again after a restart of the master. */
void commands_follow(struct commands *commands);

/** Process liveliness changes and commands. @view: the master now. 1 while a command is pending. */
int commands_step(struct commands *commands, const struct topics *topics,
		  const struct gate_view *view);

struct commands_counts commands_counts(const struct commands *commands);

#endif
