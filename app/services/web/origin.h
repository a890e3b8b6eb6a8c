/* SPDX-License-Identifier: MIT */
/*
 * Which requests are answered, by the headers Host and Origin. A page of a foreign site that makes
 * the browser connect to us has another Origin; one that lets its own name resolve to our address
 * (DNS rebinding) has a Host that is not ours. Context: any.
 */
#ifndef WEB_ORIGIN_H
#define WEB_ORIGIN_H

/**
 * 1 if @host (header Host, with or without port) is an IP address, localhost, @own_name, that with
 * ".local", or in @names (separated by commas or spaces).
 */
int origin_host_is_ours(const char *host, const char *own_name, const char *names);

/**
 * 1 if a WebSocket of @origin (header Origin; "": the client is no browser) may connect to @host:
 * it is http:// or https:// and that host, or in @origins (separated by commas or spaces).
 */
int origin_is_allowed(const char *origin, const char *host, const char *origins);

#endif
