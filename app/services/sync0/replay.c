/* SPDX-License-Identifier: MIT */
#include "sync0/replay.h"

#include <errno.h>
#include <inttypes.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "sync0/calibration.h"
#include "sync0/checker.h"
#include "sync0/edge_file.h"
#include "sync0/print.h"

enum { WHY_BYTES = 512, ADVANCE_EDGES = 64 };

/* What the file holds, seen in a first pass. */
struct contents {
	uint64_t edges[LIMIT_SLAVES];
	uint64_t shots[LIMIT_SLAVES];
	struct edge_item line[LIMIT_SLAVES]; /* EDGE_ITEM_NONE: not recorded */
	uint64_t cycles;
	int64_t first_ns;
	int64_t cycle_first; /* with its due time, and the last one: they give the period */
	int64_t cycle_first_dc_ns;
	int64_t cycle_last;
	int64_t cycle_last_dc_ns;
};

struct replay_run {
	const struct replay_spec *spec;
	struct checker *checker;
	uint64_t line_of_slave[LIMIT_SLAVES]; /* plus one */
	unsigned beyond;                      /* slaves that have no line */
	uint64_t windows;
	uint64_t bad;
};

static void on_result(void *ctx, const struct sync0_result *r)
{
	struct replay_run *run = ctx;

	run->windows++;
	run->bad += r->verdict == SYNC0_FAIL;
	if (run->spec->form == REPLAY_JSON) {
		print_result_json(r, run->spec->out);
	} else {
		print_result(r, run->spec->out);
	}
}

static void on_event(void *ctx, const struct event *ev)
{
	struct replay_run *run = ctx;

	run->bad += event_severity(ev->id) == EVENT_ERROR;
	if (run->spec->form == REPLAY_JSON) {
		print_event_json(ev, run->spec->out);
	} else {
		print_event(ev, run->spec->out);
	}
}

/* Every item of the file to @take. 0 or -errno. */
static int each(const char *path, void (*take)(void *ctx, const struct edge_item *item), void *ctx,
		char *why)
{
	struct edge_file *ef;
	struct edge_item item;
	int r = edge_file_open(path, EDGE_FILE_START, &ef);

	if (r < 0) {
		snprintf(why, WHY_BYTES, "%.200s: %s", path,
			 r == -ESPIPE ? "is no regular file, and is read more than once"
				      : strerror(-r));
		return r;
	}
	while ((r = edge_file_next(ef, &item)) == 1) {
		take(ctx, &item);
	}
	if (r < 0) {
		snprintf(why, WHY_BYTES,
			 "%.200s:%" PRIu64 ": is no line of edges (SLAVE MONO_NS [DC_NS [SEQNO]])",
			 path, edge_file_line(ef));
	}
	edge_file_close(ef);
	return r;
}

static void look(void *ctx, const struct edge_item *item)
{
	struct contents *c = ctx;

	if (item->kind == EDGE_ITEM_EDGE) {
		c->edges[item->edge.line]++;
		c->first_ns = c->first_ns == 0 ? item->edge.mono_ns : c->first_ns;
	} else if (item->kind == EDGE_ITEM_SHOT) {
		c->shots[item->shot.slave_pos]++;
	} else if (item->kind == EDGE_ITEM_LINE) {
		c->line[item->line.slave_pos] = *item;
	} else if (c->cycles++ == 0) {
		c->cycle_first = item->cycle.cycle;
		c->cycle_first_dc_ns = item->cycle.due_dc_ns;
	} else {
		c->cycle_last = item->cycle.cycle;
		c->cycle_last_dc_ns = item->cycle.due_dc_ns;
	}
}

static void feed(void *ctx, const struct edge_item *item)
{
	struct replay_run *run = ctx;
	struct edge edge = item->edge;

	if (item->kind == EDGE_ITEM_LINE) {
		return;
	}
	if (item->kind == EDGE_ITEM_CYCLE) {
		checker_cycle(run->checker, &item->cycle);
		return;
	}
	if (item->kind == EDGE_ITEM_SHOT) {
		checker_shot(run->checker, run->line_of_slave[item->shot.slave_pos] - 1,
			     item->shot.at_dc_ns, item->shot.due_dc_ns);
		return;
	}
	edge.line = (uint16_t)(run->line_of_slave[edge.line] - 1);
	checker_edge(run->checker, &edge);
	/* Lines are written in bunches, one after the other: look back a little. */
	checker_advance(run->checker, edge.mono_ns - NS_PER_S / 2);
}

static int has_config_period(const struct contents *c, int64_t *ret_period_ns)
{
	int64_t cycles = c->cycle_last - c->cycle_first;

	if (c->cycles < 2 || cycles <= 0) {
		return 0;
	}
	*ret_period_ns = (c->cycle_last_dc_ns - c->cycle_first_dc_ns) / cycles;
	return 1;
}

/* As recorded; else that of the configuration's slave at the same position. */
static struct checker_line line_of(const struct replay_run *run, const struct contents *c,
				   uint16_t pos)
{
	const struct config *cfg = run->spec->cfg;
	int is_oneshot = c->shots[pos] > 0 || config_is_oneshot(cfg, pos);

	if (c->line[pos].kind == EDGE_ITEM_LINE) {
		return c->line[pos].line;
	}
	return (struct checker_line){
		.slave_pos = pos,
		.mode = is_oneshot ? CHECKER_ONESHOT : CHECKER_PERIODIC,
		.shift_ns = cfg->slave[pos].sync0_shift_ns,
	};
}

static void fill_lines(struct replay_run *run, const struct contents *c, struct checker_spec *spec)
{
	for (uint16_t pos = 0; pos < LIMIT_SLAVES; pos++) {
		if (c->edges[pos] + c->shots[pos] == 0) {
			continue;
		}
		if (spec->line_count == LIMIT_SYNC0_LINES) {
			run->beyond++;
			continue;
		}
		run->line_of_slave[pos] = spec->line_count + 1;
		spec->line[spec->line_count++] = line_of(run, c, pos);
		if (c->line[pos].kind == EDGE_ITEM_LINE && run->spec->form == REPLAY_JSON) {
			print_line_json(&c->line[pos], run->spec->out);
		} else if (c->line[pos].kind == EDGE_ITEM_LINE) {
			print_line(&c->line[pos], run->spec->out);
		}
	}
	if (run->beyond > 0) {
		fprintf(stderr,
			"ecdaq-sync0: %s: not checked: the edges of %u slaves behind slave %u: "
			"only %d lines\n",
			run->spec->path, run->beyond, spec->line[LIMIT_SYNC0_LINES - 1].slave_pos,
			LIMIT_SYNC0_LINES);
	}
}

static struct checker_spec spec_of(struct replay_run *run, const struct contents *c)
{
	const struct config *cfg = run->spec->cfg;
	struct calibration calibration = { .noise = { .is_known = 0 } };
	struct checker_spec spec = {
		.period_ns = cfg->cycle_period_ns,
		.window_ns = cfg->sync0_window_ns,
		.lost_ns = cfg->sync0_lost_ns,
		.since_ns = c->first_ns,
		.grid = c->cycles > 0 ? CHECKER_GRID_MASTER : CHECKER_GRID_EDGES,
		.source = SYNC0_RECORDED,
		.limits = { .drift_ppb = cfg->sync0_drift_limit_ppm * 1000,
			    .rate_ppb = cfg->sync0_rate_limit_ppm * 1000,
			    .jitter_ns = cfg->sync0_jitter_limit_ns,
			    .phase_ns = cfg->sync0_phase_limit_ns,
			    .skew_ns = cfg->sync0_skew_limit_ns },
		.result = on_result,
		.event = on_event,
		.ctx = run,
	};

	(void)has_config_period(c, &spec.period_ns);
	if (calibration_load(cfg->sync0_calibration, &calibration) == 0) {
		spec.noise = calibration.noise;
	}
	fill_lines(run, c, &spec);
	(void)checker_fit_window(&spec);
	return spec;
}

int replay(const struct replay_spec *spec, enum replay_outcome *ret_outcome, char *why)
{
	struct replay_run run = { .spec = spec };
	struct contents contents = { .cycles = 0 };
	struct checker_spec checker;
	int r = each(spec->path, look, &contents, why);

	if (r < 0) {
		return r;
	}
	checker = spec_of(&run, &contents);
	if (checker.line_count == 0) {
		snprintf(why, WHY_BYTES, "%.200s: holds no edge", spec->path);
		return -ENODATA;
	}
	r = checker_create(&checker, &run.checker);
	if (r < 0) {
		snprintf(why, WHY_BYTES, "%.200s: %s", spec->path,
			 r == -EINVAL ? "a SYNC0 cycle is too short for sync0.window"
				      : strerror(-r));
		return r;
	}
	r = each(spec->path, feed, &run, why);
	if (r == 0) {
		checker_finish(run.checker);
		if (run.windows == 0) {
			snprintf(why, WHY_BYTES,
				 "%.200s: too short for one window of %" PRId64
				 " ms (sync0.window)",
				 spec->path, checker.window_ns / NS_PER_MS);
			r = -ENODATA;
		}
	}
	checker_destroy(run.checker);
	if (r == 0) {
		*ret_outcome = run.bad > 0 ? REPLAY_BAD : REPLAY_GOOD;
	}
	return r;
}

/* --- calibration --- */

struct collected {
	int64_t *at_ns[2];
	size_t count[2];
	size_t capacity;
	uint16_t slave[2];
	unsigned lines;
	int is_backwards; /* a time before that of the edge before */
};

static void collect(void *ctx, const struct edge_item *item)
{
	struct collected *c = ctx;
	unsigned n = 0;

	if (item->kind != EDGE_ITEM_EDGE) {
		return;
	}
	while (n < 2 && n < c->lines && c->slave[n] != item->edge.line) {
		n++;
	}
	if (n == c->lines && n < 2) {
		c->slave[n] = item->edge.line;
		c->lines = n + 1;
	}
	if (n < 2 && c->count[n] < c->capacity) {
		c->is_backwards |=
			c->count[n] > 0 && item->edge.mono_ns < c->at_ns[n][c->count[n] - 1];
		c->at_ns[n][c->count[n]++] = item->edge.mono_ns;
	}
}

int replay_calibrate(const char *path, const char *save_to, FILE *out, char *why)
{
	struct contents contents = { .cycles = 0 };
	struct collected c = { .lines = 0 };
	struct calibration calibration;
	char reason[CALIBRATION_WHY_BYTES] = "";
	int r = each(path, look, &contents, why);

	for (unsigned i = 0; i < LIMIT_SLAVES; i++) {
		c.capacity += contents.edges[i];
	}
	if (r < 0) {
		return r;
	}
	c.at_ns[0] = calloc(c.capacity + 1, sizeof(int64_t));
	c.at_ns[1] = calloc(c.capacity + 1, sizeof(int64_t));
	r = c.at_ns[0] == NULL || c.at_ns[1] == NULL ? -ENOMEM : each(path, collect, &c, why);
	if (r == 0 && c.is_backwards) {
		snprintf(why, WHY_BYTES, "%.200s: the edges are not in order of time", path);
		r = -EBADMSG;
	}
	if (r == 0) {
		r = calibration_compute(c.at_ns[0], c.count[0], c.at_ns[1], c.count[1],
					&calibration, why);
	}
	free(c.at_ns[0]);
	free(c.at_ns[1]);
	if (r < 0) {
		return r;
	}
	snprintf(calibration.first, sizeof(calibration.first), "slave %u", c.slave[0]);
	snprintf(calibration.second, sizeof(calibration.second), "slave %u", c.slave[1]);
	print_calibration(&calibration, out);
	r = calibration_save(save_to, &calibration, reason);
	if (r < 0) {
		snprintf(why, WHY_BYTES, "%.200s: %.200s", save_to, reason);
	}
	return r;
}
