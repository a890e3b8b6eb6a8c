/* SPDX-License-Identifier: MIT */
#include "web/past.h"

#include <errno.h>
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/limits.h"
#include "record/envelope.h"
#include "web/exports.h"

enum {
	TEXT_BYTES = 8 << 20, /* of a table: more is none of ours */
	READ_BYTES = 64 * 1024,
	FIELDS = 5, /* of a channel: good, min, max, mean, rms */
};

/* What was asked of the recordings. */
struct grid {
	uint64_t session;
	uint64_t first;
	uint64_t cycles;
	uint32_t pixels;
	uint32_t count;
	uint32_t channel[HISTORY_CHANNELS];
};

/* A column as the recordings have it. */
struct past_column {
	uint64_t samples;
	struct envelope_sum sum[HISTORY_CHANNELS];
};

struct past {
	char *dir;
	struct exports exports;
	const void *owner; /* NULL: no process runs */
	int number;        /* of the process */
	int fd;
	struct grid grid;
	uint64_t oldest;       /* of the ring when the process was started */
	int has_columns;       /* of grid, up to oldest */
	uint32_t block_cycles; /* of the session */
	char *text;            /* that the process has printed */
	size_t text_len;
	struct history_picture picture;
	struct past_column column[HISTORY_PIXELS];
};

int past_create(const char *dir, struct past **ret_past)
{
	struct past *p = calloc(1, sizeof(*p));

	if (p != NULL) {
		p->fd = -1;
		p->dir = strdup(dir);
		p->text = malloc(TEXT_BYTES + 1);
	}
	if (p == NULL || p->dir == NULL || p->text == NULL) {
		past_destroy(p);
		return -ENOMEM;
	}
	*ret_past = p;
	return 0;
}

static void forget_process(struct past *p)
{
	if (p->fd >= 0) {
		close(p->fd);
	}
	p->fd = -1;
	p->owner = NULL;
}

void past_destroy(struct past *p)
{
	if (p != NULL) {
		forget_process(p);
		exports_done(&p->exports);
		free(p->dir);
		free(p->text);
		free(p);
	}
}

uint64_t past_end(const struct history_request *req, uint64_t newest, uint64_t ring_cycles)
{
	uint64_t column = req->cycles / req->pixels;

	if (req->end != 0 || req->trigger.kind != TRIGGER_NONE || req->cycles <= ring_cycles ||
	    column == 0) {
		return req->end;
	}
	return (newest + 1) / column * column;
}

static uint32_t pixel_of(const struct grid *g, uint64_t cycle)
{
	return (uint32_t)((cycle - g->first) * g->pixels / g->cycles);
}

/* The first cycle of a column. */
static uint64_t cycle_of(const struct grid *g, uint32_t pixel)
{
	return g->first + (pixel * g->cycles + g->pixels - 1) / g->pixels;
}

static struct grid grid_of(const struct history_request *req, const struct channel_table *table,
			   const struct history_picture *picture)
{
	struct grid g = { .session = table->meta.session,
			  .first = picture->first,
			  .cycles = picture->cycles,
			  .pixels = picture->pixels,
			  .count = req->count };

	memcpy(g.channel, req->channel, req->count * sizeof(req->channel[0]));
	return g;
}

static int is_same(const struct grid *a, const struct grid *b)
{
	return a->session == b->session && a->first == b->first && a->cycles == b->cycles &&
	       a->pixels == b->pixels && a->count == b->count &&
	       memcmp(a->channel, b->channel, a->count * sizeof(a->channel[0])) == 0;
}

/* 0, or -errno: there will be no answer. */
static int start(struct past *p, const struct channel_table *table)
{
	static char program[] = "ecdaq-log";
	static char verb[] = "envelope";
	static char options[][16] = {
		"--dir", "--session", "--from", "--to", "--rows", "--channels"
	};
	const struct grid *g = &p->grid;
	char channels[HISTORY_CHANNELS * LIMIT_NAME_BYTES] = "";
	char number[4][24];
	char *words[] = { program,    verb,       options[0], p->dir,     options[1],
			  number[0],  options[2], number[1],  options[3], number[2],
			  options[4], number[3],  options[5], channels,   NULL };
	size_t len = 0;
	int r;

	for (uint32_t i = 0; i < g->count; i++) {
		len += (size_t)snprintf(channels + len, sizeof(channels) - len, "%s%s",
					i > 0 ? "," : "", table->channels[g->channel[i]].name);
	}
	snprintf(number[0], sizeof(number[0]), "%" PRIu64, g->session);
	snprintf(number[1], sizeof(number[1]), "%" PRIu64, g->first);
	snprintf(number[2], sizeof(number[2]), "%" PRIu64, g->first + g->cycles - 1);
	snprintf(number[3], sizeof(number[3]), "%" PRIu32, g->pixels);
	p->text_len = 0;
	r = exports_start(&p->exports, words, EXPORTS_ERRORS_TO_LOG, &p->fd);
	p->number = r;
	return r < 0 ? r : 0;
}

/* The next field of a line in place: *@at is moved behind it. "" at the end. */
static const char *next_field(char **at)
{
	char *field = *at;
	char *end = field + strcspn(field, ",\n");

	*at = *end == ',' ? end + 1 : end;
	*end = '\0';
	return field;
}

/* Where in a row each channel of the grid is, counted in fields. 0, -EBADMSG. */
static int find_fields(const struct grid *g, const struct channel_table *table, char *header,
		       int ret_field[HISTORY_CHANNELS])
{
	for (uint32_t i = 0; i < g->count; i++) {
		ret_field[i] = -1;
	}
	for (int n = 0; *header != '\0'; n++) {
		const char *field = next_field(&header);

		for (uint32_t i = 0; i < g->count; i++) {
			char wanted[LIMIT_NAME_BYTES + 8];

			snprintf(wanted, sizeof(wanted), "%s good",
				 table->channels[g->channel[i]].name);
			ret_field[i] = strcmp(field, wanted) == 0 ? n : ret_field[i];
		}
	}
	for (uint32_t i = 0; i < g->count; i++) {
		if (ret_field[i] < 0) {
			return -EBADMSG;
		}
	}
	return 0;
}

static struct envelope_sum sum_of(const char *const field[FIELDS])
{
	struct envelope_sum s = ENVELOPE_SUM_NONE;
	double good = (double)strtoull(field[0], NULL, 10);
	double rms = strtod(field[4], NULL);

	if (good > 0) {
		s.good = (uint64_t)good;
		s.min = strtod(field[1], NULL);
		s.max = strtod(field[2], NULL);
		s.sum = strtod(field[3], NULL) * good;
		s.squares = rms * rms * good;
	}
	return s;
}

static void take_line(struct past *p, char *line, const int field[HISTORY_CHANNELS])
{
	enum { LONGEST = 2 + HISTORY_CHANNELS * FIELDS };
	const struct grid *g = &p->grid;
	const char *found[LONGEST + FIELDS];
	struct past_column *column;
	uint64_t cycle;
	int n = 0;

	while (n < LONGEST && *line != '\0') {
		found[n++] = next_field(&line);
	}
	cycle = n > 0 ? strtoull(found[0], NULL, 10) : UINT64_MAX;
	if (n < 2 || cycle < g->first || cycle - g->first >= g->cycles) {
		return;
	}
	while (n < LONGEST + FIELDS) {
		found[n++] = "";
	}
	column = &p->column[pixel_of(g, cycle)];
	column->samples = strtoull(found[1], NULL, 10);
	for (uint32_t i = 0; i < g->count; i++) {
		column->sum[i] = sum_of(&found[field[i] < LONGEST ? field[i] : LONGEST]);
	}
}

/* What the process has printed. */
static void take_text(struct past *p, const struct channel_table *table)
{
	int field[HISTORY_CHANNELS];
	char *line = p->text;
	char *end = strchr(line, '\n');

	for (uint32_t k = 0; k < p->grid.pixels; k++) {
		p->column[k].samples = 0;
		for (uint32_t i = 0; i < p->grid.count; i++) {
			p->column[k].sum[i] = ENVELOPE_SUM_NONE;
		}
	}
	if (end == NULL) {
		return;
	}
	*end = '\0';
	if (find_fields(&p->grid, table, line, field) < 0) {
		return;
	}
	for (line = end + 1; (end = strchr(line, '\n')) != NULL; line = end + 1) {
		*end = '\0';
		take_line(p, line, field);
	}
}

/* 0: it has ended; -EAGAIN. */
static int read_text(struct past *p, const struct channel_table *table)
{
	ssize_t n = 1;

	while (n > 0 && p->text_len < TEXT_BYTES) {
		size_t room = TEXT_BYTES - p->text_len;

		n = read(p->fd, p->text + p->text_len, room < READ_BYTES ? room : READ_BYTES);
		p->text_len += n > 0 ? (size_t)n : 0;
	}
	if (n < 0 && (errno == EAGAIN || errno == EINTR)) {
		return -EAGAIN;
	}
	/* 1: something is damaged or missing, and it has said so in the log. */
	if (n == 0 && exports_finish(&p->exports, p->number, 1) == 0) {
		return -EAGAIN;
	}
	if (n != 0) {
		exports_stop(&p->exports, p->number);
		p->text_len = 0;
	}
	p->text[p->text_len] = '\0';
	take_text(p, table);
	p->has_columns = 1;
	return 0;
}

/* Samples that a column has if none is missing: with columns of seconds, whole ones. */
static uint64_t expected(const struct past *p, uint32_t pixel)
{
	uint64_t from = cycle_of(&p->grid, pixel);
	uint64_t to = cycle_of(&p->grid, pixel + 1);
	uint64_t block = p->block_cycles;

	if (p->grid.cycles / p->grid.pixels < block) {
		return to - from;
	}
	return ((to + block / 2) / block - (from + block / 2) / block) * block;
}

static void join_sum(struct history_sum *s, const struct envelope_sum *more)
{
	double good = (double)s->count;
	double all = good + (double)more->good;

	if (more->good == 0) {
		return;
	}
	s->mean = ((good > 0 ? s->mean * good : 0) + more->sum) / all;
	s->rms = sqrt(((good > 0 ? s->rms * s->rms * good : 0) + more->squares) / all);
	s->min = good > 0 && s->min < more->min ? s->min : more->min;
	s->max = good > 0 && s->max > more->max ? s->max : more->max;
	s->count += more->good;
}

static void join_column(struct history_column *c, const struct envelope_sum *more)
{
	if (more->good > 0) {
		/* A NaN is replaced. */
		c->min = c->min <= (float)more->min ? c->min : (float)more->min;
		c->max = c->max >= (float)more->max ? c->max : (float)more->max;
	}
}

/* The columns before that of @oldest, and their part of that one. */
static void join(struct past *p, uint64_t oldest)
{
	struct history_picture *to = &p->picture;
	uint64_t end = p->grid.first + p->grid.cycles;
	uint32_t last = oldest < end ? pixel_of(&p->grid, oldest) : p->grid.pixels - 1;
	int has_begun = 0;

	for (uint32_t k = 0; k <= last; k++) {
		const struct past_column *from = &p->column[k];
		int is_whole = k < last || oldest >= end;

		if (has_begun && is_whole && from->samples < expected(p, k)) {
			to->mark[k] |= HISTORY_MISSING;
		}
		has_begun = has_begun || from->samples > 0;
		for (uint32_t i = 0; i < p->grid.count; i++) {
			if (from->sum[i].good < from->samples) {
				to->mark[k] |= HISTORY_BAD;
			}
			join_column(&to->column[i][k], &from->sum[i]);
			if (is_whole) {
				join_sum(&to->sum[i], &from->sum[i]);
			}
		}
	}
}

int past_complete(struct past *p, const void *owner, const struct history_request *req,
		  const struct channel_table *table, uint64_t oldest,
		  const struct history_picture *picture)
{
	struct grid grid;
	int r;

	exports_reap(&p->exports);
	if (p->owner != NULL && p->owner != owner) {
		return -EBUSY;
	}
	if (p->owner == NULL) {
		grid = grid_of(req, table, picture);
		p->picture = *picture;
		if (!p->has_columns || !is_same(&grid, &p->grid) ||
		    (oldest < grid.first + grid.cycles &&
		     pixel_of(&grid, oldest) > pixel_of(&p->grid, p->oldest))) {
			p->grid = grid;
			p->oldest = oldest;
			p->has_columns = 0;
			p->block_cycles = envelope_block_cycles(table->meta.period_ns);
			r = start(p, table);
			if (r < 0) { /* one that was stopped is not gone yet; else the ring alone */
				return r == -EBUSY ? r : 0;
			}
			p->owner = owner;
		}
	}
	if (p->owner == owner) {
		if (table->meta.session != p->grid.session) {
			past_stop(p, owner);
			return 0;
		}
		if (read_text(p, table) < 0) {
			return -EAGAIN;
		}
		forget_process(p);
	}
	join(p, p->oldest);
	return 0;
}

const struct history_picture *past_picture(const struct past *p)
{
	return &p->picture;
}

int past_is_for(const struct past *p, const void *owner)
{
	return p->owner == owner;
}

void past_stop(struct past *p, const void *owner)
{
	if (p->owner == owner && owner != NULL) {
		exports_stop(&p->exports, p->number);
		forget_process(p);
	}
}
