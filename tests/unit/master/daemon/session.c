/* SPDX-License-Identifier: MIT */
/* The session against a bus that fails where the test chooses. */
#include "daemon/session.h"

#include <errno.h>
#include <ftw.h>
#include <grp.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include "base/admin_protocol.h"
#include "harness/test.h"
#include "unit/master/daemon/fake_bus.h"

struct bench {
	char dir[64];
	struct config cfg;
	struct session *session;
	struct cycle *cycle; /* NULL: does not run */
	int ends_after;      /* steps; the cycle ends by itself then; 0: never */
	int result;
	int open_fails;
	unsigned warnings;
	char warning[256];
};

static int open_transport(void *ctx, struct transport *ret_transport, struct failure *failure)
{
	const struct bench *b = ctx;

	if (b->open_fails) {
		return failure_set(failure, EXIT_CODE_INTERFACE, -ENODEV,
				   "eth9: no such interface");
	}
	*ret_transport = fake_transport();
	return 0;
}

static int start_cycle(void *ctx, struct cycle *cycle, struct failure *failure)
{
	struct bench *b = ctx;

	(void)failure;
	b->cycle = cycle;
	return 0;
}

static int end_cycle(void *ctx)
{
	struct bench *b = ctx;

	b->cycle = NULL;
	return b->result;
}

static int has_cycle_ended(void *ctx)
{
	const struct bench *b = ctx;

	return b->ends_after == 1;
}

static void advance_clock(void *ctx, mono_t until)
{
	struct bench *b = ctx;

	if (b->cycle == NULL) {
		fake_bus.mono_ns = until.ns;
		return;
	}
	cycle_step(b->cycle);
	b->ends_after -= b->ends_after > 1;
}

static void warn(void *ctx, const char *text)
{
	struct bench *b = ctx;

	b->warnings++;
	snprintf(b->warning, sizeof(b->warning), "%s", text);
}

static void bench_prepare(struct bench *b)
{
	memset(b, 0, sizeof(*b));
	fake_bus_init();
	config_defaults(&b->cfg);
	b->cfg.ring_depth_ns = NS_PER_S;
	snprintf(b->dir, sizeof(b->dir), "/dev/shm/ecdaqd-session-XXXXXX");
	CHECK(mkdtemp(b->dir) != NULL);
	snprintf(b->cfg.run_dir, sizeof(b->cfg.run_dir), "%s", b->dir);
}

static void bench_begin(struct bench *b)
{
	struct failure failure;
	struct session_spec spec = {
		.cfg = &b->cfg,
		.platform = fake_platform(),
		.hooks = { .transport_open = open_transport,
			   .cycle_start = start_cycle,
			   .cycle_end = end_cycle,
			   .cycle_has_ended = has_cycle_ended,
			   .wait = advance_clock,
			   .warn = warn,
			   .ctx = b },
		.segment = RUN_DIR_SIMULATED,
	};

	CHECK_EQ(session_create(&spec, &b->session, &failure), 0);
}

static void bench_open(struct bench *b)
{
	bench_prepare(b);
	bench_begin(b);
}

static int forget(const char *path, const struct stat *st, int kind, struct FTW *ftw)
{
	(void)st;
	(void)kind;
	(void)ftw;
	return remove(path);
}

static void bench_close(struct bench *b)
{
	session_destroy(b->session);
	CHECK_EQ(fake_bus.transports, 0);
	CHECK_EQ(nftw(b->dir, forget, 8, FTW_DEPTH | FTW_PHYS), 0);
}

static uint32_t state_of(const struct bench *b)
{
	return atomic_load(&session_page(b->session)->bus_state);
}

static const char *message_of(const struct bench *b)
{
	return session_page(b->session)->message; /* no other writer at this time */
}

/* @steps cycles with the service loop between them; its last result. */
static int run(struct bench *b, unsigned steps, struct failure *failure)
{
	int r = SESSION_GOES_ON;

	for (unsigned i = 0; i < steps && r == SESSION_GOES_ON; i++) {
		advance_clock(b, (mono_t){ fake_bus.mono_ns + NS_PER_MS });
		r = session_service(b->session, failure);
	}
	return r;
}

TEST(session, it_reaches_op_in_order_and_leaves_it_in_order)
{
	static struct bench b;
	struct failure failure;

	bench_open(&b);
	CHECK_EQ(state_of(&b), BUS_DOWN);
	CHECK_EQ(session_bring_up(b.session, &failure), 0);
	CHECK_EQ(state_of(&b), BUS_OP);
	CHECK_STR(fake_bus.steps, "scan compare map dc_setup sync0 safeop op ");
	CHECK_EQ(atomic_load(&session_page(b.session)->cycle.dc_state), DC_LOCKED);
	CHECK_EQ(atomic_load(&session_page(b.session)->slave_count), 1);
	CHECK_EQ(run(&b, 100, &failure), SESSION_GOES_ON);
	CHECK_EQ(session_stop(b.session, &failure), 0);
	CHECK_STR(fake_bus.steps, "scan compare map dc_setup sync0 safeop op safeop stop ");
	session_conclude(b.session, NULL);
	CHECK_EQ(state_of(&b), BUS_STOPPED);
	CHECK_EQ(atomic_load(&session_page(b.session)->exit_code), 0);
	bench_close(&b);
}

TEST(session, the_next_cycle_is_known_while_the_cycle_sleeps_and_not_without_one)
{
	static struct bench b;
	struct failure failure;

	bench_open(&b);
	CHECK_EQ(session_next_cycle(b.session).ns, 0);
	CHECK_EQ(session_bring_up(b.session, &failure), 0);
	CHECK(session_next_cycle(b.session).ns > fake_bus.mono_ns);
	CHECK(session_next_cycle(b.session).ns <= fake_bus.mono_ns + 2 * b.cfg.cycle_period_ns);
	CHECK_EQ(session_stop(b.session, &failure), 0);
	CHECK_EQ(session_next_cycle(b.session).ns, 0);
	bench_close(&b);
}

TEST(session, each_step_of_bring_up_fails_with_its_code_its_line_and_nothing_left_behind)
{
	static const struct {
		enum fake_step step;
		int result;
		enum exit_code code;
		const char *steps;
	} cases[] = {
		{ FAKE_SCAN, -ENODEV, EXIT_CODE_NO_SLAVE, "scan " },
		{ FAKE_SCAN, -EIO, EXIT_CODE_WIRE, "scan stop " },
		{ FAKE_COMPARE, -ENXIO, EXIT_CODE_SLAVES, "scan compare stop " },
		{ FAKE_MAP, -EPROTO, EXIT_CODE_MAPPING, "scan compare map stop " },
		{ FAKE_DC_SETUP, -ETIME, EXIT_CODE_CLOCKS, "scan compare map dc_setup stop " },
		{ FAKE_SYNC0, -ETIME, EXIT_CODE_CLOCKS,
		  "scan compare map dc_setup sync0 safeop stop " },
		{ FAKE_OP, -ETIME, EXIT_CODE_STATE,
		  "scan compare map dc_setup sync0 safeop op safeop stop " },
	};

	for (size_t i = 0; i < sizeof(cases) / sizeof(cases[0]); i++) {
		static struct bench b;
		struct failure failure = { .code = EXIT_CODE_OK };

		bench_open(&b);
		fake_bus.fails_at = cases[i].step;
		fake_bus.result = cases[i].result;
		CHECK_EQ(session_bring_up(b.session, &failure), cases[i].result);
		CHECK_EQ(failure.code, cases[i].code);
		CHECK(strstr(failure.text, ": does not work") != NULL);
		CHECK_STR(message_of(&b), failure.text);
		CHECK_STR(fake_bus.steps, cases[i].steps);
		CHECK_EQ(fake_bus.transports, 0);
		CHECK(b.cycle == NULL);
		session_conclude(b.session, &failure);
		CHECK_EQ(state_of(&b), BUS_FAILED);
		CHECK_EQ(atomic_load(&session_page(b.session)->exit_code), cases[i].code);
		bench_close(&b);
	}
}

TEST(session, a_failed_one_can_be_brought_up_again)
{
	static struct bench b;
	struct failure failure;

	bench_open(&b);
	b.open_fails = 1;
	CHECK_EQ(session_bring_up(b.session, &failure), -ENODEV);
	CHECK_EQ(failure.code, EXIT_CODE_INTERFACE);
	b.open_fails = 0;
	fake_bus.fails_at = FAKE_OP;
	fake_bus.result = -ETIME;
	CHECK_EQ(session_bring_up(b.session, &failure), -ETIME);
	fake_bus.fails_at = FAKE_NOTHING;
	CHECK_EQ(session_bring_up(b.session, &failure), 0);
	CHECK_EQ(state_of(&b), BUS_OP);
	CHECK_STR(message_of(&b), "");
	bench_close(&b);
}

TEST(session, duplicate_frames_are_reported_once)
{
	static struct bench b;
	struct failure failure;

	bench_open(&b);
	CHECK_EQ(session_bring_up(b.session, &failure), 0);
	CHECK_EQ(run(&b, 3000, &failure), SESSION_GOES_ON);
	CHECK_EQ(b.warnings, 0);
	fake_bus.is_doubled = 1;
	CHECK_EQ(run(&b, 5000, &failure), SESSION_GOES_ON);
	CHECK_EQ(b.warnings, 1);
	CHECK(strstr(b.warning, "duplicate frames") == b.warning);
	CHECK_STR(message_of(&b), b.warning);
	fake_bus.is_doubled = 0;
	CHECK_EQ(run(&b, 3000, &failure), SESSION_GOES_ON);
	CHECK_EQ(b.warnings, 1);
	CHECK_STR(message_of(&b), "");
	bench_close(&b);
}

TEST(session, op_is_not_requested_without_lock)
{
	static struct bench b;
	struct failure failure;

	bench_open(&b);
	fake_bus.is_dc_running_away = 1;
	b.cfg.dc_lock_timeout_ns = NS_PER_S;
	CHECK_EQ(session_bring_up(b.session, &failure), -ETIME);
	CHECK_EQ(failure.code, EXIT_CODE_CLOCKS);
	CHECK(strstr(failure.text, "dc: no lock to the reference clock within 1000 ms") != NULL);
	CHECK(strstr(fake_bus.steps, "sync0") == NULL);
	CHECK(strstr(fake_bus.steps, "op ") == strstr(fake_bus.steps, "op safeop") ||
	      strstr(fake_bus.steps, " op ") == NULL);
	bench_close(&b);
}

TEST(session, op_is_not_requested_while_frames_are_lost)
{
	static struct bench b;
	struct failure failure;

	bench_open(&b);
	fake_bus.lost_every = 5;
	CHECK_EQ(session_bring_up(b.session, &failure), -ETIME);
	CHECK_EQ(failure.code, EXIT_CODE_WIRE);
	CHECK(strstr(failure.text, "no steady exchange of frames") != NULL);
	CHECK(strstr(fake_bus.steps, " op ") == NULL);
	bench_close(&b);
}

TEST(session, a_stop_request_during_bring_up_takes_the_bus_down_in_order)
{
	static struct bench b;
	struct failure failure;

	bench_open(&b);
	session_stop_ask(b.session);
	CHECK_EQ(session_bring_up(b.session, &failure), -ECANCELED);
	CHECK_EQ(failure.code, EXIT_CODE_OK);
	CHECK_STR(fake_bus.steps, "scan stop ");
	bench_close(&b);
}

TEST(session, a_cycle_that_overran_ends_it_with_its_code)
{
	static struct bench b;
	struct failure failure;

	bench_open(&b);
	CHECK_EQ(session_bring_up(b.session, &failure), 0);
	b.ends_after = 10;
	b.result = -ETIME;
	CHECK_EQ(run(&b, 100, &failure), -ETIME);
	CHECK_EQ(failure.code, EXIT_CODE_OVERRUN);
	CHECK(strstr(failure.text, "cycle.overrun is stop") != NULL);
	CHECK_EQ(session_stop(b.session, &failure), 0);
	CHECK(strstr(fake_bus.steps, "op stop ") != NULL); /* no cycle, no SAFE-OP */
	bench_close(&b);
}

TEST(session, a_cycle_that_overruns_on_the_way_up_ends_bring_up_with_its_code)
{
	static struct bench b;
	struct failure failure;

	bench_open(&b);
	b.ends_after = 20;
	b.result = -ETIME;
	CHECK_EQ(session_bring_up(b.session, &failure), -ETIME);
	CHECK_EQ(failure.code, EXIT_CODE_OVERRUN);
	CHECK_STR(fake_bus.steps, "scan compare map dc_setup stop ");
	CHECK_EQ(fake_bus.transports, 0);
	bench_close(&b);
}

TEST(session, a_slave_that_falls_is_shown_and_its_return_too)
{
	static struct bench b;
	struct failure failure;

	bench_open(&b);
	CHECK_EQ(session_bring_up(b.session, &failure), 0);
	fake_bus.report = (struct bus_watch_report){ .slaves_op = 0, .is_all_op = 0 };
	CHECK_EQ(run(&b, 150, &failure), SESSION_GOES_ON);
	CHECK_EQ(state_of(&b), BUS_RECOVERING);
	CHECK_STR(message_of(&b), "bus: 0 of 1 slaves in OP, 0 lost");
	CHECK_EQ(atomic_load(&session_page(b.session)->cycle.is_fail_safe), 1);
	fake_bus.report = (struct bus_watch_report){ .slaves_op = 1, .is_all_op = 1 };
	CHECK_EQ(run(&b, 150, &failure), SESSION_GOES_ON);
	CHECK_EQ(state_of(&b), BUS_OP);
	CHECK_STR(message_of(&b), "");
	CHECK_EQ(atomic_load(&session_page(b.session)->cycle.is_fail_safe), 0);
	bench_close(&b);
}

static void check_no_samples_are_taken(void *ctx)
{
	CHECK_EQ(state_of(ctx), BUS_RECOVERING);
	fake_bus.led_back = NULL;
}

/* On its way through INIT the working counter is low: that must not look like bad samples. */
TEST(session, a_slave_is_restored_only_after_the_cycle_has_left_op)
{
	static struct bench b;
	struct failure failure;

	bench_open(&b);
	CHECK_EQ(session_bring_up(b.session, &failure), 0);
	fake_bus.led_back = check_no_samples_are_taken;
	fake_bus.led_back_ctx = &b;
	fake_bus.report = (struct bus_watch_report){ .slaves_op = 0, .is_all_op = 0 };
	CHECK_EQ(run(&b, 150, &failure), SESSION_GOES_ON);
	CHECK(fake_bus.led_back == NULL); /* it was */
	bench_close(&b);
}

TEST(session, all_slaves_lost_for_long_requests_a_restart)
{
	static struct bench b;
	struct failure failure;

	bench_open(&b);
	CHECK_EQ(session_bring_up(b.session, &failure), 0);
	fake_bus.report = (struct bus_watch_report){ .slaves_lost = 1 };
	CHECK_EQ(run(&b, 4500, &failure), SESSION_GOES_ON);
	fake_bus.report = (struct bus_watch_report){ .slaves_op = 0, .slaves_lost = 0 };
	CHECK_EQ(run(&b, 500, &failure), SESSION_GOES_ON); /* one came back in time */
	fake_bus.report = (struct bus_watch_report){ .slaves_lost = 1 };
	CHECK_EQ(run(&b, 4500, &failure), SESSION_GOES_ON);
	CHECK_EQ(run(&b, 1500, &failure), SESSION_LOST);
	session_drop(b.session);
	fake_bus.report = (struct bus_watch_report){ .slaves_op = 1, .is_all_op = 1 };
	CHECK_EQ(session_bring_up(b.session, &failure), 0);
	CHECK_EQ(run(&b, 150, &failure), SESSION_GOES_ON);
	bench_close(&b);
}

TEST(session, events_of_the_service_thread_reach_the_ring_in_order)
{
	static struct bench b;
	struct failure failure;
	struct ring_reader *reader = NULL;
	struct event ev;
	uint64_t lost;
	char path[128];
	char seen[512] = "";

	bench_open(&b);
	snprintf(path, sizeof(path), "%s/" CONFIG_RUN_EVENTS, b.dir);
	CHECK_EQ(ring_reader_open(path, &reader), 0);
	ring_seek(reader, 0);
	CHECK_EQ(session_bring_up(b.session, &failure), 0);
	session_degraded(b.session, EVENT_RT_MEMORY, EPERM);
	CHECK_EQ(run(&b, 10, &failure), SESSION_GOES_ON);
	CHECK_EQ(session_stop(b.session, &failure), 0);
	session_conclude(b.session, NULL);
	while (ring_read(reader, &ev, sizeof(ev), &lost) == RING_OK) {
		size_t used = strlen(seen);

		CHECK(ev.mono_ns > 0 && ev.tai_ns > 0);
		if (ev.id == EVENT_OUTPUT_FAIL_SAFE) {
			continue; /* the cycle's own affair */
		}
		snprintf(seen + used, sizeof(seen) - used, "%s ", event_name(ev.id));
	}
	/* DOWN to SCANNING, PREOP, SAFEOP, OP; STOPPED at the end. */
	CHECK_STR(seen, "bus_state bus_state dc_locked bus_state bus_state started rt_degraded "
			"bus_state stopped ");
	CHECK_EQ(atomic_load(&session_page(b.session)->rt_degraded), 1u << EVENT_RT_MEMORY);
	ring_reader_destroy(reader);
	bench_close(&b);
}

/* --- the admin socket, as a client meets it --- */

static int connect_admin(const struct bench *b)
{
	struct sockaddr_un address = { .sun_family = AF_UNIX };
	int fd = socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0);

	snprintf(address.sun_path, sizeof(address.sun_path), "%s/" CONFIG_RUN_ADMIN, b->dir);
	CHECK_EQ(connect(fd, (const struct sockaddr *)&address, sizeof(address)), 0);
	return fd;
}

static struct admin_reply ask(struct bench *b, int fd, const struct admin_request *rq)
{
	struct admin_reply reply;
	struct failure failure;

	CHECK_EQ(send(fd, rq, sizeof(*rq), 0), sizeof(*rq));
	for (int i = 0; i < 20; i++) {
		run(b, 1, &failure);
		if (recv(fd, &reply, sizeof(reply), MSG_DONTWAIT) == (ssize_t)sizeof(reply)) {
			return reply;
		}
	}
	test_fail(__FILE__, __LINE__, "no reply");
}

static struct admin_request led(uint64_t value)
{
	struct admin_request rq = { .magic = ADMIN_MAGIC, .verb = ADMIN_SET, .count = 1 };

	snprintf(rq.item[0].channel, sizeof(rq.item[0].channel), "a.led");
	rq.item[0].raw = value;
	return rq;
}

TEST(session, who_may_command_and_who_may_set_remote_outputs_are_the_groups_of_the_sockets)
{
	static struct bench b;
	struct stat st;
	char path[256];

	if (geteuid() != 0) {
		SKIP("needs root to give sockets to other groups");
	}
	bench_prepare(&b);
	snprintf(b.cfg.admin_group, sizeof(b.cfg.admin_group), "adm");
	snprintf(b.cfg.remote_group, sizeof(b.cfg.remote_group), "mail");
	bench_begin(&b);
	snprintf(path, sizeof(path), "%s/" CONFIG_RUN_ADMIN, b.dir);
	CHECK_EQ(stat(path, &st), 0);
	CHECK_EQ(st.st_gid, getgrnam("adm")->gr_gid);
	CHECK_EQ(st.st_mode & 07777, 0660);
	snprintf(path, sizeof(path), "%s/" CONFIG_RUN_COMMANDS_REMOTE, b.dir);
	CHECK_EQ(stat(path, &st), 0);
	CHECK_EQ(st.st_gid, getgrnam("mail")->gr_gid);
	CHECK_EQ(st.st_mode & 07777, 0660);
	bench_close(&b);
}

TEST(session, an_output_set_through_the_socket_is_on_the_wire_and_safe_at_the_end)
{
	static struct bench b;
	struct failure failure;
	struct admin_request on = led(1);
	struct admin_reply reply;
	int fd;

	bench_open(&b);
	fd = connect_admin(&b);
	CHECK_EQ(ask(&b, fd, &on).result, -EAGAIN); /* nothing is up */
	CHECK_EQ(session_bring_up(b.session, &failure), 0);
	CHECK_EQ(fake_bus.led, 0);
	reply = ask(&b, fd, &on);
	CHECK_EQ(reply.result, 0);
	CHECK_EQ(fake_bus.led, 1);
	CHECK(reply.cycle > 0 &&
	      reply.cycle <= atomic_load(&session_page(b.session)->cycle.cycle_number));
	CHECK_EQ(session_stop(b.session, &failure), 0);
	CHECK_EQ(fake_bus.led, 0);
	close(fd);
	bench_close(&b);
}

TEST(session, the_link_is_asked_for_where_frames_are_missing_and_nowhere_else)
{
	static struct bench b;
	struct failure failure;
	unsigned queries;

	bench_open(&b);
	CHECK_EQ(session_bring_up(b.session, &failure), 0);
	CHECK_EQ(run(&b, 500, &failure), SESSION_GOES_ON);
	queries = fake_bus.link_queries;
	CHECK_EQ(run(&b, 1000, &failure), SESSION_GOES_ON);
	CHECK_EQ(fake_bus.link_queries, queries);
	fake_bus.lost_every = 10;
	fake_bus.is_link_up = 0;
	CHECK_EQ(run(&b, 200, &failure), SESSION_GOES_ON);
	CHECK(fake_bus.link_queries > queries);
	CHECK_EQ(atomic_load(&session_page(b.session)->link), STATUS_LINK_DOWN);
	/* And until it is up again. */
	fake_bus.lost_every = 0;
	CHECK_EQ(run(&b, 500, &failure), SESSION_GOES_ON);
	fake_bus.is_link_up = 1;
	CHECK_EQ(run(&b, 200, &failure), SESSION_GOES_ON);
	CHECK_EQ(atomic_load(&session_page(b.session)->link), STATUS_LINK_UP);
	bench_close(&b);
}

TEST(session, clear_zeroes_counters_and_keeps_the_cycle_number)
{
	static struct bench b;
	struct failure failure;
	struct admin_request rq = { .magic = ADMIN_MAGIC, .verb = ADMIN_CLEAR };
	const struct cycle_stats *st;
	uint64_t cycles;
	int fd;

	bench_open(&b);
	CHECK_EQ(session_bring_up(b.session, &failure), 0);
	st = &session_page(b.session)->cycle;
	fd = connect_admin(&b);
	fake_bus.lost_every = 10;
	CHECK_EQ(run(&b, 100, &failure), SESSION_GOES_ON);
	CHECK(atomic_load(&st->frames_lost) >= 9);
	fake_bus.lost_every = 0;
	cycles = atomic_load(&st->cycles);
	CHECK_EQ(ask(&b, fd, &rq).result, 0);
	CHECK_EQ(run(&b, 2, &failure), SESSION_GOES_ON);
	CHECK_EQ(atomic_load(&st->frames_lost), 0);
	CHECK(atomic_load(&st->wake_latency.count) < 10);
	CHECK(atomic_load(&st->cycles) > cycles);
	close(fd);
	bench_close(&b);
}

TEST(session, stop_through_the_socket_is_answered_and_reported)
{
	static struct bench b;
	struct failure failure;
	struct admin_request rq = { .magic = ADMIN_MAGIC, .verb = ADMIN_STOP };
	int fd;

	bench_open(&b);
	CHECK_EQ(session_bring_up(b.session, &failure), 0);
	fd = connect_admin(&b);
	CHECK_EQ(ask(&b, fd, &rq).result, 0);
	CHECK_EQ(session_service(b.session, &failure), SESSION_STOP_ASKED);
	CHECK_EQ(session_is_stop_asked(b.session), 1);
	close(fd);
	bench_close(&b);
}

TEST(session, the_ring_describes_its_samples)
{
	static struct bench b;
	struct failure failure;
	struct ring_reader *reader = NULL;
	const struct sample_meta *meta;
	size_t bytes;
	char path[128];

	bench_open(&b);
	CHECK_EQ(session_bring_up(b.session, &failure), 0);
	snprintf(path, sizeof(path), "%s/" CONFIG_RUN_SAMPLES, b.dir);
	CHECK_EQ(ring_reader_open(path, &reader), 0);
	meta = ring_meta(reader, &bytes);
	CHECK_EQ(meta->version, SAMPLE_VERSION);
	CHECK_EQ(meta->slave_count, 1);
	CHECK_EQ(meta->channel_count, 2);
	CHECK_EQ(meta->image_bytes, 3);
	CHECK_EQ(meta->session, session_page(b.session)->session);
	CHECK_EQ(bytes, sizeof(*meta) + sizeof(struct slave_info) + 2 * sizeof(struct channel));
	CHECK_STR(sample_meta_channels(meta)[1].name, "a.adc");
	CHECK_EQ(ring_payload_bytes(reader), sample_head_bytes(meta->slave_count) + 3);
	ring_reader_destroy(reader);
	bench_close(&b);
}
