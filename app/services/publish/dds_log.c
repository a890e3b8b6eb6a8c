/* SPDX-License-Identifier: MIT */
#include "publish/dds_log.h"

#include <inttypes.h>
#include <pthread.h>
#include <stdio.h>
#include <time.h>

#include "dds/ddsrt/log.h"

#include "base/host_clock.h"
#include "publish/log_limit.h"

enum { LINE_BYTES = 256 };

/* The library calls from all of its threads. */
static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;
static struct log_limit limit;

static void write_line(void *ctx, const dds_log_data_t *data)
{
	char line[LINE_BYTES];
	size_t len = 0;
	int is_allowed;

	(void)ctx;
	pthread_mutex_lock(&lock);
	is_allowed = log_limit_take(&limit, host_clock_ns(CLOCK_MONOTONIC));
	pthread_mutex_unlock(&lock);
	if (!is_allowed) {
		return;
	}
	for (; len < data->size && len < sizeof(line) - 1; len++) {
		char c = data->message[len];

		if (c == '\n' || c == '\0') {
			break;
		}
		line[len] = c;
		if (c < ' ' || c > '~') {
			line[len] = '?';
		}
	}
	line[len] = '\0';
	fprintf(stderr, "ecdaq-dds: DDS: %s%s\n", line, len == sizeof(line) - 1 ? "..." : "");
}

void dds_log_begin(void)
{
	dds_set_log_sink(write_line, NULL);
	/* The same function and argument: no line goes to both. */
	dds_set_trace_sink(write_line, NULL);
}

static void tell(uint64_t count)
{
	if (count > 0) {
		fprintf(stderr, "ecdaq-dds: DDS: %" PRIu64 " more lines suppressed\n", count);
	}
}

void dds_log_tell(void)
{
	uint64_t count;

	pthread_mutex_lock(&lock);
	count = log_limit_take_count(&limit, host_clock_ns(CLOCK_MONOTONIC));
	pthread_mutex_unlock(&lock);
	tell(count);
}

void dds_log_end(void)
{
	dds_set_log_sink(NULL, NULL);
	dds_set_trace_sink(NULL, NULL);
	tell(limit.suppressed); /* nobody else writes any more */
	limit.suppressed = 0;
}
