/* SPDX-License-Identifier: MIT */
/* ecdaq log list */
#include <errno.h>
#include <inttypes.h>
#include <limits.h>
#include <stdlib.h>
#include <string.h>

#include "program/json.h"
#include "record/log.h"
#include "record/log_common.h"
#include "record/mcap_reader.h"
#include "record/messages.h"
#include "record/store.h"

struct row {
	const char *name;
	const char *state;
	uint64_t bytes;
	uint64_t start_ns;
	uint64_t end_ns;
	uint64_t cycles;
};

/* From the summary: how many cycles, from when to when. */
static int ask_summary(const struct mcap_source *source, struct row *row)
{
	struct mcap_reader *reader;
	struct mcap_item item;
	int cycle_channel = -1;
	int r = mcap_reader_create_summary(source, &reader);

	if (r < 0) {
		return r;
	}
	while ((r = mcap_reader_next(reader, &item)) > 0) {
		if (item.kind == MCAP_ITEM_CHANNEL &&
		    mcap_text_is(item.name, messages_topic(MESSAGE_CYCLE))) {
			cycle_channel = item.id;
		} else if (item.kind == MCAP_ITEM_STATISTICS) {
			row->start_ns = item.log_time_ns;
			row->end_ns = item.publish_time_ns;
			row->cycles =
				cycle_channel < 0
					? 0
					: mcap_statistics_count(&item, (uint16_t)cycle_channel);
		}
	}
	mcap_reader_destroy(reader);
	return r;
}

/* Without one, all of it has to be read. */
static int ask_data(const struct mcap_source *source, struct row *row)
{
	struct track track;
	const struct mcap_visitor visitor = { .item = track_visit, .ctx = &track };
	struct mcap_scan *scan;
	int r;

	track_init(&track);
	r = mcap_scan_create(source, &visitor, &scan);
	if (r < 0) {
		return r;
	}
	mcap_scan_destroy(scan);
	row->start_ns = track.start_ns;
	row->end_ns = track.end_ns;
	row->cycles = track.cycles;
	return 0;
}

static void fill_row(const char *dir, const struct store_entry *e, int is_locked, struct row *row)
{
	struct log_file file;
	char path[PATH_MAX];
	int r;

	*row = (struct row){ .name = e->name, .bytes = e->bytes, .state = "unreadable" };
	if (store_path(dir, e->name, path, sizeof(path)) < 0 || log_file_open(path, &file) < 0) {
		return;
	}
	r = ask_summary(&file.source, row);
	if (r == 0) {
		row->state = e->is_part ? "unfinished" : "finished";
	} else {
		r = ask_data(&file.source, row);
		row->state = !e->is_part    ? "damaged"
			     : is_locked    ? "recording"
			     : r == -EPROTO ? "unreadable"
					    : "unfinished";
	}
	log_file_close(&file);
}

static void put_row(FILE *out, const struct row *row)
{
	char start[LOG_TIME_BYTES] = "-";
	double seconds = (double)(row->end_ns - row->start_ns) / 1e9;

	if (row->cycles > 0) {
		log_format_time(row->start_ns, start);
	}
	fprintf(out, "%-48s %-25s %10.3f s %10" PRIu64 " %9.3f MB  %s\n", row->name, start,
		row->end_ns >= row->start_ns ? seconds : 0.0, row->cycles, (double)row->bytes / 1e6,
		row->state);
}

static void put_json_row(FILE *out, const struct row *row)
{
	fprintf(out, "{\"file\":");
	json_put_text(out, row->name);
	fprintf(out,
		",\"state\":\"%s\",\"bytes\":%" PRIu64 ",\"start_ns\":%" PRIu64
		",\"end_ns\":%" PRIu64 ",\"cycles\":%" PRIu64 "}",
		row->state, row->bytes, row->start_ns, row->end_ns, row->cycles);
}

int log_list(const char *dir, enum log_format format, FILE *out, FILE *err)
{
	struct store_entry *entries;
	size_t count;
	int is_locked = store_is_locked(dir);
	int r = store_list(dir, &entries, &count);

	if (r < 0) {
		return log_fail(err, dir, strerror(-r));
	}
	if (format == LOG_JSON) {
		fprintf(out, "[");
	} else if (count > 0) {
		fprintf(out, "%-48s %-25s %12s %10s %12s  %s\n", "FILE", "START", "DURATION",
			"CYCLES", "SIZE", "STATE");
	}
	for (size_t i = 0; i < count; i++) {
		struct row row;

		fill_row(dir, &entries[i], is_locked, &row);
		if (format == LOG_JSON) {
			fputs(i > 0 ? "," : "", out);
			put_json_row(out, &row);
		} else {
			put_row(out, &row);
		}
	}
	if (format == LOG_JSON) {
		fprintf(out, "]\n");
	}
	free(entries);
	return log_finish_output(out, err);
}
