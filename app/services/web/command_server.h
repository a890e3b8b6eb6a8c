/* SPDX-License-Identifier: MIT */
/*
 * The sockets of ecdaq-web-command (base/web_command.h): log-in, sessions, commands, tokens.
 * Connections, what each may wait for, and commands at a time are bounded; no client delays
 * another. Context: one thread.
 */
#ifndef WEB_COMMAND_SERVER_H
#define WEB_COMMAND_SERVER_H

#include <stddef.h>

#include "config/config.h"

struct command_server;

/** Listen in the run directory of @cfg, which is kept by the caller; @report gets one line for each
 * log-in and command. 0 or -errno with the reason in @error. Free with command_server_destroy(). */
int command_server_create(const struct config *cfg, void (*report)(const char *line),
			  struct command_server **ret_server, char *error, size_t error_bytes);
void command_server_destroy(struct command_server *server);
/** Serve until something happened, 100 ms at most. 0 or -errno. */
int command_server_step(struct command_server *server);

#endif
