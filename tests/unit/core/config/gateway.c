/* SPDX-License-Identifier: MIT */
#include "config/gateway.h"

#include <arpa/inet.h>
#include <errno.h>

#include "harness/test.h"

static int address_of(const char *listen, struct sockaddr_in6 *ret, socklen_t *ret_bytes)
{
	static struct config cfg;

	config_defaults(&cfg);
	snprintf(cfg.gateway_listen, sizeof(cfg.gateway_listen), "%s", listen);
	return config_gateway_address(&cfg, ret, ret_bytes);
}

TEST(config, the_gateway_is_off_by_default)
{
	static struct config cfg;
	struct sockaddr_in6 address;
	socklen_t bytes = 0;

	config_defaults(&cfg);
	CHECK_EQ(config_gateway_address(&cfg, &address, &bytes), 0);
}

TEST(config, the_gateway_listens_at_loopback_or_at_the_address_that_is_written_out)
{
	static const struct {
		const char *listen;
		const char *address;
	} of[] = { { "loopback", "127.0.0.1" }, { "192.168.3.4", "192.168.3.4" } };
	struct sockaddr_in6 address;
	socklen_t bytes = 0;
	char text[64];

	for (size_t i = 0; i < sizeof(of) / sizeof(of[0]); i++) {
		struct sockaddr_in ip4;

		CHECK_EQ(address_of(of[i].listen, &address, &bytes), 1);
		CHECK_EQ(bytes, sizeof(ip4));
		memcpy(&ip4, &address, sizeof(ip4));
		CHECK_EQ(ntohs(ip4.sin_port), 34980);
		CHECK_STR(inet_ntop(AF_INET, &ip4.sin_addr, text, sizeof(text)), of[i].address);
	}
	CHECK_EQ(address_of("fd00::7", &address, &bytes), 1);
	CHECK_EQ(bytes, sizeof(address));
	CHECK_STR(inet_ntop(AF_INET6, &address.sin6_addr, text, sizeof(text)), "fd00::7");
}

TEST(config, a_gateway_address_that_is_none_is_an_error_of_the_option)
{
	static struct config cfg;
	struct sockaddr_in6 address;
	socklen_t bytes = 0;
	char error[256] = "";

	CHECK_EQ(address_of("on", &address, &bytes), -EINVAL);
	CHECK_EQ(address_of("", &address, &bytes), -EINVAL);
	config_defaults(&cfg);
	CHECK_EQ(config_set(&cfg, "gateway.listen=localhost", error, sizeof(error)), 0);
	CHECK_EQ(config_check(&cfg, error, sizeof(error)), -EINVAL);
	CHECK_STR(error, "gateway.listen: expected off, loopback, or an IPv4 or IPv6 address");
}

TEST(config, the_interface_of_the_segment_is_not_for_eoe)
{
	static struct config cfg;
	char error[256] = "";

	config_defaults(&cfg);
	CHECK_EQ(config_set(&cfg, "bus.interface=eth1", error, sizeof(error)), 0);
	CHECK_EQ(config_set(&cfg, "eoe.interface=eth1", error, sizeof(error)), 0);
	CHECK_EQ(config_check(&cfg, error, sizeof(error)), -EINVAL);
	CHECK_STR(error, "eoe.interface: is bus.interface, which is for EtherCAT alone");
}
