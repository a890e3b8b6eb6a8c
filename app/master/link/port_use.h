/* SPDX-License-Identifier: MIT */
/*
 * Whether a network interface belongs to somebody else: EtherCAT's frames are broadcast to whatever
 * is on the cable, and its port is flooded by them. A port that carries IP is taken for one of the
 * machine's network.
 */
#ifndef LINK_PORT_USE_H
#define LINK_PORT_USE_H

#include <stddef.h>
#include <stdio.h>

enum { PORT_USE_BYTES = 96 };

/**
 * 1 with the reason in @reason ("it has the IP address 10.0.0.5"), if @interface has an IPv4 or
 * IPv6 address or a default route; 0 if it has none, or does not exist; -errno if the kernel does
 * not answer. Link-local IPv6 addresses do not count: the kernel gives each port one. Context:
 * blocking, allocates.
 */
int port_use(const char *interface, char *reason, size_t reason_bytes);

/** 1 if @file, in the format of /proc/net/route, has a default route by @interface; else 0. */
int port_use_route(FILE *file, const char *interface);
/** The same for that of /proc/net/ipv6_route. */
int port_use_route6(FILE *file, const char *interface);

#endif
