/* SPDX-License-Identifier: MIT */
#include "web/origin.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <stdio.h>
#include <string.h>
#include <strings.h>

enum { NAME_BYTES = 256 };

/* The host of "host:port", "[::1]:port", to @ret. 0: too long, or no such form. */
static int host_of(const char *text, char ret[NAME_BYTES])
{
	size_t skip = text[0] == '[';
	size_t len = strcspn(text + skip, skip ? "]" : ":");
	const char *rest = text + skip + len;

	if (len == 0 || len >= NAME_BYTES || (skip && *rest++ != ']')) {
		return 0;
	}
	if (*rest != '\0' && (*rest != ':' || rest[1 + strspn(rest + 1, "0123456789")] != '\0')) {
		return 0;
	}
	memcpy(ret, text + skip, len);
	ret[len] = '\0';
	return 1;
}

static int is_address(const char *host)
{
	struct in6_addr address;

	return inet_pton(AF_INET, host, &address) == 1 || inet_pton(AF_INET6, host, &address) == 1;
}

static int is_in_list(const char *text, const char *list)
{
	size_t len = strlen(text);

	while (*list != '\0') {
		size_t n = strcspn(list, ", ");

		if (n == len && n > 0 && strncasecmp(text, list, n) == 0) {
			return 1;
		}
		list += n;
		list += strspn(list, ", ");
	}
	return 0;
}

static int is_own_name(const char *host, const char *own_name)
{
	size_t len = strlen(own_name);

	return len > 0 && strncasecmp(host, own_name, len) == 0 &&
	       (host[len] == '\0' || strcasecmp(host + len, ".local") == 0);
}

int origin_host_is_ours(const char *host, const char *own_name, const char *names)
{
	char name[NAME_BYTES];

	return host_of(host, name) && (is_address(name) || strcasecmp(name, "localhost") == 0 ||
				       is_own_name(name, own_name) || is_in_list(name, names));
}

int origin_is_allowed(const char *origin, const char *host, const char *origins)
{
	static const char *const schemes[] = { "http://", "https://" };

	if (origin[0] == '\0' || is_in_list(origin, origins)) {
		return 1;
	}
	for (size_t i = 0; i < sizeof(schemes) / sizeof(schemes[0]); i++) {
		size_t len = strlen(schemes[i]);

		if (strncmp(origin, schemes[i], len) == 0 && strcasecmp(origin + len, host) == 0) {
			return 1;
		}
	}
	return 0;
}
