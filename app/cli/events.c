/* SPDX-License-Identifier: MIT */
/* ecdaq events */
#include <errno.h>
#include <inttypes.h>
#include <stdio.h>
#include <string.h>
#include <time.h>

#include "base/clock.h"
#include "base/event.h"
#include "base/ring.h"
#include "cli/cli.h"
#include "cli/json.h"
#include "cli/screen.h"
#include "cli/text.h"
#include "program/args.h"

struct events {
	struct cli *cli;
	struct ring_reader *reader;
	struct ring_reader *sync0; /* that of ecdaq-sync0; NULL: none */
	struct event waiting;      /* read from it, and not older than what was printed */
	int has_waiting;
	int is_json;
	int is_follow;
	const char *level;
	enum event_severity severity; /* this and worse */
	uint64_t count;               /* the last so many; 0: all */
};

static int64_t clock_ns(clockid_t clock)
{
	struct timespec ts;

	clock_gettime(clock, &ts);
	return (int64_t)ts.tv_sec * NS_PER_S + ts.tv_nsec;
}

/* The event's place on today's wall clock: its age by the monotonic clock, which is never set. */
static int64_t utc_of(const struct event *ev)
{
	return clock_ns(CLOCK_REALTIME) - (clock_ns(CLOCK_MONOTONIC) - ev->mono_ns);
}

static void print_json(const struct event *ev, const char *text)
{
	struct json js;
	char utc[TEXT_BYTES];

	json_init(&js, stdout);
	json_object_begin(&js, NULL);
	json_text(&js, "event", event_name(ev->id));
	json_text(&js, "severity", event_severity_to_str(event_severity(ev->id)));
	json_text(&js, "utc", text_utc(utc_of(ev), utc));
	json_i64(&js, "mono_ns", ev->mono_ns);
	json_i64(&js, "tai_ns", ev->tai_ns);
	json_u64(&js, "cycle", ev->cycle);
	if (ev->slave_pos == EVENT_NO_SLAVE) {
		json_null(&js, "slave");
	} else {
		json_u64(&js, "slave", ev->slave_pos);
	}
	json_i64(&js, "value", ev->value);
	json_array_begin(&js, "arg");
	json_i64(&js, NULL, ev->arg[0]);
	json_i64(&js, NULL, ev->arg[1]);
	json_array_end(&js);
	json_text(&js, "text", text);
	json_object_end(&js);
	json_end_line(&js);
}

static void print(const struct events *events, const struct event *ev)
{
	char text[256];
	char utc[TEXT_BYTES];

	if (event_severity(ev->id) < events->severity) {
		return;
	}
	event_format(ev, text, sizeof(text));
	if (events->is_json) {
		print_json(ev, text);
	} else {
		printf("%s  %-7s  %s\n", text_utc(utc_of(ev), utc),
		       event_severity_to_str(event_severity(ev->id)), text);
	}
}

static void print_lost(const struct events *events, uint64_t lost)
{
	struct json js;

	if (!events->is_json) {
		printf("# %" PRIu64 " events were overwritten before they could be read\n", lost);
		return;
	}
	json_init(&js, stdout);
	json_object_begin(&js, NULL);
	json_u64(&js, "missed", lost);
	json_object_end(&js);
	json_end_line(&js);
}

/* Merge both rings: print the events of ecdaq-sync0 before @mono_ns. */
static void print_sync0_until(struct events *events, int64_t mono_ns)
{
	uint64_t lost = 0;

	while (events->sync0 != NULL) {
		if (!events->has_waiting) {
			switch (ring_read(events->sync0, &events->waiting, sizeof(events->waiting),
					  &lost)) {
			case RING_OK:
				events->has_waiting = 1;
				break;
			case RING_LOST:
				print_lost(events, lost);
				continue;
			case RING_EMPTY:
			case RING_CLOSED:
			case RING_DAMAGED:
				return;
			}
		}
		if (events->waiting.mono_ns >= mono_ns) {
			return;
		}
		events->has_waiting = 0;
		print(events, &events->waiting);
	}
}

/* It may not have been started, or anew: look again, as long as nothing of it is left to read. */
static void open_sync0(struct events *events)
{
	char path[CONFIG_PATH_BYTES];
	uint64_t oldest;

	if (events->sync0 != NULL) {
		if (events->has_waiting || !ring_is_replaced(events->sync0)) {
			return;
		}
		ring_reader_destroy(events->sync0);
		events->sync0 = NULL;
	}
	if (cli_path(events->cli, CONFIG_RUN_SYNC0_EVENTS, path) != EXIT_CODE_OK ||
	    ring_reader_open(path, &events->sync0) < 0) {
		events->sync0 = NULL;
		return;
	}
	if (strcmp(ring_kind(events->sync0), "event") != 0 ||
	    ring_payload_bytes(events->sync0) != sizeof(struct event)) {
		ring_reader_destroy(events->sync0);
		events->sync0 = NULL;
		return;
	}
	oldest = ring_oldest(events->sync0);
	if (events->count > 0 && ring_newest(events->sync0) - oldest > events->count) {
		oldest = ring_newest(events->sync0) - events->count;
	}
	ring_seek(events->sync0, oldest);
}

static enum exit_code run(struct events *events)
{
	uint64_t lost = 0;
	struct event ev;

	for (;;) {
		switch (ring_read(events->reader, &ev, sizeof(ev), &lost)) {
		case RING_OK:
			print_sync0_until(events, ev.mono_ns);
			print(events, &ev);
			break;
		case RING_LOST:
			print_lost(events, lost);
			break;
		case RING_EMPTY:
			print_sync0_until(events, INT64_MAX);
			if (!events->is_follow || ring_is_orphaned(events->reader)) {
				return EXIT_CODE_OK;
			}
			fflush(stdout);
			open_sync0(events);
			screen_wait(20 * NS_PER_MS);
			if (screen_is_over() || ferror(stdout)) {
				return EXIT_CODE_OK;
			}
			break;
		case RING_CLOSED:
		case RING_DAMAGED:
			print_sync0_until(events, INT64_MAX);
			return EXIT_CODE_OK;
		}
	}
}

static enum exit_code open_ring(struct events *events)
{
	char path[CONFIG_PATH_BYTES];
	enum exit_code result = cli_path(events->cli, CONFIG_RUN_EVENTS, path);
	int r;

	if (result != EXIT_CODE_OK) {
		return result;
	}
	r = ring_reader_open(path, &events->reader);
	if (r == -ENOENT || r == -ENOTDIR) {
		return cli_fail(events->cli, EXIT_CODE_NO_DAEMON,
				"events: %s is not there: is ecdaqd running?", path);
	}
	if (r == -EACCES || r == -EPERM) {
		return cli_fail(events->cli, EXIT_CODE_PERMISSION,
				"events: no permission to read %s: be root or in its group", path);
	}
	if (r == 0 && (strcmp(ring_kind(events->reader), "event") != 0 ||
		       ring_payload_bytes(events->reader) != sizeof(struct event))) {
		ring_reader_destroy(events->reader);
		r = -EPROTO;
	}
	if (r == -EPROTO) {
		return cli_fail(events->cli, EXIT_CODE_FAILED,
				"events: %s is of another version of ecdaq, or damaged", path);
	}
	return r < 0 ? cli_fail(events->cli, EXIT_CODE_FAILED, "events: %s: %s", path, strerror(-r))
		     : EXIT_CODE_OK;
}

static enum exit_code parse_level(struct events *events)
{
	if (events->level == NULL) {
		return EXIT_CODE_OK;
	}
	for (int level = EVENT_INFO; level <= EVENT_ERROR; level++) {
		if (strcmp(event_severity_to_str((enum event_severity)level), events->level) == 0) {
			events->severity = (enum event_severity)level;
			return EXIT_CODE_OK;
		}
	}
	return cli_fail(events->cli, EXIT_CODE_USAGE,
			"--level: %s: expected info, notice, warning or error", events->level);
}

enum exit_code verb_events(struct cli *cli, int argc, char **argv)
{
	struct events events = { .cli = cli };
	const struct args_option options[] = {
		{ "follow", 'f', args_flag, &events.is_follow, NULL, "continue with new events" },
		{ "count", 'n', args_count, &events.count, "N", "start with the last N" },
		{ "level", 'l', args_text, &events.level, "LEVEL",
		  "info, notice, warning or error: minimum severity" },
		{ "json", 0, args_flag, &events.is_json, NULL, "one JSON object per event" },
	};
	struct args args = { .options = options, .option_count = 4 };
	enum exit_code result;
	uint64_t oldest;

	if (!cli_parse(cli, &args, argc, argv, &result)) {
		return result;
	}
	result = parse_level(&events);
	if (result != EXIT_CODE_OK) {
		return result;
	}
	result = open_ring(&events);
	if (result != EXIT_CODE_OK) {
		return result;
	}
	oldest = ring_oldest(events.reader);
	if (events.count > 0 && ring_newest(events.reader) - oldest > events.count) {
		oldest = ring_newest(events.reader) - events.count;
	}
	ring_seek(events.reader, oldest);
	open_sync0(&events);
	screen_catch_signals();
	result = run(&events);
	ring_reader_destroy(events.reader);
	ring_reader_destroy(events.sync0);
	return result;
}
