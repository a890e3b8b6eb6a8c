/* SPDX-License-Identifier: MIT */
/*
 * The server of ecdaq-web: HTTP and WebSocket on one port, by libwebsockets, in one thread. What
 * clients do is bounded: their number, the time to send a request, its size, the rate of requests.
 * Context: one thread.
 */
#ifndef WEB_SERVER_H
#define WEB_SERVER_H

#include <stddef.h>

#include "config/config.h"

struct server;

/** Listen as the options of section web say; @cfg is kept by the caller, @report gets one line for
 * each thing that an operator should know. 0; -EADDRINUSE, -EADDRNOTAVAIL, ...: cannot listen;
 * -ENOMEM. @error gets the reason. Free with server_destroy(). */
int server_create(const struct config *cfg, void (*report)(const char *line),
		  struct server **ret_server, char *error, size_t error_bytes);
void server_destroy(struct server *server);

/** Serve until something happened, 100 ms at most. 0, or a negative errno: no more. */
int server_step(struct server *server);

#endif
