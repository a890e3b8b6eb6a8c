/* SPDX-License-Identifier: MIT */
#include "config/gateway.h"

#include <arpa/inet.h>
#include <errno.h>
#include <string.h>

static int find_address(const char *listen, uint32_t number, struct sockaddr_in6 *ret,
			socklen_t *ret_bytes)
{
	const char *address = strcmp(listen, "loopback") == 0 ? "127.0.0.1" : listen;
	uint16_t port = htons((uint16_t)number);
	struct sockaddr_in ip4 = { .sin_family = AF_INET, .sin_port = port };
	struct sockaddr_in6 ip6 = { .sin6_family = AF_INET6, .sin6_port = port };

	if (inet_pton(AF_INET, address, &ip4.sin_addr) == 1) {
		memset(ret, 0, sizeof(*ret));
		memcpy(ret, &ip4, sizeof(ip4));
		*ret_bytes = sizeof(ip4);
		return 1;
	}
	if (inet_pton(AF_INET6, address, &ip6.sin6_addr) == 1) {
		*ret = ip6;
		*ret_bytes = sizeof(ip6);
		return 1;
	}
	return -EINVAL;
}

int config_gateway_address(const struct config *cfg, struct sockaddr_in6 *ret, socklen_t *ret_bytes)
{
	if (strcmp(cfg->gateway_listen, "off") == 0) {
		return 0;
	}
	return find_address(cfg->gateway_listen, cfg->gateway_port, ret, ret_bytes);
}

int config_web_address(const struct config *cfg, struct sockaddr_in6 *ret, socklen_t *ret_bytes)
{
	return find_address(cfg->web_listen, cfg->web_port, ret, ret_bytes);
}

int config_web_is_loopback(const struct config *cfg)
{
	struct sockaddr_in6 ip6;
	struct sockaddr_in ip4;
	socklen_t bytes;

	if (config_web_address(cfg, &ip6, &bytes) < 0) {
		return 0;
	}
	memcpy(&ip4, &ip6, sizeof(ip4));
	return ip4.sin_family == AF_INET ? ntohl(ip4.sin_addr.s_addr) >> 24 == 127
					 : IN6_IS_ADDR_LOOPBACK(&ip6.sin6_addr);
}
