/* SPDX-License-Identifier: MIT */
#include "cpu_list.h"

#include <stdlib.h>

int cpu_list_has(const char *list, int cpu)
{
	while (*list != '\0') {
		char *end;
		long first = strtol(list, &end, 10);
		long last = first;

		if (end == list) {
			return 0;
		}
		if (*end == '-') {
			last = strtol(end + 1, &end, 10);
		}
		if (cpu >= first && cpu <= last) {
			return 1;
		}
		list = *end == ',' ? end + 1 : "";
	}
	return 0;
}
