/* SPDX-License-Identifier: MIT */
#include "link/port_use.h"

#include <arpa/inet.h>
#include <errno.h>
#include <ifaddrs.h>
#include <net/route.h>
#include <netinet/in.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>

enum { ROUTE_LINE_BYTES = 256, ROUTE_WORDS = 11 };

/* The address as text: 1; 0 if it does not count. */
static int address_to_str(const struct sockaddr *address, char text[INET6_ADDRSTRLEN])
{
	struct sockaddr_in v4;
	struct sockaddr_in6 v6;

	switch (address->sa_family) {
	case AF_INET:
		memcpy(&v4, address, sizeof(v4));
		return inet_ntop(AF_INET, &v4.sin_addr, text, INET6_ADDRSTRLEN) != NULL;
	case AF_INET6:
		memcpy(&v6, address, sizeof(v6));
		return !IN6_IS_ADDR_LINKLOCAL(&v6.sin6_addr) &&
		       inet_ntop(AF_INET6, &v6.sin6_addr, text, INET6_ADDRSTRLEN) != NULL;
	default:
		return 0;
	}
}

static int has_address(const char *interface, char text[INET6_ADDRSTRLEN])
{
	struct ifaddrs *all;
	int found = 0;

	if (getifaddrs(&all) < 0) {
		return -errno;
	}
	for (const struct ifaddrs *a = all; a != NULL && !found; a = a->ifa_next) {
		if (a->ifa_addr != NULL && strcmp(a->ifa_name, interface) == 0) {
			found = address_to_str(a->ifa_addr, text);
		}
	}
	freeifaddrs(all);
	return found;
}

/* Cut @line into words: how many. */
static size_t split(char *line, char *words[ROUTE_WORDS])
{
	char *rest = NULL;
	size_t count = 0;

	for (char *word = strtok_r(line, " \t\n", &rest); word != NULL && count < ROUTE_WORDS;
	     word = strtok_r(NULL, " \t\n", &rest)) {
		words[count++] = word;
	}
	return count;
}

static int is_zero(const char *digits)
{
	return digits[strspn(digits, "0")] == '\0';
}

int port_use_route(FILE *file, const char *interface)
{
	char line[ROUTE_LINE_BYTES];
	char *words[ROUTE_WORDS];

	/* Iface Destination Gateway Flags RefCnt Use Metric Mask ...; a heading first. */
	while (fgets(line, sizeof(line), file) != NULL) {
		if (split(line, words) > 7 && strcmp(words[0], interface) == 0 &&
		    is_zero(words[1]) && is_zero(words[7]) &&
		    (strtoul(words[3], NULL, 16) & RTF_UP) != 0) {
			return 1;
		}
	}
	return 0;
}

int port_use_route6(FILE *file, const char *interface)
{
	char line[ROUTE_LINE_BYTES];
	char *words[ROUTE_WORDS];

	/* Destination, its prefix, source, its prefix, next hop, metric, references, use, flags,
	 * interface. */
	while (fgets(line, sizeof(line), file) != NULL) {
		if (split(line, words) == 10 && strcmp(words[9], interface) == 0 &&
		    is_zero(words[0]) && is_zero(words[1]) &&
		    (strtoul(words[8], NULL, 16) & (RTF_UP | RTF_REJECT)) == RTF_UP) {
			return 1;
		}
	}
	return 0;
}

static int has_default_route(const char *interface, const char *path,
			     int (*find)(FILE *file, const char *interface))
{
	FILE *file = fopen(path, "re");
	int found;

	if (file == NULL) {
		return errno == ENOENT ? 0 : -errno; /* a kernel without that protocol */
	}
	found = find(file, interface);
	fclose(file);
	return found;
}

int port_use(const char *interface, char *reason, size_t reason_bytes)
{
	char address[INET6_ADDRSTRLEN];
	int r = has_address(interface, address);

	if (r > 0) {
		snprintf(reason, reason_bytes, "it has the IP address %s", address);
		return 1;
	}
	if (r == 0) {
		r = has_default_route(interface, "/proc/net/route", port_use_route);
	}
	if (r == 0) {
		r = has_default_route(interface, "/proc/net/ipv6_route", port_use_route6);
	}
	if (r > 0) {
		snprintf(reason, reason_bytes, "the default route goes through it");
	}
	return r;
}
