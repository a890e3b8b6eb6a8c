/* SPDX-License-Identifier: MIT */
/* Where the mailbox gateway and ecdaq-web listen: gateway.listen and gateway.port, web.listen and
 * web.port. Context: any. */
#ifndef CONFIG_GATEWAY_H
#define CONFIG_GATEWAY_H

#include <netinet/in.h>
#include <sys/socket.h>

#include "config/config.h"

/**
 * 1 with the address in @ret (a struct sockaddr_in in it for IPv4) and its length; 0: off; -EINVAL:
 * gateway.listen is neither off, loopback nor an address.
 */
int config_gateway_address(const struct config *cfg, struct sockaddr_in6 *ret,
			   socklen_t *ret_bytes);

/** The same for ecdaq-web: 1; -EINVAL: web.listen is neither loopback nor an address. */
int config_web_address(const struct config *cfg, struct sockaddr_in6 *ret, socklen_t *ret_bytes);
/** Does ecdaq-web listen for programs of this machine only? */
int config_web_is_loopback(const struct config *cfg);

#endif
