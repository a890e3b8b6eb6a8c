/* SPDX-License-Identifier: MIT */
/* Addresses are those of loopback in a network namespace of the test's own; routes are texts. */
#include "link/port_use.h"

#include <net/if.h>
#include <sched.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include "harness/test.h"

static int find(int (*in)(FILE *file, const char *interface), const char *text,
		const char *interface)
{
	char copy[1024];
	FILE *file;
	int r;

	snprintf(copy, sizeof(copy), "%s", text);
	file = fmemopen(copy, strlen(copy), "r");
	CHECK(file != NULL);
	r = in(file, interface);
	fclose(file);
	return r;
}

static const char routes[] =
	"Iface\tDestination\tGateway \tFlags\tRefCnt\tUse\tMetric\tMask\t\tMTU\tWindow\tIRTT\n"
	"eth0\t00000000\t0100A8C0\t0003\t0\t0\t100\t00000000\t0\t0\t0\n"
	"eth1\t0000A8C0\t00000000\t0001\t0\t0\t100\t00FFFFFF\t0\t0\t0\n"
	"eth2\t00000000\t00000000\t0000\t0\t0\t0\t00000000\t0\t0\t0\n";

TEST(port_use, only_the_interface_of_the_default_route_has_it)
{
	CHECK_EQ(find(port_use_route, routes, "eth0"), 1);
	CHECK_EQ(find(port_use_route, routes, "eth1"), 0);
	CHECK_EQ(find(port_use_route, routes, "eth2"), 0); /* not up */
	CHECK_EQ(find(port_use_route, routes, "eth"), 0);
	CHECK_EQ(find(port_use_route, routes, "Iface"), 0);
}

#define ZERO "00000000000000000000000000000000"
static const char routes6[] =
	ZERO " 00 " ZERO
	     " 00 fe800000000000000000000000000001 00000400 00000001 00000000 00000003     eth0\n"
	     "fe800000000000000000000000000000 40 " ZERO " 00 " ZERO
	     " 00000100 00000001 00000000 00000001     eth1\n" ZERO " 00 " ZERO " 00 " ZERO
	     " ffffffff 00000001 00000000 00200200       lo\n";

TEST(port_use, a_route_that_rejects_is_no_default_route)
{
	CHECK_EQ(find(port_use_route6, routes6, "eth0"), 1);
	CHECK_EQ(find(port_use_route6, routes6, "eth1"), 0);
	CHECK_EQ(find(port_use_route6, routes6, "lo"), 0);
}

TEST(port_use, text_that_is_no_table_has_no_route)
{
	CHECK_EQ(find(port_use_route, "eth0\n\neth0 00000000\neth0 x x x x x x x\n", "eth0"), 0);
	CHECK_EQ(find(port_use_route6, "0\n00 00 00 00 eth0\n", "eth0"), 0);
}

TEST(port_use, an_interface_with_an_address_is_in_use_by_it)
{
	struct ifreq ifr = { .ifr_name = "lo", .ifr_flags = IFF_UP | IFF_LOOPBACK };
	char reason[PORT_USE_BYTES] = "";
	int fd;

	if (unshare(CLONE_NEWUSER | CLONE_NEWNET) < 0 && unshare(CLONE_NEWNET) < 0) {
		SKIP("no network namespaces here");
	}
	CHECK_EQ(port_use("lo", reason, sizeof(reason)), 0);
	CHECK_EQ(reason[0], '\0');
	fd = socket(AF_INET, SOCK_DGRAM, 0);
	CHECK(fd >= 0);
	CHECK_EQ(ioctl(fd, SIOCSIFFLAGS, &ifr), 0);
	close(fd);
	CHECK_EQ(port_use("lo", reason, sizeof(reason)), 1);
	CHECK(strstr(reason, "127.0.0.1") != NULL);
	CHECK_EQ(port_use("nosuchnic0", reason, sizeof(reason)), 0);
}
