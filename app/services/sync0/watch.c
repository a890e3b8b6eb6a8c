/* SPDX-License-Identifier: MIT */
#include "sync0/watch.h"

#include <errno.h>
#include <inttypes.h>
#include <poll.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "sync0/watch_internal.h"

enum { STEP_MS = 20, TEXT_BYTES = WATCH_WHY_BYTES };

#define RETRY_NS (2 * NS_PER_S)             /* between two tries to open what cannot be had */
#define STALL_NS NS_PER_S                   /* not having run for so long, edges are lost */
#define QUEUED_NS (5 * NS_PER_MS)           /* from interrupt to queue, at most */
#define SIMULATION_BEHIND_NS (2 * NS_PER_S) /* it writes its edges a little later */
#define SIMULATION_AHEAD_NS NS_PER_S        /* and never earlier: what is so is no edge */

int64_t watch_now_ns(const struct watch *w)
{
	return w->spec.platform.now(w->spec.platform.ctx).ns;
}

void watch_set_state(struct watch *w, enum sync0_state state)
{
	atomic_store_explicit(&output_page(w->out)->state, state, memory_order_relaxed);
}

int watch_has_source(const struct watch *w)
{
	if (w->lines == NULL) {
		return w->edges != NULL;
	}
	for (size_t i = 0; i < w->line_count; i++) {
		if (gpio_lines_is_open(w->lines, i)) {
			return 1;
		}
	}
	return 0;
}

/* --- lines --- */

static const char *line_text(const struct watch *w, size_t line)
{
	return w->lines == NULL ? w->spec.cfg->sync0_edges : gpio_lines_text(w->lines, line);
}

static int are_all_open(const struct watch *w)
{
	for (size_t i = 0; i < gpio_lines_count(w->lines); i++) {
		if (!gpio_lines_is_open(w->lines, i)) {
			return 0;
		}
	}
	return 1;
}

static void on_line(void *ctx, size_t line, const char *why)
{
	struct watch *w = ctx;
	const struct watch_line *wl = &w->line[line];
	struct sync0_line_status *ls = &output_page(w->out)->line[line];
	char text[TEXT_BYTES];

	ls->is_open = why == NULL;
	w->lines_changed = 1;
	ls->is_hte = (uint32_t)gpio_lines_is_hte(w->lines, line);
	if (why != NULL) {
		snprintf(text, sizeof(text), "line '%.95s' of slave %u: %s", line_text(w, line),
			 wl->slave_pos == EVENT_NO_SLAVE ? wl->item : wl->slave_pos, why);
		output_message(w->out, text);
	} else if (are_all_open(w)) {
		output_message(w->out, "");
	}
}

void watch_name_lines(struct watch *w)
{
	struct sync0_status *page = output_page(w->out);

	for (size_t i = 0; i < w->line_count; i++) {
		const struct watch_line *line = &w->line[i];
		struct sync0_line_status *ls = &page->line[i];
		const char *name = line->item < w->spec.cfg->slave_count
					   ? w->spec.cfg->slave[line->item].name
					   : "";

		ls->slave_pos = line->slave_pos;
		ls->is_open = (uint32_t)(w->lines == NULL ? w->edges != NULL
							  : gpio_lines_is_open(w->lines, i));
		ls->is_oneshot = (uint32_t)config_is_oneshot(w->spec.cfg, line->item);
		ls->cycle_ns = (uint32_t)line->cycle_ns;
		ls->shift_ns = (int32_t)line->shift_ns;
		snprintf(ls->line, sizeof(ls->line), "%.95s", line_text(w, i));
		snprintf(ls->slave, sizeof(ls->slave), "%.31s", name);
	}
	atomic_store_explicit(&page->line_count, (uint32_t)w->line_count, memory_order_relaxed);
}

/* --- making it --- */

static int have_lines(struct watch *w, char *why)
{
	const struct config *cfg = w->spec.cfg;

	if (cfg->sync0_edges[0] != '\0') {
		return 0;
	}
	w->lines = gpio_lines_create(cfg, w->spec.dev_dir);
	if (w->lines == NULL) {
		snprintf(why, TEXT_BYTES, "%s",
			 errno == ENOENT ? "no slave has a line: set slaves[].sync0_line"
					 : strerror(errno));
		return -errno;
	}
	for (size_t i = 0; i < gpio_lines_count(w->lines); i++) {
		uint16_t item = gpio_lines_item(w->lines, i);

		w->line[i] = (struct watch_line){ .item = item, .slave_pos = item };
	}
	w->line_count = gpio_lines_count(w->lines);
	return 0;
}

static void have_calibration(struct watch *w)
{
	const struct config *cfg = w->spec.cfg;
	struct sync0_status *page = output_page(w->out);
	int r;

	page->noise_p99_ns = -1;
	page->noise_sd_ns = -1;
	if (w->lines == NULL) {
		/* Its times are exact: what is seen is the segment's, not a wire's. */
		w->calibration.noise.is_known = 1;
		return;
	}
	r = calibration_load(cfg->sync0_calibration, &w->calibration);
	if (r < 0) {
		fprintf(stderr,
			"ecdaq-sync0: not calibrated (%s: %s): phase and skew are "
			"UNRESOLVED; see ecdaq sync0 calibrate\n",
			cfg->sync0_calibration, r == -EBADMSG ? "not a calibration" : strerror(-r));
		return;
	}
	w->calibration.noise.has_pair = w->line_count > 1 &&
					strcmp(w->calibration.first, line_text(w, 0)) == 0 &&
					strcmp(w->calibration.second, line_text(w, 1)) == 0;
	page->noise_p99_ns = w->calibration.noise.p99_ns;
	page->noise_sd_ns = w->calibration.noise.sd_ns;
}

int watch_create(const struct watch_spec *spec, struct watch **ret_watch, char *why)
{
	struct watch *w = calloc(1, sizeof(*w));
	int is_simulated = spec->cfg->sync0_edges[0] != '\0';
	int r;

	if (w == NULL) {
		snprintf(why, TEXT_BYTES, "%s", strerror(ENOMEM));
		return -ENOMEM;
	}
	w->spec = *spec;
	w->tried_ns = INT64_MIN / 2;
	r = config_run_path(spec->cfg, CONFIG_RUN_SAMPLES, w->master_path, CONFIG_PATH_BYTES);
	r = r < 0 ? r : have_lines(w, why);
	if (r < 0) {
		watch_destroy(w);
		return r;
	}
	w->out = output_create(spec->cfg, is_simulated ? SYNC0_SIMULATED : SYNC0_GPIO);
	w->master = master_create(w->master_path);
	if (w->out == NULL || w->master == NULL) {
		snprintf(why, TEXT_BYTES, "%s", strerror(errno));
		r = -errno;
		watch_destroy(w);
		return r;
	}
	output_page(w->out)->window_ns = spec->cfg->sync0_window_ns;
	have_calibration(w);
	watch_name_lines(w);
	r = output_open(w->out, why);
	if (r < 0 && r != -ENOENT) {
		watch_destroy(w);
		return r;
	}
	*ret_watch = w;
	return 0;
}

void watch_destroy(struct watch *w)
{
	if (w == NULL) {
		return;
	}
	checker_destroy(w->checker);
	master_destroy(w->master);
	gpio_lines_destroy(w->lines);
	edge_file_close(w->edges);
	output_destroy(w->out);
	free(w);
}

/* --- edges --- */

static void take_edge(void *ctx, const struct edge *edge)
{
	struct watch *w = ctx;

	if (w->spec.dump != NULL) {
		const struct sync0_line_status *ls = &output_page(w->out)->line[edge->line];

		fprintf(w->spec.dump, "%u %" PRId64 " %" PRId64 " %" PRIu32 "\n", ls->slave_pos,
			edge->mono_ns, edge->dc_ns, edge->seqno);
	}
	if (w->checker != NULL) {
		checker_edge(w->checker, edge);
	}
}

static void open_sources(struct watch *w)
{
	char text[TEXT_BYTES];
	size_t open;
	int r;

	if (watch_now_ns(w) - w->tried_ns < RETRY_NS) {
		return;
	}
	w->tried_ns = watch_now_ns(w);
	if (w->lines != NULL) {
		open = gpio_lines_open(w->lines, on_line, w);
		if (open == 0) {
			watch_set_state(w, SYNC0_NO_LINE);
		}
		return;
	}
	if (w->edges != NULL && edge_file_is_replaced(w->edges)) {
		edge_file_close(w->edges);
		w->edges = NULL;
		w->lines_changed = 1;
	}
	if (w->edges == NULL) {
		r = edge_file_open(w->spec.cfg->sync0_edges, EDGE_FILE_END, &w->edges);
		if (r < 0) {
			w->edges = NULL;
			snprintf(text, sizeof(text), "%.200s: %s", w->spec.cfg->sync0_edges,
				 strerror(-r));
			output_message(w->out, text);
			watch_set_state(w, SYNC0_NO_LINE);
		} else {
			w->since_ns = watch_now_ns(w);
			w->lines_changed = 1;
			output_message(w->out, "");
		}
	}
}

static void read_file(struct watch *w)
{
	int64_t limit_ns = watch_now_ns(w) + SIMULATION_AHEAD_NS;
	struct edge_item item;
	int r;

	while ((r = edge_file_next(w->edges, &item)) != 0) {
		uint64_t line;

		/* Part of a line of a file that was replaced is no edge, or one of another time. */
		if (r < 0 || item.kind != EDGE_ITEM_EDGE || item.edge.mono_ns > limit_ns) {
			continue;
		}
		w->newest_ns = item.edge.mono_ns > w->newest_ns ? item.edge.mono_ns : w->newest_ns;
		line = w->line_of_slave[item.edge.line];
		if (line > 0) {
			item.edge.line = (uint16_t)(line - 1);
			item.edge.dc_ns = 0; /* the check must find out by itself */
			take_edge(w, &item.edge);
		}
	}
}

/* All edges before this were read. */
static int64_t read_edges(struct watch *w)
{
	int64_t before_ns = watch_now_ns(w);

	if (w->lines != NULL) {
		gpio_lines_read(w->lines, take_edge, on_line, w);
		return before_ns - QUEUED_NS;
	}
	if (w->edges != NULL) {
		read_file(w);
	}
	return w->newest_ns > before_ns - SIMULATION_BEHIND_NS ? w->newest_ns - 1
							       : before_ns - SIMULATION_BEHIND_NS;
}

static void report_counts(struct watch *w)
{
	struct sync0_status *page = output_page(w->out);
	uint64_t windows = w->checker == NULL ? 0 : checker_windows(w->checker);
	uint64_t alarms = w->checker == NULL ? 0 : checker_alarms(w->checker);

	atomic_store_explicit(&page->windows, w->windows + windows, memory_order_relaxed);
	atomic_store_explicit(&page->alarms, w->alarms + alarms, memory_order_relaxed);
}

static void report_lines(struct watch *w)
{
	struct sync0_status *page = output_page(w->out);

	atomic_fetch_add_explicit(&page->heartbeat, 1, memory_order_relaxed);
	report_counts(w);
	if (w->checker == NULL) {
		return;
	}
	if (!watch_has_source(w)) {
		watch_set_state(w, SYNC0_NO_LINE);
	} else if (checker_windows(w->checker) > 0) {
		watch_set_state(w, SYNC0_RUNNING);
	}
	for (size_t i = 0; i < w->line_count; i++) {
		atomic_store_explicit(&page->line[i].is_lost,
				      (uint32_t)checker_is_lost(w->checker, i),
				      memory_order_relaxed);
	}
}

/* If the status page cannot be published, report the reason on standard error, once. */
static void open_output(struct watch *w)
{
	char why[OUTPUT_WHY_BYTES] = "";

	(void)output_open(w->out, why);
	if (strcmp(w->page_error, why) != 0) {
		memcpy(w->page_error, why, sizeof(w->page_error));
		if (why[0] != '\0') {
			fprintf(stderr, "ecdaq-sync0: waiting: %s\n", why);
		}
	}
}

/* The kernel's queue has run over meanwhile, and the file of edges may have a hole. */
static void look_for_stall(struct watch *w)
{
	int64_t now_ns = watch_now_ns(w);

	if (w->stepped_ns != 0 && now_ns - w->stepped_ns > STALL_NS && w->has_session) {
		fprintf(stderr,
			"ecdaq-sync0: did not run for %" PRId64
			" ms: what came meanwhile is not judged\n",
			(now_ns - w->stepped_ns) / NS_PER_MS);
		w->lines_changed = 1;
	}
	w->stepped_ns = now_ns;
}

void watch_step(struct watch *w)
{
	int64_t until_ns;
	int is_open;

	look_for_stall(w);
	open_output(w);
	open_sources(w);
	is_open = master_open(w->master);
	if (is_open == 1 && w->has_session && w->lines_changed) {
		watch_end_session(w);
	}
	if (is_open == 1 && !w->has_session) {
		watch_begin_session(w);
	}
	if (is_open == 1 && !watch_read_master(w)) {
		(void)read_edges(w);
		watch_end_session(w);
	}
	until_ns = read_edges(w);
	if (w->checker != NULL) {
		checker_advance(w->checker, until_ns);
	}
	report_lines(w);
	if (w->lines != NULL) {
		gpio_lines_wait(w->lines, STEP_MS);
	}
	/* Edges are taken in bunches: a thousand wake-ups a second would be of no use. */
	poll(NULL, 0, STEP_MS);
}

void watch_finish(struct watch *w)
{
	watch_end_session(w);
	report_lines(w);
	watch_set_state(w, SYNC0_ENDED);
}
