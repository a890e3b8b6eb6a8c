/* SPDX-License-Identifier: MIT */
/* One session of the master: its cycles go to a checker, the results to the readers. */
#include <errno.h>
#include <inttypes.h>
#include <stdio.h>
#include <string.h>

#include "base/clock.h"
#include "sync0/watch_internal.h"

/* A margin after the start, when edges are certainly received. */
#define SETTLE_NS (NS_PER_S / 10)

/* --- what comes out of the checker --- */

static void on_result(void *ctx, const struct sync0_result *r)
{
	struct watch *w = ctx;

	output_result(w->out, r);
}

static void on_event(void *ctx, const struct event *ev)
{
	struct watch *w = ctx;

	/* A pulse that belongs to no shot has no result of its own. */
	if (ev->id == EVENT_SYNC0_EXTRA && ev->line > 0 &&
	    output_page(w->out)->line[ev->line - 1].is_oneshot) {
		atomic_fetch_add_explicit(&output_page(w->out)->line[ev->line - 1].extra,
					  (uint64_t)ev->arg[0], memory_order_relaxed);
	}
	output_event(w->out, ev);
}

static void on_deviation(void *ctx, size_t line, int64_t ns)
{
	struct watch *w = ctx;

	histogram_add(&output_page(w->out)->line[line].deviation, ns);
}

/* A slave that a line would be needed for. */
static void note_beyond(struct watch *w, const struct slave_info *slave)
{
	struct sync0_status *page = output_page(w->out);

	if (atomic_fetch_add_explicit(&page->beyond_count, 1, memory_order_relaxed) == 0) {
		atomic_store_explicit(&page->beyond_pos, slave->slave_pos, memory_order_relaxed);
		snprintf(page->beyond_slave, sizeof(page->beyond_slave), "%s", slave->name);
	}
}

/* The line of a slave of this session; NULL: it has none. */
static struct watch_line *line_of(struct watch *w, const struct slave_info *slave)
{
	uint16_t item = slave->config_item > 0 ? slave->config_item - 1 : WATCH_NO_ITEM;

	if (w->lines == NULL) {
		/* A simulation has the edges of every slave with SYNC0: each is a line. */
		if (slave->sync0_cycle_ns == 0 &&
		    !(slave->has_dc && config_is_oneshot(w->spec.cfg, item))) {
			return NULL;
		}
		if (w->line_count == LIMIT_SYNC0_LINES) {
			note_beyond(w, slave);
			return NULL;
		}
		w->line[w->line_count].item = item;
		return &w->line[w->line_count++];
	}
	for (size_t i = 0; i < w->line_count; i++) {
		if (w->line[i].item == item) {
			return &w->line[i];
		}
	}
	return NULL;
}

/* Why a line is not checked; NULL: it is. */
static const char *why_unchecked(const struct watch *w, const struct watch_line *line)
{
	if (line->slave_pos == EVENT_NO_SLAVE) {
		return "its slave is absent";
	}
	if (config_is_oneshot(w->spec.cfg, line->item)) {
		return NULL;
	}
	if (line->cycle_ns == 0) {
		return "the master starts no SYNC0 in its slave";
	}
	return w->spec.cfg->sync0_window_ns / line->cycle_ns > CHECKER_PULSES_MAX
		       ? "the SYNC0 cycle of its slave is too short"
		       : NULL;
}

static void report_unchecked(struct watch *w)
{
	char text[WATCH_WHY_BYTES];
	const char *why = NULL;

	for (size_t i = 0; why == NULL && i < w->line_count; i++) {
		why = why_unchecked(w, &w->line[i]);
		if (why != NULL) {
			snprintf(text, sizeof(text), "line '%.95s' is not checked: %s (slaves[%u])",
				 output_page(w->out)->line[i].line, why, w->line[i].item);
			output_message(w->out, text);
		}
	}
	if (sync0_beyond_format(output_page(w->out), text, sizeof(text)) > 0) {
		fprintf(stderr, "ecdaq-sync0: %s\n", text);
	}
}

/* A slave is where the master has found it, which is not its place in slaves[] behind an absent
 * one. */
static void lines_of_session(struct watch *w)
{
	const struct sample_meta *meta = &master_table(w->master)->meta;
	const struct slave_info *slave = master_table(w->master)->slaves;
	struct sync0_status *page = output_page(w->out);

	memset(w->line_of_slave, 0, sizeof(w->line_of_slave));
	atomic_store_explicit(&page->beyond_count, 0, memory_order_relaxed);
	if (w->lines == NULL) {
		w->line_count = 0;
	}
	for (size_t i = 0; i < w->line_count; i++) {
		w->line[i] =
			(struct watch_line){ .item = w->line[i].item, .slave_pos = EVENT_NO_SLAVE };
	}
	for (uint32_t i = 0; i < meta->slave_count; i++) {
		struct watch_line *line = line_of(w, &slave[i]);

		if (line != NULL) {
			line->slave_pos = slave[i].slave_pos;
			line->cycle_ns = slave[i].sync0_cycle_ns;
			line->shift_ns = slave[i].sync0_shift_ns;
			w->line_of_slave[line->slave_pos] = (uint64_t)(line - w->line) + 1;
		}
	}
	watch_name_lines(w);
	for (uint32_t i = 0; i < meta->slave_count; i++) {
		uint64_t line = w->line_of_slave[slave[i].slave_pos];

		if (line > 0) {
			snprintf(page->line[line - 1].slave, sizeof(page->line[0].slave), "%.31s",
				 slave[i].name);
		}
	}
	report_unchecked(w);
}

static enum checker_mode mode_of(const struct watch *w, size_t line)
{
	if (!watch_has_source(w) || why_unchecked(w, &w->line[line]) != NULL ||
	    (w->lines != NULL && !gpio_lines_is_open(w->lines, line))) {
		return CHECKER_OFF;
	}
	return config_is_oneshot(w->spec.cfg, w->line[line].item) ? CHECKER_ONESHOT
								  : CHECKER_PERIODIC;
}

static void fill_lines(const struct watch *w, struct checker_spec *spec)
{
	spec->line_count = w->line_count;
	for (size_t i = 0; i < w->line_count; i++) {
		enum checker_mode mode = mode_of(w, i);

		spec->line[i] = (struct checker_line){
			.slave_pos = w->line[i].slave_pos,
			.mode = mode,
			.cycle_ns = mode == CHECKER_PERIODIC ? w->line[i].cycle_ns : 0,
			.shift_ns = mode == CHECKER_PERIODIC ? w->line[i].shift_ns : 0,
		};
	}
}

static void dump_lines(const struct watch *w, const struct checker_spec *spec)
{
	for (size_t i = 0; w->spec.dump != NULL && i < spec->line_count; i++) {
		if (spec->line[i].slave_pos != EVENT_NO_SLAVE) {
			edge_file_write_line(w->spec.dump, &spec->line[i],
					     output_page(w->out)->line[i].slave);
		}
	}
}

/* The master's period need not be that of our own configuration. */
static void fit_window(struct watch *w, struct checker_spec *spec)
{
	char text[WATCH_WHY_BYTES];

	if (checker_fit_window(spec)) {
		snprintf(text, sizeof(text),
			 "sync0.window is less than 100 cycles of the slowest SYNC0: %" PRId64
			 " ms are taken",
			 spec->window_ns / NS_PER_MS);
		output_message(w->out, text);
	}
	atomic_store_explicit(&output_page(w->out)->window_ns, spec->window_ns,
			      memory_order_relaxed);
}

static struct checker_spec session_spec(struct watch *w)
{
	const struct config *cfg = w->spec.cfg;
	const struct sample_meta *meta = &master_table(w->master)->meta;
	int64_t now = watch_now_ns(w);
	int64_t heard_ns = w->since_ns > now ? w->since_ns : now;
	struct checker_spec spec = {
		.period_ns = (int64_t)meta->period_ns,
		.window_ns = cfg->sync0_window_ns,
		.lost_ns = cfg->sync0_lost_ns,
		.since_ns = heard_ns + SETTLE_NS,
		.grid = CHECKER_GRID_MASTER,
		.source = w->lines == NULL ? SYNC0_SIMULATED : SYNC0_GPIO,
		.session = meta->session,
		.mono_to_tai_ns = w->spec.platform.tai_ns(w->spec.platform.ctx) - now,
		.limits = { .drift_ppb = cfg->sync0_drift_limit_ppm * 1000,
			    .rate_ppb = cfg->sync0_rate_limit_ppm * 1000,
			    .jitter_ns = cfg->sync0_jitter_limit_ns,
			    .phase_ns = cfg->sync0_phase_limit_ns,
			    .skew_ns = cfg->sync0_skew_limit_ns },
		.noise = w->calibration.noise,
		.result = on_result,
		.event = on_event,
		.deviation = on_deviation,
		.ctx = w,
	};

	fill_lines(w, &spec);
	fit_window(w, &spec);
	return spec;
}

void watch_begin_session(struct watch *w)
{
	struct checker_spec spec;
	struct slave_set shots = slave_set_empty();
	int r;

	w->has_session = 1;
	w->lines_changed = 0;
	lines_of_session(w);
	spec = session_spec(w);
	dump_lines(w, &spec);
	r = checker_create(&spec, &w->checker);
	if (r < 0) {
		w->checker = NULL;
		output_message(w->out,
			       r == -EINVAL ? "no slave of the segment has SYNC0" : strerror(-r));
		watch_set_state(w, SYNC0_NO_DC);
		return;
	}
	for (size_t i = 0; i < spec.line_count; i++) {
		if (spec.line[i].mode == CHECKER_ONESHOT) {
			slave_set_add(&shots, spec.line[i].slave_pos);
		}
	}
	master_watch_shots(w->master, &shots);
	watch_set_state(w, SYNC0_LEARNING);
}

void watch_end_session(struct watch *w)
{
	if (w->checker != NULL) {
		checker_finish(w->checker);
		w->windows += checker_windows(w->checker);
		w->alarms += checker_alarms(w->checker);
		checker_destroy(w->checker);
		w->checker = NULL;
	}
	w->has_session = 0;
	for (size_t i = 0; i < w->line_count; i++) {
		atomic_store_explicit(&output_page(w->out)->line[i].is_lost, 0,
				      memory_order_relaxed);
	}
	watch_set_state(w, SYNC0_WAITING);
}

static uint32_t state_of(const struct watch *w)
{
	return atomic_load_explicit(&output_page(w->out)->state, memory_order_relaxed);
}

static void take_cycle(struct watch *w, const struct master_item *item)
{
	const struct checker_cycle *cy = &item->cycle;

	if (!item->has_dc) {
		watch_set_state(w, SYNC0_NO_DC);
		return;
	}
	if (w->spec.dump != NULL) {
		fprintf(w->spec.dump,
			"c %" PRId64 " %" PRId64 " %" PRId64 " %" PRId64 " %" PRId64 " %" PRId64
			" %d\n",
			cy->cycle, cy->due_dc_ns, cy->frame_dc_ns, cy->frame_mono_ns,
			cy->frame_latency_ns, cy->dc_diff_ns, cy->is_judged);
	}
	if (w->checker == NULL) {
		return;
	}
	if (state_of(w) == SYNC0_NO_DC) {
		watch_set_state(w, SYNC0_LEARNING);
	}
	checker_cycle(w->checker, cy);
	for (size_t i = 0; i < item->shots; i++) {
		if (w->spec.dump != NULL) {
			fprintf(w->spec.dump, "s %u %" PRId64 " %" PRId64 "\n",
				item->shot[i].slave_pos, cy->due_dc_ns, item->shot[i].dc_ns);
		}
		checker_shot(w->checker, w->line_of_slave[item->shot[i].slave_pos] - 1,
			     cy->due_dc_ns, item->shot[i].dc_ns);
	}
}

int watch_read_master(struct watch *w)
{
	struct master_item item;
	int r;

	while ((r = master_next(w->master, &item)) == 1) {
		take_cycle(w, &item);
	}
	return r == 0;
}
