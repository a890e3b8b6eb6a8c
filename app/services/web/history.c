/* SPDX-License-Identifier: MIT */
#include "web/history.h"

#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "image/image.h"
#include "reader/reader.h"
#include "web/period.h"

struct history {
	struct reader *reader;
	int has_session;
};

/* Samples with cycles in [first, end), oldest first. */
struct scan {
	uint64_t end;
	int is_over;
};

int history_create(const char *path, struct history **ret_history)
{
	struct history *h = calloc(1, sizeof(*h));
	int r = h == NULL ? -ENOMEM : reader_create(path, READER_AT_NEWEST, &h->reader);

	if (r < 0) {
		free(h);
		return r;
	}
	*ret_history = h;
	return 0;
}

void history_destroy(struct history *h)
{
	if (h != NULL) {
		reader_destroy(h->reader);
		free(h);
	}
}

/* What is behind the cursor is not of interest: go to the end, where a new session is noticed. */
static void follow(struct history *h)
{
	uint64_t lost;

	if (h->has_session) {
		reader_seek(h->reader, reader_newest(h->reader));
	}
	/* In order: the end of a session, the wait, the next one. */
	for (int i = 0; i < 3; i++) {
		if (reader_next(h->reader, &lost) == READER_BEGUN) {
			h->has_session = 1;
			return;
		}
	}
}

const struct channel_table *history_table(struct history *h)
{
	follow(h);
	return h->has_session ? reader_table(h->reader) : NULL;
}

/* To the sample of cycle @first, or the next one there is. */
static int scan_begin(struct history *h, struct scan *scan, uint64_t first, uint64_t end)
{
	uint64_t newest;
	uint64_t newest_cycle;
	uint64_t back;

	if (!h->has_session || !reader_read_newest(h->reader)) {
		return -ENODATA;
	}
	newest = reader_newest(h->reader) - 1;
	newest_cycle = reader_header(h->reader)->cycle;
	/* At least one cycle a sample: no sample of these cycles is before that. */
	back = newest_cycle > first ? newest_cycle - first : 0;
	reader_seek(h->reader, back < newest ? newest - back : 0);
	*scan = (struct scan){ .end = end };
	return 0;
}

/* The next sample, from @first on. 0: no more. */
static int scan_next(struct history *h, struct scan *scan, uint64_t first)
{
	uint64_t lost;

	while (!scan->is_over) {
		switch (reader_next(h->reader, &lost)) {
		case READER_SAMPLE:
			if (reader_header(h->reader)->cycle >= scan->end) {
				scan->is_over = 1;
			} else if (reader_header(h->reader)->cycle >= first) {
				return 1;
			}
			break;
		case READER_LOST:
			break; /* the oldest left the ring meanwhile */
		case READER_EMPTY:
		case READER_ENDED:
		case READER_WAITING:
		case READER_BEGUN:
			scan->is_over = 1;
			break;
		}
	}
	return 0;
}

int history_range(struct history *h, uint64_t *ret_oldest, uint64_t *ret_newest)
{
	struct scan scan;
	uint64_t newest;

	if (!h->has_session || !reader_read_newest(h->reader)) {
		return -ENODATA;
	}
	newest = reader_header(h->reader)->cycle;
	reader_seek(h->reader, reader_oldest(h->reader));
	scan = (struct scan){ .end = UINT64_MAX };
	if (!scan_next(h, &scan, 0)) {
		return -ENODATA;
	}
	*ret_oldest = reader_header(h->reader)->cycle;
	*ret_newest = newest;
	return 0;
}

/* NaN: the sample is not good for the channel's slave. */
static double value_of(const struct history *h, const struct channel *ch)
{
	return sample_is_good(reader_header(h->reader), ch->slave_pos)
		       ? image_get_physical(reader_image(h->reader), ch)
		       : (double)NAN;
}

int history_newest(struct history *h, double *ret_value, uint64_t *ret_cycle)
{
	const struct channel_table *table;

	if (!h->has_session || !reader_read_newest(h->reader)) {
		return -ENODATA;
	}
	table = reader_table(h->reader);
	for (uint32_t i = 0; i < table->meta.channel_count; i++) {
		ret_value[i] = value_of(h, &table->channels[i]);
	}
	*ret_cycle = reader_header(h->reader)->cycle;
	return 0;
}

static int check(const struct history *h, const struct history_request *req)
{
	uint32_t channels = reader_table(h->reader)->meta.channel_count;

	if (req->cycles < 1 || req->cycles > HISTORY_CYCLES || req->pixels < 1 ||
	    req->pixels > HISTORY_PIXELS || req->count > HISTORY_CHANNELS) {
		return -EINVAL;
	}
	for (uint32_t i = 0; i < req->count; i++) {
		if (req->channel[i] >= channels) {
			return -EINVAL;
		}
	}
	return (trigger_has_channel(&req->trigger) && req->trigger.channel >= channels) ||
			       (req->trigger.kind != TRIGGER_NONE &&
				req->trigger.before > req->cycles)
		       ? -EINVAL
		       : 0;
}

/* The newest trigger whose picture ends at @end at the latest; one picture and a half before that
 * is looked at, a second at least. */
static int find_trigger(struct history *h, const struct history_request *req, uint64_t end,
			struct history_picture *ret)
{
	const struct trigger *trigger = &req->trigger;
	const struct channel *ch = trigger_has_channel(trigger)
					   ? &reader_table(h->reader)->channels[trigger->channel]
					   : NULL;
	uint64_t after = req->cycles - trigger->before;
	uint64_t span = req->cycles + req->cycles / 2 + 1000;
	uint64_t first = end > span ? end - span : 0;
	uint64_t last = end > after ? end - after : 0;
	struct trigger_search search;
	struct scan scan;
	int r = scan_begin(h, &scan, first, last + 1);

	trigger_begin(&search, trigger, first);
	while (r == 0 && scan_next(h, &scan, first)) {
		trigger_add(&search, reader_header(h->reader), ch == NULL ? 0 : value_of(h, ch));
		ret->samples++;
	}
	ret->has_trigger = search.is_found && search.found_cycle <= last;
	ret->trigger = search.found_cycle;
	return r < 0 ? r : ret->has_trigger ? 0 : -EAGAIN;
}

static void add(struct history_picture *p, uint32_t i, uint32_t pixel, double value)
{
	struct history_column *column = &p->column[i][pixel];
	struct history_sum *sum = &p->sum[i];

	/* A NaN of the column or the sum is replaced. */
	column->min = (float)value >= column->min ? column->min : (float)value;
	column->max = (float)value <= column->max ? column->max : (float)value;
	sum->min = value >= sum->min ? sum->min : value;
	sum->max = value <= sum->max ? sum->max : value;
	sum->mean += value;
	sum->rms += value * value;
	sum->count++;
}

static void take(struct history *h, const struct history_request *req, struct history_picture *p,
		 uint32_t pixel)
{
	for (uint32_t i = 0; i < req->count; i++) {
		double value = value_of(h, &reader_table(h->reader)->channels[req->channel[i]]);

		if (isnan(value)) {
			p->mark[pixel] |= HISTORY_BAD;
		} else {
			add(p, i, pixel, value);
		}
	}
}

static uint32_t pixel_of(const struct history_picture *p, uint64_t cycle)
{
	return (uint32_t)((cycle - p->first) * p->pixels / p->cycles);
}

/* No samples for [from, to): they are missing only if they lie within what the ring has. */
static void mark_missing(struct history_picture *p, uint64_t from, uint64_t to)
{
	if (from < to) {
		for (uint32_t pixel = pixel_of(p, from); pixel <= pixel_of(p, to - 1); pixel++) {
			p->mark[pixel] |= HISTORY_MISSING;
		}
	}
}

static void begin(struct history_picture *p, const struct history_request *req)
{
	p->cycles = req->cycles;
	p->pixels = req->pixels < req->cycles ? req->pixels : (uint32_t)req->cycles;
	memset(p->mark, 0, sizeof(p->mark));
	for (uint32_t i = 0; i < req->count; i++) {
		p->sum[i] = (struct history_sum){ .min = (double)NAN,
						  .max = (double)NAN,
						  .period = (double)NAN };
		for (uint32_t k = 0; k < p->pixels; k++) {
			p->column[i][k] = (struct history_column){ NAN, NAN };
		}
	}
}

static void finish(struct history_picture *p, const struct history_request *req)
{
	for (uint32_t i = 0; i < req->count; i++) {
		struct history_sum *sum = &p->sum[i];

		sum->mean = sum->count == 0 ? (double)NAN : sum->mean / (double)sum->count;
		sum->rms = sum->count == 0 ? (double)NAN : sqrt(sum->rms / (double)sum->count);
	}
}

/* A second time through the samples: now their means are known. */
static int find_periods(struct history *h, const struct history_request *req,
			struct history_picture *p)
{
	struct period period[HISTORY_CHANNELS];
	struct scan scan;
	int r = scan_begin(h, &scan, p->first, p->first + p->cycles);

	for (uint32_t i = 0; i < req->count; i++) {
		const struct history_sum *sum = &p->sum[i];

		period_begin(&period[i], sum->mean, sum->min, sum->max);
	}
	while (r == 0 && scan_next(h, &scan, p->first)) {
		for (uint32_t i = 0; i < req->count; i++) {
			const struct channel *ch =
				&reader_table(h->reader)->channels[req->channel[i]];

			period_add(&period[i], reader_header(h->reader)->cycle, value_of(h, ch));
		}
	}
	for (uint32_t i = 0; i < req->count; i++) {
		p->sum[i].period = period_cycles(&period[i]);
	}
	return r;
}

int history_draw(struct history *h, const struct history_request *req, struct history_picture *p)
{
	struct scan scan;
	uint64_t end;
	uint64_t next = 0;
	int r;

	if (!h->has_session || !reader_read_newest(h->reader)) {
		return -ENODATA;
	}
	end = reader_header(h->reader)->cycle + 1;
	end = req->end != 0 && req->end < end ? req->end : end;
	p->has_trigger = 0;
	p->samples = 0;
	r = check(h, req);
	if (r == 0 && req->trigger.kind != TRIGGER_NONE) {
		r = find_trigger(h, req, end, p);
		end = r == 0 ? p->trigger - req->trigger.before + req->cycles : end;
	}
	if (r < 0) {
		return r;
	}
	p->first = end > req->cycles ? end - req->cycles : 0;
	begin(p, req);
	r = scan_begin(h, &scan, p->first, p->first + p->cycles);
	while (r == 0 && scan_next(h, &scan, p->first)) {
		uint64_t cycle = reader_header(h->reader)->cycle;

		mark_missing(p, next != 0 ? next : cycle, cycle);
		take(h, req, p, pixel_of(p, cycle));
		next = cycle + 1;
		p->samples++;
	}
	finish(p, req);
	return r == 0 && req->cycles <= HISTORY_PERIOD_CYCLES ? find_periods(h, req, p) : r;
}
