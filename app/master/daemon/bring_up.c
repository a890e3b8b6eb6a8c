/* SPDX-License-Identifier: MIT */
/* From nothing to OP, in the order that distributed clocks require (masters' sequence: filters,
 * delays, offsets, burst; then the cyclic frame and the servo's lock; then one common SYNC0; then
 * SAFE-OP, OP). */
#include <errno.h>
#include <inttypes.h>
#include <stdio.h>
#include <string.h>

#include "daemon/session.h"
#include "daemon/session_internal.h"
#include "esi/library.h"
#include "link/capture.h"

enum {
	FILE_MODE = 0640,
	META_BYTES_MAX = sizeof(struct sample_meta) + LIMIT_SLAVES * sizeof(struct slave_info) +
		LIMIT_CHANNELS * sizeof(struct channel),
};

/* --- the control program --- */

/* Before any access to the segment: a wrong path is wrong with any slaves. */
static int load_control(struct session *s, struct failure *failure)
{
	char error[FAILURE_TEXT_BYTES] = "";
	int r;

	if (s->spec.cfg->control_program[0] == '\0') {
		return 0;
	}
	r = control_load(s->spec.cfg, &s->control, error, sizeof(error));
	return r < 0 ? failure_set(failure, r == -ENOMEM ? EXIT_CODE_RESOURCES : EXIT_CODE_CONFIG,
				   r, "%s", error)
		     : 0;
}

static int begin_control(struct session *s, struct failure *failure)
{
	struct control_spec spec = { .platform = s->spec.platform,
				     .status = &s->run.page->control };
	char error[FAILURE_TEXT_BYTES] = "";
	int r;

	if (s->control == NULL) {
		return 0;
	}
	spec.channels = bus_channels(s->bus, &spec.channel_count);
	bus_slaves(s->bus, &spec.slave_count);
	r = control_begin(s->control, &spec, error, sizeof(error));
	return r < 0 ? failure_set(failure, EXIT_CODE_CONFIG, r, "%s", error) : 0;
}

/* --- the slaves --- */

/* While this thread sends or waits: a sign of life, and the admin socket. */
static void attend(void *ctx)
{
	struct session *s = ctx;

	if (s->spec.hooks.alive != NULL) {
		s->spec.hooks.alive(s->spec.hooks.ctx);
	}
	if (s->is_climbing) { /* else the service loop does it in a moment */
		session_serve_admin(s);
	}
}

static void warn_of_esi(void *ctx, const char *text)
{
	const struct session *s = ctx;
	char line[FAILURE_TEXT_BYTES];

	if (s->spec.hooks.warn != NULL) {
		snprintf(line, sizeof(line), "bus.esi_dir: %.280s", text);
		s->spec.hooks.warn(s->spec.hooks.ctx, line);
	}
}

/* At each scan: files may have been added. */
static const struct esi_library *load_esi(void *ctx, const struct esi_identity *wanted,
					  size_t count)
{
	struct session *s = ctx;
	const struct esi_library_report report = { .bad = warn_of_esi, .ctx = s };

	esi_library_free(s->esi);
	s->esi = esi_library_read(s->spec.cfg->bus_esi_dir, wanted, count, &report);
	return s->esi;
}

static int open_line(struct session *s, struct failure *failure)
{
	struct transport transport;
	int r = s->spec.hooks.transport_open(s->spec.hooks.ctx, &transport, failure);

	if (r < 0) {
		return r;
	}
	s->is_link_up = transport.is_up == NULL || transport.is_up(transport.ctx) != 0;
	session_show_link(s);
	transport = capture_wrap(s->capture, transport);
	r = line_create(s->spec.platform, transport, &s->line);
	if (r < 0) {
		transport.destroy(transport.ctx);
		return failure_set(failure, EXIT_CODE_RESOURCES, r, "line: %s", strerror(-r));
	}
	line_bind(s->line);
	line_timeout_set(s->line, (span_t){ s->spec.cfg->bus_frame_timeout_ns });
	line_set_keepalive(s->line, attend, s);
	s->stop_by = (mono_t){ 0 };
	line_set_cancel(s->line, session_is_cancelled, s);
	r = bus_create(s->spec.cfg, s->line, &s->bus);
	if (r < 0) {
		return failure_set(failure, EXIT_CODE_RESOURCES, r, "bus: %s", strerror(-r));
	}
	bus_listen(s->bus, session_bus_event, s);
	if (s->spec.cfg->bus_esi_dir[0] != '\0') {
		bus_use_esi(s->bus, &(struct bus_esi){ .load = load_esi, .ctx = s });
	}
	return 0;
}

static void show_group(struct session *s, size_t pos)
{
	const struct config *cfg = bus_config(s->bus);
	char *group = s->run.page->slave[pos].group;

	memset(group, 0, sizeof(s->run.page->slave[pos].group));
	if (pos < cfg->slave_count) {
		memcpy(group, cfg->slave[pos].group, sizeof(cfg->slave[pos].group));
	}
}

static void show_slaves(struct session *s)
{
	size_t count;
	const struct slave_info *slaves = bus_slaves(s->bus, &count);

	for (size_t i = 0; i < count && i < LIMIT_SLAVES; i++) {
		s->run.page->slave[i].info = slaves[i];
		show_group(s, i);
	}
	bus_show_places(s->bus, s->run.page);
	atomic_store_explicit(&s->run.page->slave_count, (uint32_t)count, memory_order_release);
}

static int prepare_slaves(struct session *s, struct failure *failure)
{
	char error[BUS_ERROR_BYTES] = "";
	int r;

	session_state_set(s, BUS_SCANNING);
	r = session_step(s, bus_scan(s->bus, error), EXIT_CODE_STATE, error, failure);
	show_slaves(s);
	if (r < 0) {
		return r;
	}
	session_judge_doubled(s, line_answered(s->line), line_discarded(s->line));
	r = session_step(s, bus_compare(s->bus, error), EXIT_CODE_SLAVES, error, failure);
	if (r < 0) {
		return r;
	}
	r = session_step(s, bus_startup(s->bus, CONFIG_TRANSITION_IP, error), EXIT_CODE_STATE,
			 error, failure);
	if (r < 0) {
		return r;
	}
	session_state_set(s, BUS_PREOP);
	return 0;
}

static int map_slaves(struct session *s, struct failure *failure)
{
	char error[BUS_ERROR_BYTES] = "";
	int r;

	r = session_step(s, bus_map(s->bus, error), EXIT_CODE_STATE, error, failure);
	if (r < 0) {
		return r;
	}
	r = session_step(s, bus_dc_setup(s->bus, error), EXIT_CODE_CLOCKS, error, failure);
	if (r < 0) {
		return r;
	}
	show_slaves(s); /* now with delays and the reference */
	return 0;
}

/* --- ring and cycle --- */

static size_t write_meta(const struct session *s, uint8_t *meta)
{
	const struct exchange_plan *plan = bus_plan(s->bus);
	size_t slave_count;
	size_t channel_count;
	const struct slave_info *slaves = bus_slaves(s->bus, &slave_count);
	const struct channel *channels = bus_channels(s->bus, &channel_count);
	struct sample_meta head = {
		.version = SAMPLE_VERSION,
		.slave_count = (uint32_t)slave_count,
		.channel_count = (uint32_t)channel_count,
		.image_bytes = plan->image_bytes,
		.output_bytes = plan->output_bytes,
		.tai_offset_s = s->spec.tai_offset_s,
		.period_ns = (uint64_t)s->spec.cfg->cycle_period_ns,
		.session = s->run.page->session,
	};
	size_t slaves_bytes = slave_count * sizeof(*slaves);
	size_t channels_bytes = channel_count * sizeof(*channels);

	memcpy(meta, &head, sizeof(head));
	memcpy(meta + sizeof(head), slaves, slaves_bytes);
	memcpy(meta + sizeof(head) + slaves_bytes, channels, channels_bytes);
	return sizeof(head) + slaves_bytes + channels_bytes;
}

static int make_samples(struct session *s, struct failure *failure)
{
	static uint8_t meta[META_BYTES_MAX]; /* one session in a process brings up at a time */
	char path[CONFIG_PATH_BYTES + 16];
	const struct exchange_plan *plan = bus_plan(s->bus);
	struct ring_spec spec = {
		.path = path,
		.kind = "sample",
		.payload_bytes = sample_head_bytes(plan->slave_count) + plan->image_bytes,
		.slot_count = (uint64_t)(s->spec.cfg->ring_depth_ns / s->spec.cfg->cycle_period_ns),
		.meta = meta,
		.meta_bytes = write_meta(s, meta),
		.period_ns = (uint64_t)s->spec.cfg->cycle_period_ns,
		.file_mode = FILE_MODE,
	};
	int r = run_dir_path(&s->run, CONFIG_RUN_SAMPLES, path, sizeof(path));

	if (r == 0) {
		r = ring_create(&spec, &s->samples);
	}
	if (r < 0) {
		return failure_set(failure,
				   r == -EACCES || r == -EPERM ? EXIT_CODE_PERMISSION
							       : EXIT_CODE_RESOURCES,
				   r, "%s: %s%s", path, strerror(-r),
				   r == -ENOSPC ? " (a smaller ring.depth needs less)" : "");
	}
	return 0;
}

static void show_schedule(struct session *s)
{
	const struct schedule *sc = bus_schedule(s->bus);
	char text[FAILURE_TEXT_BYTES];

	atomic_store_explicit(&s->run.page->cycle.frames_need_ns, sc->need_ns,
			      memory_order_relaxed);
	if (sc->need_ns * 2 > sc->allowed_ns && s->spec.hooks.warn != NULL) {
		snprintf(text, sizeof(text),
			 "the cyclic frames need %" PRId64 " us of the %" PRId64
			 " us that cycle.receive allows: late wake-ups will lose frames; the "
			 "smallest cycle.period that works is %" PRId64 "us",
			 sc->need_ns / NS_PER_US, sc->allowed_ns / NS_PER_US,
			 sc->smallest_period_ns / NS_PER_US);
		s->spec.hooks.warn(s->spec.hooks.ctx, text);
	}
}

static int make_cycle(struct session *s, struct failure *failure)
{
	char error[FAILURE_TEXT_BYTES] = "";
	struct cycle_spec spec = {
		.cfg = bus_config(s->bus),
		.platform = session_cycle_platform(s),
		.plan = bus_plan(s->bus),
		.samples = s->samples,
		.events = s->run.events,
		.stats = &s->run.page->cycle,
		.boards = { [CYCLE_WRITER_LOCAL] = &s->board,
			    [CYCLE_WRITER_REMOTE] = s->run.remote },
	};
	int r = exchange_create(spec.plan, s->line, &s->exchange);

	if (r < 0) {
		return failure_set(failure, failure_code_of_bus(r, EXIT_CODE_MAPPING), r,
				   "exchange: %s", strerror(-r));
	}
	spec.exchange = s->exchange;
	spec.slaves = bus_slaves(s->bus, &spec.slave_count);
	spec.channels = bus_channels(s->bus, &spec.channel_count);
	board_init(&s->board);
	board_init(s->run.remote);
	if (s->control != NULL) {
		spec.control = s->control;
		spec.boards[CYCLE_WRITER_PROGRAM] = control_board(s->control);
	}
	memset(&s->run.page->cycle, 0, sizeof(s->run.page->cycle));
	show_schedule(s);
	r = cycle_create(&spec, &s->cycle, error, sizeof(error));
	if (r < 0) {
		return failure_set(failure, r == -ENOMEM ? EXIT_CODE_RESOURCES : EXIT_CODE_CONFIG,
				   r, "%s", error[0] != '\0' ? error : strerror(-r));
	}
	return 0;
}

static void line_wait(void *ctx, mono_t until)
{
	struct session *s = ctx;

	s->spec.hooks.wait(s->spec.hooks.ctx, until);
	session_listen(s);
	if (s->spec.hooks.alive != NULL) {
		s->spec.hooks.alive(s->spec.hooks.ctx);
	}
}

static int start_cycle(struct session *s, struct failure *failure)
{
	int r;

	line_ride_begin(s->line, (struct line_waiter){ .wait = line_wait, .ctx = s });
	s->is_riding = 1;
	r = s->spec.hooks.cycle_start(s->spec.hooks.ctx, s->cycle, failure);
	if (r < 0) {
		s->is_riding = 0;
		line_ride_end(s->line);
	}
	return r;
}

/* --- all of it --- */

static void arrive(struct session *s)
{
	size_t count;
	struct event ev = {
		.id = EVENT_STARTED,
		.slave_pos = EVENT_NO_SLAVE,
		.value = s->spec.cfg->cycle_period_ns,
	};

	bus_slaves(s->bus, &count);
	ev.arg[0] = (int32_t)count;
	cycle_phase_set(s->cycle, CYCLE_OP);
	s->lost_since = (mono_t){ 0 };
	s->wkc_low_seen = 0;
	s->silent_cycles = 0;
	s->is_partial = 0;
	s->doubled_since = 0;
	s->doubled_seen = 0;
	s->cycles_seen = atomic_load_explicit(&s->run.page->cycle.cycles, memory_order_relaxed);
	s->lost_seen = atomic_load_explicit(&s->run.page->cycle.frames_lost, memory_order_relaxed);
	s->next_watch = session_now(s);
	session_state_set(s, BUS_OP);
	session_set_message(s, "");
	session_emit(s, &ev);
}

/* From PRE-OP on: process data. */
static int start_exchange(struct session *s, struct failure *failure)
{
	int r = map_slaves(s, failure);

	if (r == 0) {
		r = begin_control(s, failure);
	}
	if (r == 0) {
		r = make_samples(s, failure);
	}
	if (r == 0) {
		r = make_cycle(s, failure);
	}
	if (r == 0) {
		r = start_cycle(s, failure);
	}
	return r == 0 ? session_lead_to_op(s, failure) : r;
}

static int go_to_init(struct session *s, struct failure *failure)
{
	span_t timeout = { s->spec.cfg->bus_scan_timeout_ns };
	char error[BUS_ERROR_BYTES] = "";
	int r = session_step(s, bus_request_state(s->bus, AL_INIT, timeout, error), EXIT_CODE_STATE,
			     error, failure);

	if (r == 0) {
		session_state_set(s, BUS_INIT);
	}
	return r;
}

static int climb(struct session *s, struct failure *failure)
{
	int r = load_control(s, failure);

	if (r == 0) {
		r = open_line(s, failure);
	}
	if (r == 0) {
		r = prepare_slaves(s, failure);
	}
	if (r == 0 && s->target == CONFIG_TARGET_INIT) {
		return go_to_init(s, failure);
	}
	return r == 0 && s->target > CONFIG_TARGET_PREOP ? start_exchange(s, failure) : r;
}

static void fall(struct session *s, const struct failure *failure)
{
	struct failure ignored;

	if (session_hold_failed(s, failure)) {
		return;
	}
	session_set_message(s, failure->text);
	if (failure->code == EXIT_CODE_INTERFACE || failure->code == EXIT_CODE_NO_SLAVE) {
		session_drop(s); /* no slave to restore */
	} else {
		session_stop(s, &ignored);
	}
	session_state_set(s, BUS_DOWN);
}

int session_bring_up(struct session *session, struct failure *failure)
{
	struct session *s = session;
	struct failure ignored;
	int r;

	if (s->line != NULL) {
		session_stop(s, &ignored);
	}
	session_release(s);
	session_take_reloaded(s);
	s->run.page->session = (uint64_t)s->spec.platform.tai_ns(s->spec.platform.ctx);
	s->is_climbing = 1;
	r = climb(s, failure);
	s->is_climbing = 0;
	if (r < 0) {
		fall(s, failure);
	} else if (s->target == CONFIG_TARGET_OP) {
		arrive(s);
	} else {
		session_hold(s);
	}
	session_restart_done(s, r < 0 ? failure : NULL);
	return r;
}
