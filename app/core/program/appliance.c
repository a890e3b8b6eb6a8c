/* SPDX-License-Identifier: MIT */
#include "program/appliance.h"

#include <errno.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "config/config.h"

int appliance_name(const char *configured, char ret_name[APPLIANCE_BYTES])
{
	char host[APPLIANCE_BYTES];
	const char *name = configured;

	if (name[0] == '\0') {
		if (gethostname(host, sizeof(host)) < 0) {
			return -EINVAL;
		}
		host[sizeof(host) - 1] = '\0';
		name = host;
	}
	snprintf(ret_name, APPLIANCE_BYTES, "%.*s", (int)strcspn(name, "."), name);
	return ret_name[0] != '\0' && strspn(ret_name, CONFIG_TOKEN) == strlen(ret_name) ? 0
											 : -EINVAL;
}
