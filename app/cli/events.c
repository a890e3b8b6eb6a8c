/* SPDX-License-Identifier: MIT */
/* ecdaq events */
#include <errno.h>
#include <inttypes.h>
#include <stdio.h>
#include <string.h>
#include <time.h>

#include "base/args.h"
#include "base/clock.h"
#include "base/event.h"
#include "cli/cli.h"
#include "cli/screen.h"
#include "cli/source.h"
#include "cli/text.h"
#include "program/json.h"
#include "reader/feed.h"
#include "reader/reader.h"

struct events {
	struct cli *cli;
	struct feed *feed;
	struct feed *sync0;   /* of ecdaq-sync0 */
	struct event waiting; /* read from it, and not older than what was printed */
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
	for (;;) {
		uint64_t lost = 0;

		if (!events->has_waiting) {
			events->has_waiting = feed_read(events->sync0, &events->waiting,
							sizeof(events->waiting), NULL, &lost);
		}
		if (lost > 0) {
			print_lost(events, lost);
		}
		if (!events->has_waiting) {
			return;
		}
		if (events->waiting.mono_ns >= mono_ns) {
			return;
		}
		events->has_waiting = 0;
		print(events, &events->waiting);
	}
}

static enum exit_code run(struct events *events)
{
	for (;;) {
		uint64_t lost = 0;
		struct event ev;
		int got = feed_read(events->feed, &ev, sizeof(ev), NULL, &lost);

		if (lost > 0) {
			print_lost(events, lost);
		}
		if (got) {
			print_sync0_until(events, ev.mono_ns);
			print(events, &ev);
			continue;
		}
		print_sync0_until(events, INT64_MAX);
		if (feed_is_over(events->feed)) {
			return feed_open(events->feed, NULL) == -EIO
				       ? cli_fail(events->cli, EXIT_CODE_FAILED, "events: %s",
						  reader_error_to_str(-EIO))
				       : EXIT_CODE_OK;
		}
		if (!events->is_follow) {
			return EXIT_CODE_OK;
		}
		fflush(stdout);
		/* It may not have been started yet, or started again. */
		(void)feed_open(events->sync0, NULL);
		screen_wait(20 * NS_PER_MS);
		if (screen_is_over() || ferror(stdout)) {
			return EXIT_CODE_OK;
		}
	}
}

static enum exit_code open_feeds(struct events *events)
{
	char path[CONFIG_PATH_BYTES];
	char sync0_path[CONFIG_PATH_BYTES];
	enum exit_code result = cli_path(events->cli, CONFIG_RUN_EVENTS, path);
	int r;

	result = result != EXIT_CODE_OK
			 ? result
			 : cli_path(events->cli, CONFIG_RUN_SYNC0_EVENTS, sync0_path);
	if (result != EXIT_CODE_OK) {
		return result;
	}
	events->feed = feed_create(FEED_EVENTS, path, FEED_AT_OLDEST);
	events->sync0 = feed_create(FEED_EVENTS, sync0_path, FEED_AT_OLDEST);
	r = events->feed == NULL || events->sync0 == NULL ? -ENOMEM : feed_open(events->feed, NULL);
	if (r < 0) {
		return source_fail_open(events->cli, path, -r);
	}
	feed_seek_back(events->feed, events->count);
	(void)feed_open(events->sync0, NULL);
	feed_seek_back(events->sync0, events->count);
	return EXIT_CODE_OK;
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

	if (!cli_parse(cli, &args, argc, argv, &result)) {
		return result;
	}
	result = parse_level(&events);
	if (result != EXIT_CODE_OK) {
		return result;
	}
	result = open_feeds(&events);
	if (result == EXIT_CODE_OK) {
		screen_catch_signals();
		result = run(&events);
	}
	feed_destroy(events.feed);
	feed_destroy(events.sync0);
	return result;
}
