/* SPDX-License-Identifier: MIT */
#include "program/trouble.h"

#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "base/host_clock.h"

void trouble_init(struct trouble *t, void (*report)(const char *line), int64_t first_ns,
		  int64_t last_ns)
{
	*t = (struct trouble){
		.report = report, .first_ns = first_ns, .last_ns = last_ns, .backoff_ns = first_ns
	};
	t->prng.state = (uint64_t)host_clock_ns(CLOCK_MONOTONIC) ^ (uint64_t)getpid() << 32;
}

int trouble_is_due(const struct trouble *t)
{
	return host_clock_ns(CLOCK_MONOTONIC) >= t->due_ns;
}

void trouble_found(struct trouble *t, const char *problem)
{
	uint64_t half = (uint64_t)t->backoff_ns / 2;
	char line[TROUBLE_LINE_BYTES];

	snprintf(line, sizeof(line), "%s", problem);
	if (strcmp(line, t->reported) != 0) {
		memcpy(t->reported, line, sizeof(line));
		t->report(line);
	}
	t->due_ns = host_clock_ns(CLOCK_MONOTONIC) +
		    (int64_t)(half + prng_below(&t->prng, half > 0 ? half : 1));
	t->backoff_ns = 2 * t->backoff_ns > t->last_ns ? t->last_ns : 2 * t->backoff_ns;
}

int trouble_is_over(struct trouble *t)
{
	int was_there = t->reported[0] != '\0';

	t->reported[0] = '\0';
	t->backoff_ns = t->first_ns;
	return was_there;
}
