/* SPDX-License-Identifier: MIT */
/* The live check on a ring and a file of edges that the test writes, on a clock of the test's own.
 */
#include "sync0/watch.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/clock.h"
#include "base/event.h"
#include "base/sync0.h"
#include "harness/test.h"
#include "reader/page.h"
#include "unit/services/sync0/fake_master.h"

enum { STEP_CYCLES = 100, FOREVER = 1 << 30 };

struct watch_bench {
	char dir[64];
	struct config cfg;
	struct fake_master fake;
	struct watch *watch;
	FILE *edges; /* NULL: the file is not there */
	int64_t now_ns;
	int64_t late_ns;     /* of the second slave's pulses */
	int64_t every;       /* it has a pulse in every n-th cycle only; 0: in each */
	int64_t silent_from; /* cycle from which on the second slave has no pulse */
	char why[WATCH_WHY_BYTES];
};

static struct watch_bench b;

static mono_t bench_now(void *ctx)
{
	(void)ctx;
	return (mono_t){ b.now_ns };
}

static int64_t bench_tai_ns(void *ctx)
{
	(void)ctx;
	return b.now_ns;
}

static const char *path_of(const char *name)
{
	static char path[128];

	snprintf(path, sizeof(path), "%s/%s", b.dir, name);
	return path;
}

static void set(const char *assignment)
{
	char error[256] = "";

	CHECK_EQ(config_set(&b.cfg, assignment, error, sizeof(error)), 0);
}

static void open_edges(void)
{
	b.edges = fopen(path_of("edges"), "we");
	CHECK(b.edges != NULL);
}

static int try_watch(struct watch **ret_watch)
{
	const struct watch_spec spec = {
		.cfg = &b.cfg,
		.dev_dir = "/nonexistent",
		.platform = { .now = bench_now, .tai_ns = bench_tai_ns },
	};

	return watch_create(&spec, ret_watch, b.why);
}

/* A run directory with nothing in it, and a configuration that names it. */
static void begin(void)
{
	b = (struct watch_bench){ .dir = "/dev/shm/ecdaq-watch-XXXXXX", .silent_from = FOREVER };
	CHECK(mkdtemp(b.dir) != NULL);
	b.now_ns = FAKE_MONO0_NS;
	config_defaults(&b.cfg);
	snprintf(b.cfg.run_dir, sizeof(b.cfg.run_dir), "%s", b.dir);
	snprintf(b.cfg.sync0_edges, sizeof(b.cfg.sync0_edges), "%s", path_of("edges"));
	set("sync0.window=100ms");
	set("sync0.lost=10ms");
}

static void start(int64_t period_ns)
{
	open_edges();
	fake_master_start(&b.fake, b.dir, period_ns);
	CHECK_EQ(try_watch(&b.watch), 0);
}

/* Of files of the run directory, deleted ones among them, in this process. */
static unsigned mappings(void)
{
	FILE *maps = fopen("/proc/self/maps", "re");
	unsigned count = 0;
	char line[512];

	CHECK(maps != NULL);
	while (fgets(line, sizeof(line), maps) != NULL) {
		count += strstr(line, b.dir) != NULL;
	}
	fclose(maps);
	return count;
}

static void end(void)
{
	static const char *const names[] = { "edges",        "samples",      "sync0/results",
					     "sync0/events", "sync0/status", "sync0/lock",
					     "sync0" };

	if (b.watch != NULL) {
		watch_finish(b.watch);
		watch_destroy(b.watch);
	}
	fake_master_stop(&b.fake);
	CHECK_EQ(mappings(), 0);
	if (b.edges != NULL) {
		fclose(b.edges);
	}
	for (size_t i = 0; i < sizeof(names) / sizeof(names[0]); i++) {
		remove(path_of(names[i]));
	}
	CHECK_EQ(rmdir(b.dir), 0);
}

static void write_cycle(uint64_t shot_ns)
{
	int64_t edge_ns = fake_mono_ns(b.fake.dc_ns);

	for (int slave = 0; b.edges != NULL && slave < FAKE_SLAVES; slave++) {
		if (slave == 0 || (b.fake.cycle < b.silent_from &&
				   (b.every == 0 || b.fake.cycle % b.every == 0))) {
			fprintf(b.edges, "%d %lld 0\n", slave,
				(long long)edge_ns + (slave == FAKE_SHOT_SLAVE ? b.late_ns : 0));
		}
	}
	fake_master_push(&b.fake, shot_ns);
	b.now_ns = fake_mono_ns(b.fake.dc_ns);
}

static void run_with(int64_t cycles, uint64_t shot_ns)
{
	for (int64_t i = 1; i <= cycles; i++) {
		write_cycle(shot_ns);
		if (i % STEP_CYCLES == 0) {
			if (b.edges != NULL) {
				fflush(b.edges);
			}
			watch_step(b.watch);
		}
	}
}

/* The check is not run meanwhile. */
static void stall(int64_t cycles)
{
	for (int64_t i = 0; i < cycles; i++) {
		write_cycle(0);
	}
}

static void run(int64_t cycles)
{
	run_with(cycles, 0);
}

/* A copy of what others see. */
static struct sync0_status *page(void)
{
	static struct sync0_status copy;

	CHECK_EQ(page_read_sync0(path_of("sync0/status"), &copy), 0);
	return &copy;
}

TEST(sync0_watch, windows_and_alarms_are_counted_over_restarts_of_the_master)
{
	uint64_t windows;

	begin();
	start(NS_PER_MS);
	b.silent_from = 1000;
	run(2000);
	windows = page()->windows;
	CHECK(windows >= 10);
	CHECK_EQ(page()->state, SYNC0_RUNNING);
	CHECK(page()->alarms >= 1);
	CHECK_EQ(page()->line[1].is_lost, 1);
	fake_master_stop(&b.fake);
	watch_step(b.watch);
	CHECK_EQ(page()->state, SYNC0_WAITING);
	CHECK_EQ(page()->line[1].is_lost, 0);
	CHECK(page()->windows >= windows);
	b.silent_from = FOREVER;
	fake_master_start(&b.fake, b.dir, NS_PER_MS);
	run(1000);
	CHECK(page()->windows >= windows + 5);
	CHECK(page()->alarms >= 1);
	CHECK_EQ(page()->line[1].is_lost, 0);
	end();
}

TEST(sync0_watch, a_period_that_is_not_that_of_the_configuration_is_followed)
{
	begin();
	start(10 * NS_PER_MS);
	run(1000);
	CHECK(page()->windows >= 5);
	CHECK_EQ(page()->window_ns, NS_PER_S);
	CHECK(strstr(page()->message, "100 cycles of the slowest SYNC0: 1000 ms are taken") !=
	      NULL);
	CHECK_EQ(page()->alarms, 0);
	CHECK_EQ(page()->line[0].missing, 0);
	end();
}

TEST(sync0_watch, a_second_one_in_the_same_directory_is_refused)
{
	struct watch *second = NULL;

	begin();
	start(NS_PER_MS);
	CHECK_EQ(try_watch(&second), -EBUSY);
	CHECK(second == NULL);
	CHECK(strstr(b.why, "another ecdaq-sync0 is running here (pid ") != NULL);
	run(500);
	CHECK(page()->windows >= 1);
	watch_destroy(b.watch);
	CHECK_EQ(try_watch(&b.watch), 0);
	end();
}

TEST(sync0_watch, a_run_directory_that_is_made_later_or_anew_is_taken)
{
	unsigned mapped;

	begin();
	CHECK_EQ(rmdir(b.dir), 0);
	CHECK_EQ(try_watch(&b.watch), 0);
	watch_step(b.watch);
	CHECK_EQ(mkdir(b.dir, 0700), 0);
	watch_step(b.watch);
	CHECK_EQ(page()->state, SYNC0_NO_LINE);
	mapped = mappings();
	CHECK(mapped > 0);
	unlink(path_of("sync0/lock"));
	unlink(path_of("sync0/status"));
	watch_step(b.watch);
	CHECK_EQ(page()->state, SYNC0_NO_LINE);
	CHECK_EQ(mappings(), mapped); /* those of the deleted files are gone */
	end();
}

TEST(sync0_watch, pulses_before_the_file_of_edges_is_there_are_not_missed)
{
	begin();
	fake_master_start(&b.fake, b.dir, NS_PER_MS);
	CHECK_EQ(try_watch(&b.watch), 0);
	run(3000);
	CHECK_EQ(page()->state, SYNC0_NO_LINE);
	CHECK_EQ(page()->line[0].is_open, 0);
	CHECK(strstr(page()->message, "edges: No such file or directory") != NULL);
	open_edges();
	run(5000);
	CHECK_EQ(page()->state, SYNC0_RUNNING);
	CHECK_EQ(page()->line[0].is_open, 1);
	CHECK_STR(page()->message, "");
	CHECK(page()->line[1].edges >= 2000);
	CHECK_EQ(page()->line[1].missing, 0);
	CHECK_EQ(page()->alarms, 0);
	end();
}

TEST(sync0_watch, a_time_that_is_still_to_come_is_no_edge)
{
	begin();
	start(NS_PER_MS);
	run(500);
	fprintf(b.edges, "1 %lld 0\n", (long long)(b.now_ns + 3600 * NS_PER_S));
	run(1000);
	CHECK(page()->windows >= 8);
	CHECK(page()->line[1].edges >= 800);
	CHECK_EQ(page()->alarms, 0);
	end();
}

/* As of a slave whose SII has the shift: the configuration says nothing. */
TEST(sync0_watch, the_shift_that_the_master_states_is_expected)
{
	begin();
	b.late_ns = 200 * NS_PER_US;
	b.fake.shift_ns = 200 * (int32_t)NS_PER_US;
	start(NS_PER_MS);
	run(2000);
	CHECK(page()->windows >= 10);
	CHECK(page()->line[1].edges >= 1000);
	CHECK_EQ(page()->line[1].missing, 0);
	CHECK_EQ(page()->alarms, 0);
	end();
	begin();
	b.late_ns = 200 * NS_PER_US;
	start(NS_PER_MS);
	run(2000);
	CHECK(page()->alarms > 0);
	end();
}

TEST(sync0_watch, the_sync0_cycle_that_the_master_states_is_expected)
{
	begin();
	b.every = 2;
	b.late_ns = 300 * NS_PER_US;
	b.fake.has_own_cycle = 1;
	b.fake.cycle_ns = 2 * NS_PER_MS;
	b.fake.shift_ns = 300 * (int32_t)NS_PER_US;
	start(NS_PER_MS);
	run(2000);
	CHECK(page()->windows >= 5);
	CHECK_EQ(page()->window_ns, 200 * NS_PER_MS);
	CHECK_EQ(page()->line[1].cycle_ns, 2 * NS_PER_MS);
	CHECK(page()->line[1].edges >= 500);
	CHECK_EQ(page()->line[0].edges, 2 * page()->line[1].edges);
	CHECK_EQ(page()->line[1].missing + page()->line[1].extra, 0);
	CHECK_EQ(page()->alarms, 0);
	end();
}

/* A line is configured for a slave that has no SYNC0: that is said, and nothing is missed. */
TEST(sync0_watch, a_line_of_a_slave_without_sync0_is_not_checked)
{
	begin();
	b.cfg.sync0_edges[0] = '\0';
	set("slaves[0].sync0_line=chip:4");
	set("slaves[1].sync0_line=chip:5");
	CHECK_EQ(try_watch(&b.watch), 0);
	b.fake.has_own_cycle = 1;
	fake_master_start(&b.fake, b.dir, NS_PER_MS);
	run(500);
	CHECK_EQ(page()->line_count, 2);
	CHECK_EQ(page()->line[1].cycle_ns, 0);
	CHECK(strstr(page()->message, "line 'chip:5' is not checked: the master starts no SYNC0 in "
				      "its slave (slaves[1])") != NULL);
	end();
	begin();
	b.fake.has_own_cycle = 1;
	start(NS_PER_MS);
	run(2000);
	CHECK_EQ(page()->line_count, 1);
	CHECK_EQ(page()->alarms, 0);
	end();
}

TEST(sync0_watch, slaves_beyond_the_lines_are_named)
{
	char text[128];

	begin();
	b.fake.more = LIMIT_SYNC0_LINES - FAKE_SLAVES;
	start(NS_PER_MS);
	run(500);
	CHECK_EQ(page()->line_count, LIMIT_SYNC0_LINES);
	CHECK_EQ(sync0_beyond_format(page(), text, sizeof(text)), 0);
	fake_master_stop(&b.fake);
	b.fake.more += 3;
	fake_master_start(&b.fake, b.dir, NS_PER_MS);
	run(500);
	CHECK_EQ(page()->line_count, LIMIT_SYNC0_LINES);
	CHECK(sync0_beyond_format(page(), text, sizeof(text)) > 0);
	CHECK_STR(text, "not checked: slave 64 (slave64) and 2 more: only 64 lines");
	end();
}

/* The mode is that of the item, too. */
TEST(sync0_watch, a_slave_behind_an_absent_one_has_the_settings_of_its_item)
{
	begin();
	set("slaves[0].mode=periodic");
	set("slaves[1].mode=oneshot");
	set("slaves[2].mode=periodic");
	b.fake.absent = 1;
	start(NS_PER_MS);
	run(500);
	CHECK_EQ(page()->line[1].slave_pos, 1);
	CHECK_EQ(page()->line[1].is_oneshot, 0);
	CHECK(page()->line[1].edges > 0);
	end();
}

TEST(sync0_watch, lines_belong_to_the_slaves_that_the_master_has_found)
{
	begin();
	b.cfg.sync0_edges[0] = '\0';
	set("slaves[0].sync0_line=chip:4");
	set("slaves[1].sync0_line=chip:5");
	set("slaves[1].name=absent");
	set("slaves[2].sync0_line=chip:6");
	CHECK_EQ(try_watch(&b.watch), 0);
	CHECK_EQ(page()->line_count, 3);
	CHECK_EQ(page()->line[2].slave_pos, 2); /* as configured, as long as there is no master */
	b.fake.absent = 1;
	fake_master_start(&b.fake, b.dir, NS_PER_MS);
	run(500);
	CHECK_EQ(page()->line[0].slave_pos, 0);
	CHECK_STR(page()->line[0].slave, "a");
	CHECK_EQ(page()->line[1].slave_pos, EVENT_NO_SLAVE);
	CHECK_STR(page()->line[1].slave, "absent");
	CHECK_EQ(page()->line[2].slave_pos, 1);
	CHECK_STR(page()->line[2].slave, "b");
	CHECK_STR(page()->line[2].line, "chip:6");
	end();
}

TEST(sync0_watch, with_one_shot_slaves_alone_it_runs_and_tells_of_each)
{
	int64_t at_ns;

	begin();
	set("slaves[0].mode=oneshot");
	set("slaves[1].mode=oneshot");
	b.silent_from = 0;
	start(NS_PER_MS);
	fclose(b.edges);
	b.edges = NULL;
	run(3000);
	CHECK_EQ(page()->state, SYNC0_RUNNING);
	at_ns = b.fake.dc_ns + 100 * NS_PER_MS;
	run_with(300, (uint64_t)at_ns);
	run_with(2500, (uint64_t)at_ns);
	CHECK_EQ(page()->line[1].shots, 1);
	CHECK_EQ(page()->line[1].shots_lost, 1);
	CHECK_EQ(page()->alarms, 1);
	end();
}

TEST(sync0_watch, a_pulse_that_nobody_asked_for_is_counted)
{
	begin();
	set("slaves[0].mode=periodic");
	set("slaves[1].mode=oneshot");
	b.silent_from = 0;
	start(NS_PER_MS);
	run(1000);
	fprintf(b.edges, "1 %lld 0\n", (long long)fake_mono_ns(b.fake.dc_ns) - 300);
	run(3000);
	CHECK_EQ(page()->line[1].extra, 1);
	CHECK_EQ(page()->line[1].shots, 0);
	CHECK_EQ(page()->line[0].extra, 0);
	end();
}

TEST(sync0_watch, pulses_that_came_while_it_was_held_up_are_not_missed)
{
	uint64_t windows;

	begin();
	start(NS_PER_MS);
	run(1000);
	windows = page()->windows;
	stall(900); /* they wait in the queue */
	run(1000);
	CHECK(page()->windows >= windows + 17);
	CHECK_EQ(page()->line[1].missing, 0);
	stall(30000); /* nobody knows what came */
	run(2000);
	CHECK(page()->windows >= windows + 27);
	CHECK_EQ(page()->line[0].missing, 0);
	CHECK_EQ(page()->line[1].missing, 0);
	CHECK_EQ(page()->alarms, 0);
	CHECK_EQ(page()->state, SYNC0_RUNNING);
	end();
}
