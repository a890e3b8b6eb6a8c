/* SPDX-License-Identifier: MIT */
/* ecdaq log envelope */
#include <assert.h>
#include <errno.h>
#include <inttypes.h>
#include <limits.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "program/exit_code.h"
#include "program/json.h"
#include "record/envelope.h"
#include "record/log.h"
#include "record/overview.h"
#include "record/recording.h"
#include "record/store.h"

/* Rows, each with the sums of all channels. */
struct cells {
	uint64_t *samples;
	struct envelope_sum *sum; /* [row][channel] */
};

struct envelope_table {
	const struct log_envelope_options *options;
	FILE *out;
	FILE *err;
	uint64_t session;
	uint64_t from; /* as asked for, or what there is */
	uint64_t to;
	uint64_t rows;
	uint32_t block_cycles;
	struct columns *columns; /* of the first file: its channels are those of the table */
	size_t *channel;         /* their numbers in columns */
	size_t channels;
	int is_hopeless; /* the table cannot be made: no more files */
	struct cells cells;
	struct cells file; /* of one file, until it was read without a failure */
};

/* Rows of a second or more are made of whole seconds. */
static int is_coarse(const struct envelope_table *t)
{
	return (t->to - t->from + 1) / t->rows >= t->block_cycles;
}

/* The row that samples of @cycle belong to; a second belongs to that which its middle is in. 0: to
 * none. */
static int find_row(const struct envelope_table *t, uint64_t cycle, uint64_t *ret_row)
{
	uint64_t at = is_coarse(t) ? cycle - cycle % t->block_cycles + t->block_cycles / 2 : cycle;

	if (at < t->from || at > t->to) {
		return 0;
	}
	*ret_row = (at - t->from) * t->rows / (t->to - t->from + 1);
	return 1;
}

/* No sample before the first and behind the last of these cycles belongs to a row. */
static uint64_t first_needed(const struct envelope_table *t)
{
	uint64_t more = is_coarse(t) ? t->block_cycles : 0;

	return t->from > more ? t->from - more : 0;
}

static uint64_t last_needed(const struct envelope_table *t)
{
	return t->to + (is_coarse(t) ? t->block_cycles : 0);
}

static int make_cells(struct cells *c, uint64_t rows, size_t channels)
{
	/* One more than there are: nothing of size 0. */
	c->samples = calloc(rows + 1, sizeof(c->samples[0]));
	c->sum = calloc(rows * channels + 1, sizeof(c->sum[0]));
	return c->samples == NULL || c->sum == NULL ? -ENOMEM : 0;
}

static void forget(const struct envelope_table *t, struct cells *c)
{
	assert(c->samples != NULL && c->sum != NULL);
	for (uint64_t row = 0; row < t->rows; row++) {
		c->samples[row] = 0;
	}
	for (uint64_t i = 0; i < t->rows * t->channels; i++) {
		c->sum[i] = ENVELOPE_SUM_NONE;
	}
}

static void join_file(struct envelope_table *t)
{
	for (uint64_t row = 0; row < t->rows; row++) {
		t->cells.samples[row] += t->file.samples[row];
	}
	for (uint64_t i = 0; i < t->rows * t->channels; i++) {
		envelope_sum_join(&t->cells.sum[i], &t->file.sum[i]);
	}
}

/* The channels of the first file are those of the table. Takes its columns. */
static int begin_table(struct envelope_table *t, struct recording *rec)
{
	size_t count = columns_count(rec->columns);

	t->channel = calloc(count + 1, sizeof(t->channel[0]));
	if (t->channel == NULL) {
		return -ENOMEM;
	}
	for (size_t i = 0; i < count; i++) {
		if (columns_is_channel(rec->columns, i)) {
			t->channel[t->channels++] = i;
		}
	}
	if (t->rows * t->channels > LOG_ENVELOPE_CELLS) {
		return -E2BIG;
	}
	if (make_cells(&t->cells, t->rows, t->channels) < 0 ||
	    make_cells(&t->file, t->rows, t->channels) < 0) {
		return -ENOMEM;
	}
	forget(t, &t->cells);
	t->columns = rec->columns;
	rec->columns = NULL;
	return 0;
}

/* All channels are known: they must be those of the table. 0; or it is said what is wrong. */
static int check_channels(struct envelope_table *t, struct recording *rec)
{
	char missing[256];
	char why[320];
	int r = columns_freeze(rec->columns, missing, sizeof(missing));

	if (r == -ENOENT) {
		snprintf(why, sizeof(why), "has no channel %s", missing);
		return log_fail(t->err, rec->path, why);
	}
	if (r < 0) {
		return log_fail(t->err, rec->path, "has no /ecdaq/cycle: not a recording of ours");
	}
	if (t->columns == NULL) {
		r = begin_table(t, rec);
		t->is_hopeless = r < 0;
		return r == -E2BIG ? log_fail(t->err, rec->path,
					      "has more channels than fit into so many rows: use "
					      "--channels, or less --rows")
		       : r < 0     ? log_fail_errno(t->err, rec->path, r)
				   : EXIT_CODE_OK;
	}
	return columns_are_equal(t->columns, rec->columns)
		       ? EXIT_CODE_OK
		       : log_fail(t->err, rec->path,
				  "has other channels or units than the files before");
}

/* For each channel of the table its number in the view; UINT32_MAX: it has none. */
static uint32_t *find_channels(const struct envelope_table *t, const struct envelope_view *v)
{
	uint32_t *found = calloc(t->channels + 1, sizeof(found[0]));

	if (found == NULL) {
		return NULL;
	}
	for (size_t i = 0; i < t->channels; i++) {
		found[i] = UINT32_MAX;
		for (uint32_t k = 0; k < v->channels && found[i] == UINT32_MAX; k++) {
			if (mcap_text_is(envelope_channel(v, k),
					 columns_name(t->columns, t->channel[i]))) {
				found[i] = k;
			}
		}
	}
	return found;
}

static void take_blocks(struct envelope_table *t, const struct envelope_view *v,
			const uint32_t *channel)
{
	for (uint32_t i = 0; i < v->blocks; i++) {
		uint32_t samples;
		uint64_t row;

		if (!find_row(t, envelope_block(v, i, &samples), &row)) {
			continue;
		}
		t->file.samples[row] += samples;
		for (size_t k = 0; k < t->channels; k++) {
			struct envelope_sum sum = envelope_get(v, i, channel[k]);

			envelope_sum_join(&t->file.sum[row * t->channels + k], &sum);
		}
	}
}

/* The seconds of one attachment. 1; 0: it has none; -ENODATA: they are no use here; or -errno. */
static int read_envelope(struct envelope_table *t, struct recording *rec, uint64_t offset)
{
	struct envelope_view v;
	struct mcap_item item;
	uint32_t *channel;
	int r;

	mcap_reader_seek(rec->reader, offset);
	r = mcap_reader_next(rec->reader, &item);
	if (r < 0) {
		return r;
	}
	if (r == 0 || item.kind != MCAP_ITEM_ATTACHMENT) {
		return -ENODATA;
	}
	if (!mcap_text_is(item.name, ENVELOPE_NAME)) {
		return 0;
	}
	if (envelope_parse(item.data, item.data_len, &v) < 0 || v.block_cycles != t->block_cycles) {
		return -ENODATA;
	}
	channel = find_channels(t, &v);
	if (channel == NULL) {
		return -ENOMEM;
	}
	for (size_t i = 0; i < t->channels && r >= 0; i++) {
		r = channel[i] == UINT32_MAX ? -ENODATA : 0;
	}
	if (r >= 0) {
		take_blocks(t, &v, channel);
	}
	free(channel);
	return r < 0 ? r : 1;
}

/* All seconds of the file; *@ret_end is where the last ones are, 0 if there are none, or they are
 * no use here. */
static int read_envelopes(struct envelope_table *t, struct recording *rec, uint64_t *ret_end)
{
	struct mcap_places places;
	int r = mcap_places_read(&rec->file.source, MCAP_OP_ATTACHMENT, &places);

	*ret_end = 0;
	for (size_t i = 0; i < places.count && r >= 0; i++) {
		r = read_envelope(t, rec, places.at[i]);
		*ret_end = r > 0 ? places.at[i] : r < 0 ? 0 : *ret_end;
	}
	mcap_places_done(&places);
	if (r == -ENODATA) {
		forget(t, &t->file); /* the samples say the same, only later */
		r = 0;
	}
	return r < 0 ? r : 0;
}

static void take_row(struct envelope_table *t, const struct columns *c)
{
	uint64_t row;

	if (!columns_has_row(c) || !find_row(t, columns_row_cycle(c), &row)) {
		return;
	}
	t->file.samples[row]++;
	for (size_t i = 0; i < t->channels; i++) {
		double value;

		if (columns_number(c, t->channel[i], &value) && !isnan(value)) {
			envelope_sum_add(&t->file.sum[row * t->channels + i], value);
		}
	}
}

/* Sample by sample from the chunk at @offset on. */
static int read_samples(struct envelope_table *t, struct recording *rec, uint64_t offset)
{
	/* Those of the first file are the table's. */
	struct columns *c = rec->columns != NULL ? rec->columns : t->columns;
	struct mcap_item item;
	int result = EXIT_CODE_OK;
	int r;

	mcap_reader_seek(rec->reader, offset);
	while ((r = mcap_reader_next(rec->reader, &item)) > 0) {
		if (item.kind == MCAP_ITEM_DAMAGE && !log_is_recording(rec->path)) {
			result = log_fail(t->err, rec->path, item.reason);
		}
		if (item.kind != MCAP_ITEM_MESSAGE) {
			continue;
		}
		if (columns_is_cycle(c, &item)) {
			take_row(t, c);
			if (columns_has_row(c) && columns_row_cycle(c) > last_needed(t)) {
				break;
			}
		}
		if ((columns_is_cycle(c, &item) ? columns_begin_row(c, &item)
						: columns_take(c, &item)) < 0) {
			return log_fail(t->err, rec->path,
					"a message does not fit to its definition");
		}
	}
	take_row(t, c);
	return r < 0 ? log_fail_errno(t->err, rec->path, r) : result;
}

/* The samples in chunks behind @after, as far as they are asked for. */
static int read_chunks(struct envelope_table *t, struct recording *rec, uint64_t after)
{
	struct mcap_places chunks;
	size_t first = 0;
	int result = EXIT_CODE_OK;
	int r = mcap_places_read(&rec->file.source, MCAP_OP_CHUNK, &chunks);

	while (r == 0 && first < chunks.count && chunks.at[first] < after) {
		first++;
	}
	if (r == 0 && first == 0) {
		r = recording_find_chunk(rec, &chunks, first_needed(t), &first);
	}
	if (r < 0) {
		result = log_fail_errno(t->err, rec->path, r);
	} else if (first < chunks.count) {
		result = read_samples(t, rec, chunks.at[first]);
	}
	mcap_places_done(&chunks);
	return result;
}

/* Are its closing notes there, and do they say that nothing of it is asked for? */
static int look_at_end(const struct envelope_table *t, const struct recording *rec,
		       int *ret_is_needed)
{
	struct overview overview;
	int has_notes = overview_read(&rec->file.source, &overview) == 0 && overview.has_counts;

	*ret_is_needed =
		!has_notes || (overview.cycles > 0 && overview.first_cycle <= last_needed(t) &&
			       overview.last_cycle >= first_needed(t));
	return has_notes;
}

static int take_recording(struct envelope_table *t, struct recording *rec)
{
	uint64_t end = 0;
	int is_needed;
	int has_notes;
	int result;
	int r;

	t->block_cycles = envelope_block_cycles(rec->period_ns);
	has_notes = look_at_end(t, rec, &is_needed);
	result = is_needed ? check_channels(t, rec) : EXIT_CODE_OK;
	if (!is_needed || result != EXIT_CODE_OK) {
		return result;
	}
	forget(t, &t->file);
	r = is_coarse(t) ? read_envelopes(t, rec, &end) : 0;
	if (r < 0) {
		return log_fail_errno(t->err, rec->path, r);
	}
	/* A file that was finished has all of its seconds. */
	if (end == 0 || !has_notes) {
		result = read_chunks(t, rec, end);
	}
	join_file(t);
	return result;
}

static int take_file(struct envelope_table *t, const char *name)
{
	const struct log_envelope_options *op = t->options;
	struct recording rec;
	char path[PATH_MAX];
	int result;
	int r = recording_open_of(&rec, op->dir, name, t->session, op->channels, path);

	if (r <= 0) {
		return r == 0 ? EXIT_CODE_OK : log_fail_errno(t->err, name, r);
	}
	result = take_recording(t, &rec);
	recording_close(&rec);
	return result;
}

/* What was not asked for is what there is. */
static void find_whole_range(struct envelope_table *t, const struct store_entry *entries,
			     size_t count)
{
	uint64_t first = UINT64_MAX;
	uint64_t last = 0;

	for (size_t i = 0; i < count; i++) {
		struct recording rec;
		char path[PATH_MAX];
		uint64_t from;
		uint64_t to;

		if (recording_open_of(&rec, t->options->dir, entries[i].name, t->session, NULL,
				      path) <= 0) {
			continue;
		}
		if (recording_find_range(&rec, &from, &to) > 0) {
			first = from < first ? from : first;
			last = to > last ? to : last;
		}
		recording_close(&rec);
	}
	t->from = t->options->from > first ? t->options->from : first;
	t->to = last;
}

static void put_number(const struct envelope_table *t, double value)
{
	char text[40];

	if (t->options->format == LOG_JSON) {
		json_put_real(t->out, value);
	} else {
		json_real_format(value, text, sizeof(text));
		fprintf(t->out, ",%s", text);
	}
}

static void put_header(const struct envelope_table *t)
{
	static const char *const what[] = { "min", "max", "mean", "rms" };

	fputs("cycle,samples", t->out);
	for (size_t i = 0; i < t->channels; i++) {
		const char *name = columns_name(t->columns, t->channel[i]);
		const char *unit = columns_unit(t->columns, t->channel[i]);
		char title[320];

		snprintf(title, sizeof(title), "%s good", name);
		fputc(',', t->out);
		columns_put_csv_text(t->out, title);
		for (size_t k = 0; k < sizeof(what) / sizeof(what[0]); k++) {
			snprintf(title, sizeof(title), unit[0] != '\0' ? "%s %s [%s]" : "%s %s",
				 name, what[k], unit);
			fputc(',', t->out);
			columns_put_csv_text(t->out, title);
		}
	}
	fputc('\n', t->out);
}

static void put_csv_sum(const struct envelope_table *t, const struct envelope_sum *s)
{
	double good = (double)s->good;

	fprintf(t->out, ",%" PRIu64, s->good);
	if (s->good == 0) {
		fputs(",,,,", t->out);
		return;
	}
	put_number(t, s->min);
	put_number(t, s->max);
	put_number(t, s->sum / good);
	put_number(t, sqrt(s->squares / good));
}

static void put_json_sum(const struct envelope_table *t, const struct envelope_sum *s)
{
	double good = (double)s->good;

	fprintf(t->out, "{\"good\":%" PRIu64, s->good);
	if (s->good > 0) {
		fputs(",\"min\":", t->out);
		put_number(t, s->min);
		fputs(",\"max\":", t->out);
		put_number(t, s->max);
		fputs(",\"mean\":", t->out);
		put_number(t, s->sum / good);
		fputs(",\"rms\":", t->out);
		put_number(t, sqrt(s->squares / good));
	}
	fputc('}', t->out);
}

/* The first cycle that belongs to @row. */
static uint64_t cycle_of(const struct envelope_table *t, uint64_t row)
{
	return t->from + (row * (t->to - t->from + 1) + t->rows - 1) / t->rows;
}

static void put_table(const struct envelope_table *t)
{
	int is_json = t->options->format == LOG_JSON;

	if (!is_json) {
		put_header(t);
	}
	for (uint64_t row = 0; row < t->rows; row++) {
		if (t->cells.samples[row] == 0) {
			continue;
		}
		fprintf(t->out,
			is_json ? "{\"cycle\":%" PRIu64 ",\"samples\":%" PRIu64
				: "%" PRIu64 ",%" PRIu64,
			cycle_of(t, row), t->cells.samples[row]);
		for (size_t i = 0; i < t->channels; i++) {
			const struct envelope_sum *s = &t->cells.sum[row * t->channels + i];

			if (is_json) {
				fputc(',', t->out);
				json_put_text(t->out, columns_name(t->columns, t->channel[i]));
				fputc(':', t->out);
				put_json_sum(t, s);
			} else {
				put_csv_sum(t, s);
			}
		}
		fputs(is_json ? "}\n" : "\n", t->out);
	}
}

static void destroy_table(struct envelope_table *t)
{
	columns_destroy(t->columns);
	free(t->channel);
	free(t->cells.samples);
	free(t->cells.sum);
	free(t->file.samples);
	free(t->file.sum);
}

int log_envelope(const struct log_envelope_options *options, FILE *out, FILE *err)
{
	struct envelope_table t = { .options = options,
				    .out = out,
				    .err = err,
				    .session = options->session,
				    .from = options->from,
				    .to = options->to };
	struct store_entry *entries;
	size_t count;
	int result = EXIT_CODE_OK;
	int r = store_list(options->dir, &entries, &count);

	if (r < 0) {
		return log_fail_errno(err, options->dir, r);
	}
	if (t.session == 0) {
		t.session = recording_newest_session(options->dir, entries, count);
	}
	if (t.to == UINT64_MAX) {
		find_whole_range(&t, entries, count);
	}
	if (t.from <= t.to && t.to - t.from >= LOG_ENVELOPE_CYCLES) {
		result = log_fail(err, options->dir, "--from, --to: more than 2^48 cycles");
		t.is_hopeless = 1;
	}
	t.rows = t.to - t.from < options->rows ? t.to - t.from + 1 : options->rows;
	for (size_t i = 0; i < count && t.from <= t.to && !t.is_hopeless; i++) {
		int one = take_file(&t, entries[i].name);

		result = result != EXIT_CODE_OK ? result : one;
	}
	free(entries);
	if (t.columns != NULL) {
		put_table(&t);
	} else if (result == EXIT_CODE_OK) {
		result = log_fail(err, options->dir, "there is no such cycle");
	}
	destroy_table(&t);
	return log_finish_output(out, err) != EXIT_CODE_OK ? EXIT_CODE_FAILED : result;
}
