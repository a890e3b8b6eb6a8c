/* SPDX-License-Identifier: MIT */
/*
 * The mailbox gateway's UDP and TCP sockets, at one address and port. Everything is bounded, and
 * nothing waits for a client: one that sends no whole message, does not take its answers or sends
 * what is no message is disconnected; one whose mails wait is not read. Context: service thread.
 */
#ifndef NETWORK_GATEWAY_SOCKETS_H
#define NETWORK_GATEWAY_SOCKETS_H

#include "network/gateway.h"

struct gateway_sockets;

/**
 * Listen at @address (AF_INET or AF_INET6). 0 or -errno with one line in @error, without the name
 * of the option. Free with gateway_sockets_destroy(). Context: blocking.
 */
int gateway_sockets_create(const struct sockaddr *address, socklen_t address_bytes,
			   struct gateway_sockets **ret_sockets, char *error, size_t error_bytes);
void gateway_sockets_destroy(struct gateway_sockets *gs);

/** A descriptor that polls readable when there is something to do. */
int gateway_sockets_fd(const struct gateway_sockets *gs);
struct gateway *gateway_sockets_gateway(struct gateway_sockets *gs);

/** One pass: connections, mails and answers; never waits. */
void gateway_sockets_service(struct gateway_sockets *gs, const struct gateway_bus *bus, mono_t now);
/** 1: call it again soon, whatever the descriptor says. */
int gateway_sockets_is_busy(const struct gateway_sockets *gs);

#endif
