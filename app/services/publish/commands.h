/* SPDX-License-Identifier: MIT */
/*
 * ecdaq/command -> checks (publish/gate.h) -> remote board -> ecdaq/reply. One command travels at a
 * time, so that its answer names the very cycle whose frame carried it. While a commander lives,
 * the board beats; when it is lost, what it set is taken back. Context: the publisher's thread.
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
/** Takes back what was set. */
void commands_destroy(struct commands *commands);

/** To be given to topics_open(): it hears of commanders that come and go. Delete it afterwards. */
dds_listener_t *commands_listener(struct commands *commands);

/** Follow the master's board through restarts. */
void commands_follow(struct commands *commands);

/** One step. @view: how the master is now. 1 while a command is on its way, else 0. */
int commands_step(struct commands *commands, const struct topics *topics,
		  const struct gate_view *view);

struct commands_counts commands_counts(const struct commands *commands);

#endif
