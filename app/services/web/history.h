/* SPDX-License-Identifier: MIT */
/*
 * What the sample ring holds, as a picture: for each column of pixels the least and the largest
 * value of all samples in it, so that no peak is lost. Context: one thread; takes as long as
 * reading the samples of the picture does.
 */
#ifndef WEB_HISTORY_H
#define WEB_HISTORY_H

#include <stdint.h>

#include "reader/table.h"
#include "web/trigger.h"

enum {
	HISTORY_CHANNELS = 8, /* in a picture */
	HISTORY_PIXELS = 4096,
	HISTORY_CYCLES = 1 << 27,        /* that a picture may span: a day at 1 kHz */
	HISTORY_PERIOD_CYCLES = 1 << 17, /* longer pictures have no period */
};

struct history;

/** Of the sample ring at @path (copied). 0, -ENOMEM. Free with history_destroy(). */
int history_create(const char *path, struct history **ret_history);
void history_destroy(struct history *h);

/** The channels of the session that can be read, or was read last; NULL: none yet. Follows a new
 * session. */
const struct channel_table *history_table(struct history *h);
/** Cycle numbers of the oldest and the newest sample. 0; -ENODATA. */
int history_range(struct history *h, uint64_t *ret_oldest, uint64_t *ret_newest);

/** The newest sample: @ret_value gets the physical value of each of its channels, NaN for what is
 * not good. Its cycle in @ret_cycle. 0; -ENODATA. */
int history_newest(struct history *h, double *ret_value, uint64_t *ret_cycle);

struct history_request {
	uint64_t cycles;                    /* 1 to HISTORY_CYCLES */
	uint32_t pixels;                    /* 1 to HISTORY_PIXELS; no more than cycles are made */
	uint64_t end;                       /* cycle behind the last one; 0: the newest */
	uint32_t count;                     /* of channels, 0 to HISTORY_CHANNELS */
	uint32_t channel[HISTORY_CHANNELS]; /* indices in the table */
	/* The newest one, as far as the picture around it is complete and not behind @end. */
	struct trigger trigger;
};

enum history_mark {
	HISTORY_MISSING = 1, /* a cycle without a sample */
	HISTORY_BAD = 2,     /* a sample that is not good for a slave of these channels */
};

struct history_column {
	float min; /* NaN: no good sample */
	float max;
};

/* Of all good samples of a channel in the picture. */
struct history_sum {
	uint64_t count;
	double min;
	double max;
	double mean;
	double rms;
	double period; /* in cycles; NaN: less than one period */
};

struct history_picture {
	uint64_t first; /* cycle of the first column */
	uint64_t cycles;
	uint32_t pixels;
	int has_trigger;
	uint64_t trigger; /* cycle */
	uint64_t samples; /* that were read for it */
	struct history_sum sum[HISTORY_CHANNELS];
	struct history_column column[HISTORY_CHANNELS][HISTORY_PIXELS];
	uint8_t mark[HISTORY_PIXELS]; /* enum history_mark */
};

/** 0; -ENODATA: there is no sample; -EINVAL: a request out of its bounds; -EAGAIN: no trigger. */
int history_draw(struct history *h, const struct history_request *req, struct history_picture *p);

#endif
