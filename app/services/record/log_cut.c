/* SPDX-License-Identifier: MIT */
/* ecdaq log cut */
#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <limits.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/host_clock.h"
#include "program/exit_code.h"
#include "program/progress.h"
#include "record/envelope.h"
#include "record/log.h"
#include "record/mcap_writer.h"
#include "record/messages.h"
#include "record/overview.h"
#include "record/recording.h"
#include "record/store.h"

enum {
	ZSTD_LEVEL = 1,
	PAIRS = 32,
	TEXTS = 2 * PAIRS,
	NUMBER_BYTES = 24,
	FILES_BYTES = 512,
	EVENTS_BEHIND = 4096, /* cycles: a recorder that catches up reads events now and then only
			       */
};

struct cut {
	const struct log_cut_options *options;
	FILE *err;
	uint64_t session;
	uint64_t behind; /* cycles behind the last one in which its events are looked for */
	struct mcap_writer *w;
	int fd;
	int is_begun;  /* something was written: a cycle was found */
	int is_inside; /* the newest cycle read is one of those asked for */
	int is_over;   /* nothing more is in what follows */
	int is_hopeless;
	uint64_t start; /* cycle of the first message */
	uint64_t cycles;
	uint64_t first;
	uint64_t last;
	size_t files;
	char names[FILES_BYTES]; /* of the files that it was cut from, the first ones */
};

/* In the file that is being read. */
struct cut_file {
	struct cut *cut;
	struct recording *rec;
	int has_head; /* its definitions are known to the writer */
	int event_channel;
	int result;
};

static int no_sync(void *ctx)
{
	(void)ctx;
	return 0; /* a pipe has nothing to be made durable */
}

static int open_output(struct cut *cut)
{
	const char *output = cut->options->output;
	struct mcap_io io;

	cut->fd = output == NULL ? STDOUT_FILENO
				 : open(output, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0644);
	if (cut->fd < 0) {
		return -errno;
	}
	io = file_io(&cut->fd);
	if (output == NULL) {
		io.sync = no_sync;
	}
	return mcap_writer_create(&io, ZSTD_LEVEL, &cut->w);
}

/* One schema or channel; @item is of any file of the session. */
static int define(struct cut *cut, const struct mcap_item *item)
{
	const struct mcap_index *ix = mcap_writer_index(cut->w);
	int is_known = item->kind == MCAP_ITEM_SCHEMA ? ix->schema_at[item->id] != 0
						      : ix->channel_at[item->id] != 0;

	if (is_known) {
		return mcap_index_contradicts(ix, item->record, item->record_len) ? -EEXIST : 0;
	}
	return mcap_writer_copy(cut->w, item->record, item->record_len);
}

/* What the counts of `ecdaq.session` are for this recording: nothing was recorded before it. */
static int replace_count(const struct cut *cut, struct mcap_text key, char number[NUMBER_BYTES])
{
	if (mcap_text_is(key, "next_cycle") || mcap_text_is(key, "first_cycle")) {
		snprintf(number, NUMBER_BYTES, "%" PRIu64, cut->start);
		return 1;
	}
	if (mcap_text_is(key, "cycles_before") || mcap_text_is(key, "gaps_before") ||
	    mcap_text_is(key, "cycles_missing_before")) {
		snprintf(number, NUMBER_BYTES, "0");
		return 1;
	}
	return 0;
}

static int put_session(struct cut *cut, const struct mcap_item *item)
{
	struct mcap_pair pairs[PAIRS];
	char *text[TEXTS] = { NULL };
	struct mcap_text key;
	struct mcap_text value;
	size_t offset = 0;
	size_t count = 0;
	int r = 0;

	while (r == 0 && count < PAIRS &&
	       mcap_pairs_next(item->data, item->data_len, &offset, &key, &value) > 0) {
		char number[NUMBER_BYTES];
		char **copy = &text[count * 2];

		copy[0] = strndup(key.at, key.len);
		copy[1] = replace_count(cut, key, number) ? strdup(number)
							  : strndup(value.at, value.len);
		r = copy[0] == NULL || copy[1] == NULL ? -ENOMEM : 0;
		pairs[count++] = (struct mcap_pair){ copy[0], copy[1] };
	}
	r = r < 0 ? r : mcap_writer_metadata(cut->w, "ecdaq.session", pairs, count);
	for (size_t i = 0; i < TEXTS; i++) {
		free(text[i]);
	}
	return r;
}

/* Of the first file also what describes the session. Seconds that were counted are not copied: the
 * first and the last one may be cut. Readers count the samples. */
static int take_head_item(struct cut *cut, const struct mcap_item *item, int is_first)
{
	switch (item->kind) {
	case MCAP_ITEM_SCHEMA:
	case MCAP_ITEM_CHANNEL:
		return define(cut, item);
	case MCAP_ITEM_METADATA:
		return !is_first ? 0
		       : mcap_text_is(item->name, "ecdaq.session")
			       ? put_session(cut, item)
			       : mcap_writer_copy(cut->w, item->record, item->record_len);
	case MCAP_ITEM_ATTACHMENT:
		return !is_first || mcap_text_is(item->name, ENVELOPE_NAME)
			       ? 0
			       : mcap_writer_copy(cut->w, item->record, item->record_len);
	case MCAP_ITEM_HEADER:
	case MCAP_ITEM_MESSAGE:
	case MCAP_ITEM_CHUNK:
	case MCAP_ITEM_MESSAGE_INDEX:
	case MCAP_ITEM_STATISTICS:
	case MCAP_ITEM_OTHER:
	case MCAP_ITEM_DATA_END:
	case MCAP_ITEM_DAMAGE:
		return 0;
	}
	return 0;
}

static void note_file(struct cut *cut, const char *path)
{
	const char *name = strrchr(path, '/');
	size_t used = strlen(cut->names);

	name = name == NULL ? path : name + 1;
	if (used + strlen(name) + 2 < sizeof(cut->names)) {
		snprintf(cut->names + used, sizeof(cut->names) - used, "%s%s", used > 0 ? " " : "",
			 name);
	}
	cut->files++;
}

/* All that is before the first chunk of the file, by a reader of its own: the other one is at a
 * message. */
static int take_head(struct cut_file *f)
{
	struct cut *cut = f->cut;
	int is_first = !cut->is_begun;
	struct mcap_reader *reader;
	struct mcap_item item;
	int r = mcap_reader_create(&f->rec->file.source, &reader);

	if (r < 0) {
		return r;
	}
	f->has_head = 1;
	if (is_first) {
		r = open_output(cut);
		cut->is_begun = cut->w != NULL;
		r = r < 0 ? r : mcap_writer_begin(cut->w, "ros2", "ecdaq " ECDAQ_VERSION);
	}
	while (r == 0 && (r = mcap_reader_next(reader, &item)) > 0 &&
	       item.kind != MCAP_ITEM_CHUNK) {
		r = take_head_item(cut, &item, is_first);
	}
	mcap_reader_destroy(reader);
	note_file(cut, f->rec->path);
	return r < 0 ? r : 0;
}

/* @cycle: what it is of. */
static int copy_message(struct cut_file *f, const struct mcap_item *item, uint64_t cycle)
{
	const struct mcap_message message = { .channel_id = item->id,
					      .sequence = item->sequence,
					      .log_time_ns = item->log_time_ns,
					      .publish_time_ns = item->publish_time_ns,
					      .data = item->data,
					      .data_len = item->data_len };
	struct cut *cut = f->cut;
	int r;

	cut->start = cut->is_begun ? cut->start : cycle;
	r = f->has_head ? 0 : take_head(f);
	if (r < 0) {
		return r;
	}
	if (!mcap_index_can_read(mcap_writer_index(cut->w), item->id)) {
		return -ENOKEY;
	}
	r = mcap_writer_message(cut->w, &message);
	if (r == -ENOBUFS) {
		r = mcap_writer_close_chunk(cut->w);
		r = r < 0 ? r : mcap_writer_message(cut->w, &message);
	}
	return r;
}

static int take_cycle(struct cut_file *f, const struct mcap_item *item)
{
	struct cut *cut = f->cut;
	uint64_t cycle;
	int r;

	if (messages_decode_cycle(item->data, item->data_len, &cycle) < 0) {
		return -EBADMSG;
	}
	cut->is_inside = cycle >= cut->options->from && cycle <= cut->options->to;
	cut->is_over = cycle > cut->options->to && cycle - cut->options->to > cut->behind;
	if (!cut->is_inside) {
		return 0;
	}
	r = copy_message(f, item, cycle);
	if (r == 0) {
		cut->first = cut->cycles++ == 0 ? cycle : cut->first;
		cut->last = cycle;
	}
	return r;
}

static int take_message(struct cut_file *f, const struct mcap_item *item)
{
	const struct cut *cut = f->cut;
	uint64_t cycle;

	if (item->id == f->rec->cycle_channel) {
		return take_cycle(f, item);
	}
	if (item->id != f->event_channel) {
		return cut->is_inside ? copy_message(f, item, cut->last) : 0;
	}
	/* It is some cycles before or behind the cycle that it is of. */
	return messages_decode_event_cycle(item->data, item->data_len, &cycle) == 0 &&
			       cycle >= cut->options->from && cycle <= cut->options->to
		       ? copy_message(f, item, cycle)
		       : 0;
}

static int take_item(struct cut_file *f, const struct mcap_item *item)
{
	switch (item->kind) {
	case MCAP_ITEM_CHANNEL:
		if (mcap_text_is(item->name, messages_topic(MESSAGE_EVENT))) {
			f->event_channel = item->id;
		}
		return f->has_head ? define(f->cut, item) : 0;
	case MCAP_ITEM_SCHEMA:
		return f->has_head ? define(f->cut, item) : 0;
	case MCAP_ITEM_MESSAGE:
		return take_message(f, item);
	case MCAP_ITEM_DAMAGE:
		/* The undamaged part is copied; the exit code reports the damage. */
		if (!log_is_recording(f->rec->path)) {
			f->result = log_fail(f->cut->err, f->rec->path, item->reason);
		}
		return 0;
	case MCAP_ITEM_HEADER:
	case MCAP_ITEM_CHUNK:
	case MCAP_ITEM_MESSAGE_INDEX:
	case MCAP_ITEM_ATTACHMENT:
	case MCAP_ITEM_METADATA:
	case MCAP_ITEM_STATISTICS:
	case MCAP_ITEM_OTHER:
	case MCAP_ITEM_DATA_END:
		return 0;
	}
	return 0;
}

/* An error @r ends it: what is written is not a recording. */
static int give_up(struct cut *cut, const struct recording *rec, int r)
{
	cut->is_hopeless = 1;
	return r == -EEXIST && cut->is_begun
		       ? log_fail(cut->err, rec->path,
				  "has other channels than the files before: cut it by itself")
	       : r == -ENOKEY ? log_fail(cut->err, rec->path, "a message has no channel")
	       : r == -EBADMSG
		       ? log_fail(cut->err, rec->path, "a message does not fit to its definition")
	       : cut->is_begun
		       ? log_fail_errno(cut->err, rec->path, r)
		       : log_fail_errno(
				 cut->err,
				 cut->options->output != NULL ? cut->options->output : "output", r);
}

static int read_chunks(struct cut_file *f, const struct mcap_places *chunks, size_t first)
{
	struct cut *cut = f->cut;
	struct mcap_item item;
	int r = 0;

	/* Channels are in the head, too: which of them has the events. */
	mcap_reader_seek(f->rec->reader, MCAP_MAGIC_BYTES);
	while ((r = mcap_reader_next(f->rec->reader, &item)) > 0 && item.kind != MCAP_ITEM_CHUNK) {
		if (item.kind == MCAP_ITEM_CHANNEL) {
			(void)take_item(f, &item);
		}
	}
	if (r < 0) {
		return r;
	}
	mcap_reader_seek(f->rec->reader, chunks->at[first]);
	while (!cut->is_over && (r = mcap_reader_next(f->rec->reader, &item)) > 0) {
		r = take_item(f, &item);
		if (r < 0) {
			return r;
		}
	}
	return r < 0 ? r : 0;
}

/* Do its closing notes say that nothing of it is asked for? */
static int is_needed(const struct cut *cut, const struct recording *rec)
{
	struct overview overview;

	return overview_read(&rec->file.source, &overview) < 0 || !overview.has_counts ||
	       (overview.cycles > 0 && overview.last_cycle >= cut->options->from &&
		(cut->is_begun || overview.first_cycle <= cut->options->to));
}

static int take_recording(struct cut *cut, struct recording *rec)
{
	struct cut_file f = { .cut = cut, .rec = rec, .event_channel = -1 };
	struct mcap_places chunks;
	size_t first = 0;
	int r;

	if (!is_needed(cut, rec)) {
		return EXIT_CODE_OK;
	}
	if (rec->cycle_channel < 0) {
		return log_fail(cut->err, rec->path,
				"has no /ecdaq/cycle: not a recording of ours");
	}
	cut->behind = EVENTS_BEHIND + envelope_block_cycles(rec->period_ns);
	r = mcap_places_read(&rec->file.source, MCAP_OP_CHUNK, &chunks);
	if (r == 0 && !cut->is_begun) {
		r = recording_find_chunk(rec, &chunks, cut->options->from, &first);
	}
	r = r == 0 && first < chunks.count ? read_chunks(&f, &chunks, first) : r;
	mcap_places_done(&chunks);
	return r < 0 ? give_up(cut, rec, r) : f.result;
}

static int take_file(struct cut *cut, const char *name)
{
	struct recording rec;
	char path[PATH_MAX];
	int result;
	int r = recording_open_of(&rec, cut->options->dir, name, cut->session, NULL, path);

	if (r <= 0) {
		return r == 0 ? EXIT_CODE_OK : log_fail_errno(cut->err, name, r);
	}
	result = take_recording(cut, &rec);
	recording_close(&rec);
	return result;
}

static int put_end(struct cut *cut)
{
	enum { CYCLES, FIRST, LAST, FROM, TO, SESSION, FILES, COUNT };
	const uint64_t value[COUNT] = { cut->cycles,        cut->first,       cut->last,
					cut->options->from, cut->options->to, cut->session,
					cut->files };
	char text[COUNT][NUMBER_BYTES];
	const struct mcap_pair end[] = {
		{ "reason", "cut from other recordings: see ecdaq.cut" },
		{ "cycles", text[CYCLES] },
		{ "first_cycle", text[FIRST] },
		{ "last_cycle", text[LAST] },
	};
	const struct mcap_pair note[] = {
		{ "program", "ecdaq log cut " ECDAQ_VERSION },
		{ "session", text[SESSION] },
		{ "from", text[FROM] },
		{ "to", text[TO] },
		{ "files", text[FILES] },
		{ "names", cut->names },
	};
	int r;

	for (int i = 0; i < COUNT; i++) {
		snprintf(text[i], NUMBER_BYTES, "%" PRIu64, value[i]);
	}
	r = mcap_writer_metadata(cut->w, "ecdaq.cut", note, sizeof(note) / sizeof(note[0]));
	r = r < 0 ? r
		  : mcap_writer_metadata(cut->w, "ecdaq.end", end, sizeof(end) / sizeof(end[0]));
	return r < 0 ? r : mcap_writer_finish(cut->w);
}

/* The end of the new recording; or there is none, then no file is left. */
static int finish(struct cut *cut, int result)
{
	const char *output = cut->options->output;
	int r = 0;

	if (cut->cycles == 0 && !cut->is_hopeless && result == EXIT_CODE_OK) {
		cut->is_hopeless = 1;
		result = log_fail(cut->err, cut->options->dir, "there is no such cycle");
	}
	if (cut->is_begun && !cut->is_hopeless) {
		r = put_end(cut);
		cut->is_hopeless = r < 0;
		result = r < 0 ? log_fail_errno(cut->err, output != NULL ? output : "output", r)
			       : result;
	}
	mcap_writer_destroy(cut->w);
	if (output != NULL && cut->fd >= 0) {
		if (close(cut->fd) < 0 && !cut->is_hopeless) {
			cut->is_hopeless = 1;
			result = log_fail_errno(cut->err, output, -errno);
		}
		if (cut->is_hopeless) {
			unlink(output);
		}
	}
	return result;
}

int log_cut(const struct log_cut_options *options, FILE *err)
{
	struct cut cut = { .options = options, .err = err, .session = options->session, .fd = -1 };
	int64_t start_ns = host_clock_ns(CLOCK_MONOTONIC);
	struct store_entry *entries;
	size_t count;
	int result = EXIT_CODE_OK;
	int r = store_list(options->dir, &entries, &count);

	if (r < 0) {
		return log_fail_errno(err, options->dir, r);
	}
	if (cut.session == 0) {
		cut.session = recording_newest_session(options->dir, entries, count);
	}
	for (size_t i = 0; i < count && !cut.is_over && !cut.is_hopeless; i++) {
		int one = take_file(&cut, entries[i].name);

		result = result != EXIT_CODE_OK ? result : one;
	}
	free(entries);
	result = finish(&cut, result);
	progress_done(start_ns, "%" PRIu64 " cycles of %zu files", cut.cycles, cut.files);
	return result;
}
