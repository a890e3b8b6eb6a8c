/* SPDX-License-Identifier: MIT */
/* ecdaq events */
#include <errno.h>
#include <fnmatch.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "base/args.h"
#include "base/clock.h"
#include "base/event.h"
#include "cli/cli.h"
#include "cli/fit.h"
#include "cli/screen.h"
#include "cli/source.h"
#include "cli/text.h"
#include "program/event_text.h"
#include "program/json.h"
#include "reader/feed.h"
#include "reader/reader.h"

/* Terminals of fewer columns show no date. */
enum { DATE_COLUMNS = 100 };
/* So long after one that repeats, the next is no repetition. */
#define FOLLOW_QUIET_NS (10 * NS_PER_S)

struct events {
	struct cli *cli;
	struct feed *feed;
	struct feed *sync0;   /* of ecdaq-sync0 */
	struct event waiting; /* read from it, and not older than what was printed */
	int has_waiting;
	int is_json;
	int is_follow;
	int is_unfolded; /* --all */
	const char *level;
	enum event_severity severity; /* this and worse */
	const char *slave;            /* --slave; NULL: all, and what is of none */
	uint16_t slave_pos;
	const char *kind; /* --kind: names and patterns, separated by commas; NULL: all */
	const struct status_page *page; /* for names; NULL: none can be read */
	struct event_fold fold;
	int64_t shown_mono_ns; /* of the newest event of a kind that is folded */
	int is_live;           /* what was there at the start is shown */
	uint64_t count;        /* the last so many; 0: all */
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

static void json_name(struct json *js, const struct events *events, uint16_t pos)
{
	struct slave_info info;

	if (events->page == NULL || pos >= source_slave_count(events->page)) {
		json_null(js, "name");
		return;
	}
	info = source_slave(events->page, pos);
	json_text(js, "name", info.name);
}

static void print_json(const struct events *events, const struct event *ev, const char *text)
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
	json_name(&js, events, ev->slave_pos);
	json_i64(&js, "value", ev->value);
	json_array_begin(&js, "arg");
	json_i64(&js, NULL, ev->arg[0]);
	json_i64(&js, NULL, ev->arg[1]);
	json_array_end(&js);
	json_text(&js, "text", text);
	json_object_end(&js);
	json_end_line(&js);
}

/* On a terminal, @text continues below its beginning, and narrow ones have the time only. */
static void print_text(int64_t utc_ns, enum event_severity severity, const char *text)
{
	static const enum screen_colour colours[] = {
		[EVENT_INFO] = SCREEN_PLAIN,
		[EVENT_NOTICE] = SCREEN_BOLD,
		[EVENT_WARNING] = SCREEN_WARN,
		[EVENT_ERROR] = SCREEN_BAD,
	};
	int columns = screen_columns();
	char buf[TEXT_BYTES];
	const char *utc = text_utc(utc_ns, buf);
	const char *time = strchr(utc, 'T');
	char *lines = NULL;
	size_t len = 0;
	FILE *out = open_memstream(&lines, &len);
	int indent;

	if (out == NULL) {
		return;
	}
	utc = columns > 0 && columns < DATE_COLUMNS && time != NULL ? time + 1 : utc;
	indent = (int)strlen(utc) + 11;
	printf("%s  %s%-7s%s  ", utc, screen_colour(colours[severity]),
	       event_severity_to_str(severity), screen_colour(SCREEN_PLAIN));
	fit_write(text, columns == 0 ? 0 : columns > indent + 10 ? columns - indent : 10, 0, out);
	if (fclose(out) == 0) {
		lines[strcspn(lines, "\n") == len ? len : len - 1] = '\0';
		for (char *line = lines; line != NULL;) {
			char *rest = strchr(line, '\n');

			printf("%*s%.*s\n", line == lines ? 0 : indent, "",
			       rest == NULL ? (int)strlen(line) : (int)(rest - line), line);
			line = rest == NULL ? NULL : rest + 1;
		}
	}
	free(lines);
}

/* Print what is folded, and begin anew. */
static void flush_fold(struct events *events)
{
	struct event_fold *fold = &events->fold;
	char text[EVENT_TEXT_BYTES];

	if (fold->total > 0) {
		event_fold_text(fold, events->page, text);
		print_text(utc_of(&fold->first), event_fold_severity(fold), text);
	}
	fold->total = 0;
}

static void print_folded(struct events *events, const struct event *ev)
{
	char text[EVENT_TEXT_BYTES];

	if (!events->is_unfolded && event_fold_is_for(ev)) {
		/* The first one of a live view is shown at once, those after it in one line. */
		int is_first = events->is_live && events->fold.total == 0 &&
			       ev->mono_ns - events->shown_mono_ns > FOLLOW_QUIET_NS;

		events->shown_mono_ns = ev->mono_ns;
		if (!is_first) {
			if (!event_fold_add(&events->fold, ev)) {
				flush_fold(events);
				event_fold_add(&events->fold, ev);
			}
			return;
		}
	} else {
		flush_fold(events);
	}
	event_text(ev, events->page, text);
	print_text(utc_of(ev), event_severity(ev->id), text);
}

/* Does one of the names and patterns in @kinds, which commas separate, match @name? */
static int matches(const char *kinds, const char *name)
{
	while (*kinds != '\0') {
		char kind[64];
		size_t len = strcspn(kinds, ",");

		snprintf(kind, sizeof(kind), "%.*s", (int)len, kinds);
		if (fnmatch(kind, name, 0) == 0) {
			return 1;
		}
		kinds += len + (kinds[len] == ',');
	}
	return 0;
}

/* Names of slaves change with the bus. */
static void read_page(struct events *events)
{
	source_status_close(events->page);
	events->page = NULL;
	(void)source_try_status(events->cli, &events->page);
}

static void print(struct events *events, const struct event *ev)
{
	char text[EVENT_TEXT_BYTES];

	if (events->is_live && (ev->id == EVENT_BUS_STATE || ev->id == EVENT_STARTED)) {
		read_page(events);
	}
	if (event_severity(ev->id) < events->severity ||
	    (events->slave != NULL && ev->slave_pos != events->slave_pos) ||
	    (events->kind != NULL && !matches(events->kind, event_name(ev->id)))) {
		return;
	}
	if (events->is_json) {
		/* Without the name, which has a field of its own. */
		event_format(ev, text, sizeof(text));
		print_json(events, ev, text);
	} else {
		print_folded(events, ev);
	}
}

static void print_lost(struct events *events, uint64_t lost)
{
	struct json js;

	if (!events->is_json) {
		flush_fold(events);
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
		if (!events->is_live ||
		    event_fold_is_over(&events->fold, clock_ns(CLOCK_MONOTONIC))) {
			flush_fold(events);
		}
		if (feed_is_over(events->feed)) {
			flush_fold(events);
			return feed_open(events->feed, NULL) == -EIO
				       ? cli_fail(events->cli, EXIT_CODE_FAILED, "events: %s",
						  reader_error_to_str(-EIO))
				       : EXIT_CODE_OK;
		}
		if (!events->is_follow) {
			return EXIT_CODE_OK;
		}
		fflush(stdout);
		events->is_live = 1;
		/* It may not have been started yet, or started again. */
		(void)feed_open(events->sync0, NULL);
		screen_wait(20 * NS_PER_MS);
		if (screen_is_over() || ferror(stdout)) {
			flush_fold(events);
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
	if (events->level == NULL || event_severity_parse(events->level, &events->severity) == 0) {
		return EXIT_CODE_OK;
	}
	return cli_fail(events->cli, EXIT_CODE_USAGE,
			"--level: %s: expected info, notice, warning or error", events->level);
}

static enum exit_code parse_kind(const struct events *events)
{
	if (events->kind == NULL) {
		return EXIT_CODE_OK;
	}
	for (uint16_t id = EVENT_NONE + 1; id < EVENT_COUNT; id++) {
		if (matches(events->kind, event_name(id))) {
			return EXIT_CODE_OK;
		}
	}
	return cli_fail(events->cli, EXIT_CODE_USAGE,
			"--kind: %s: no such event; names are those of --json, * and ? match",
			events->kind);
}

enum exit_code verb_events(struct cli *cli, int argc, char **argv)
{
	struct events events = { .cli = cli };
	const struct args_option options[] = {
		{ "follow", 'f', args_flag, &events.is_follow, NULL, "continue with new events" },
		{ "count", 'n', args_count, &events.count, "N", "start with the last N" },
		{ "level", 'l', args_text, &events.level, "LEVEL",
		  "info, notice, warning or error: minimum severity" },
		{ "slave", 0, args_text, &events.slave, "SLAVE", "only events of this slave" },
		{ "kind", 0, args_text, &events.kind, "KIND,...",
		  "only these: frame_lost, 'sync0_*'" },
		{ "all", 0, args_flag, &events.is_unfolded, NULL,
		  "one line per event, also of those that repeat" },
		{ "json", 0, args_flag, &events.is_json, NULL, "one JSON object per event" },
	};
	struct args args = { .options = options,
			     .option_count = sizeof(options) / sizeof(options[0]) };
	enum exit_code result;

	if (!cli_parse(cli, &args, argc, argv, &result)) {
		return result;
	}
	result = parse_level(&events);
	result = result == EXIT_CODE_OK ? parse_kind(&events) : result;
	if (result == EXIT_CODE_OK && events.slave != NULL) {
		result = source_slave_pos(cli, events.slave, &events.slave_pos);
	}
	if (result != EXIT_CODE_OK) {
		return result;
	}
	result = open_feeds(&events);
	if (result == EXIT_CODE_OK) {
		read_page(&events);
		screen_catch_signals();
		result = run(&events);
		source_status_close(events.page);
	}
	feed_destroy(events.feed);
	feed_destroy(events.sync0);
	return result;
}
