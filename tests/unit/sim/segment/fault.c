/* SPDX-License-Identifier: MIT */
#include <errno.h>
#include <unistd.h>

#include "harness/test.h"
#include "segment/fault.h"
#include "terminal.h"
#include "wire/al.h"
#include "wire/esc_reg.h"

enum { FRAME_BYTES = 100, MS = 1000000, SECOND = BENCH_STATION + 1 };

/* --- the plan's text --- */

static void check_refused(const char *line, const char *why)
{
	struct fault_plan *plan = fault_plan_create(1, 0);
	char error[128] = "";

	CHECK(plan != NULL);
	CHECK_EQ(fault_plan_add(plan, line, 2, error, sizeof(error)), -EINVAL);
	CHECK_STR(error, why);
	fault_plan_destroy(plan);
}

TEST(sim_fault, a_line_that_makes_no_sense_is_refused_with_its_reason)
{
	check_refused("at=1s explode", "explode: unknown fault");
	check_refused("at=1s lose double", "double: only one fault per line");
	check_refused("lose", "the time is missing: at=, frame=, every= or p=");
	check_refused("at=1s frame=3 lose", "only one of at=, frame=, every=, p=");
	check_refused("at=1s", "the fault is missing");
	check_refused("at=1 lose", "at: bad value");
	check_refused("at=-1s lose", "at: bad value");
	check_refused("at=1e30s lose", "at: bad value");
	check_refused("every=0 lose", "every: bad value");
	check_refused("frame=0 lose", "frame: bad value");
	check_refused("frame=-1 lose", "frame: bad value");
	check_refused("p=1.5 lose", "p: bad value");
	check_refused("p=nan lose", "p: bad value");
	check_refused("at=1s delay", "delay: by= is missing");
	check_refused("p=1 jitter", "jitter: by= is missing");
	check_refused("at=1s cut", "cut: slave= is missing");
	check_refused("at=1s cut slave=2", "slave: bad value");
	check_refused("at=1s cut slave=x", "slave: bad value");
	check_refused("at=1s port-error slave=0 port=4", "port: bad value");
	check_refused("at=1s drift slave=0 ppm=5000", "ppm: bad value");
	check_refused("at=1s al-error slave=0 code=0x10000", "code: bad value");
	check_refused("every=5 cut slave=0", "cut happens once: at= or frame=");
	check_refused("at=1s lose colour=red", "colour: unknown key");
}

TEST(sim_fault, a_line_longer_than_the_buffer_is_refused)
{
	char line[400];

	memset(line, 'x', sizeof(line));
	line[sizeof(line) - 1] = '\0';
	check_refused(line, "line longer than 255 characters");
}

TEST(sim_fault, empty_lines_and_comments_are_fine)
{
	struct fault_plan *plan = fault_plan_create(1, 0);
	char error[64] = "untouched";

	CHECK_EQ(fault_plan_add(plan, "", 1, error, sizeof(error)), 0);
	CHECK_EQ(fault_plan_add(plan, "  \t \n", 1, error, sizeof(error)), 0);
	CHECK_EQ(fault_plan_add(plan, "# at=1s explode", 1, error, sizeof(error)), 0);
	CHECK_EQ(fault_plan_add(plan, "at=1s lose # and why", 1, error, sizeof(error)), 0);
	CHECK_STR(error, "untouched");
	fault_plan_destroy(plan);
}

static void write_plan(char *path, const char *text)
{
	int fd = mkstemp(path);

	CHECK(fd >= 0);
	CHECK_EQ(write(fd, text, strlen(text)), (ssize_t)strlen(text));
	close(fd);
}

TEST(sim_fault, a_plan_file_with_a_mistake_is_named_with_its_line)
{
	char path[] = "/tmp/ecdaq-fault-XXXXXX";
	char wanted[128];
	char error[128];
	struct fault_plan *plan = fault_plan_create(1, 0);

	write_plan(path, "# a plan\nat=1s lose\n\nat=2s loose\n");
	CHECK_EQ(fault_plan_load(plan, path, 2, error, sizeof(error)), -EINVAL);
	snprintf(wanted, sizeof(wanted), "%s:4: loose: unknown fault", path);
	CHECK_STR(error, wanted);
	unlink(path);
	CHECK_EQ(fault_plan_load(plan, path, 2, error, sizeof(error)), -ENOENT);
	snprintf(wanted, sizeof(wanted), "%s: No such file or directory", path);
	CHECK_STR(error, wanted);
	fault_plan_destroy(plan);
}

/* --- what they do --- */

static struct fault_plan *plan_of(const char *line)
{
	struct fault_plan *plan = fault_plan_create(7, 0);
	char error[128] = "";

	CHECK_EQ(fault_plan_add(plan, line, 2, error, sizeof(error)), 0);
	CHECK_STR(error, "");
	return plan;
}

static struct bench *two_slaves(void)
{
	return bench_create((struct bench_slave[]){ { .pdi = 5, .config = 0x0c },
						    { .pdi = 5, .config = 0x0c } },
			    2);
}

static struct fault_verdict judge(struct fault_plan *plan, struct bench *b)
{
	b->now_ns += MS;
	return fault_plan_judge(plan, b->segment, b->now_ns, FRAME_BYTES);
}

TEST(sim_fault, at_hits_one_frame_and_at_for_all_frames_of_that_time)
{
	struct bench *b = two_slaves();
	struct fault_plan *once = plan_of("at=15ms lose");
	struct fault_plan *span = plan_of("at=15ms for=5ms drop");
	int lost = 0;
	int dropped = 0;

	while (b->now_ns < 40 * MS) {
		lost += judge(once, b).is_lost;
		dropped += fault_plan_judge(span, b->segment, b->now_ns, FRAME_BYTES).is_dropped;
	}
	CHECK_EQ(lost, 1);
	CHECK_EQ(dropped, 5);
	fault_plan_destroy(once);
	fault_plan_destroy(span);
	bench_destroy(b);
}

TEST(sim_fault, frame_and_every_count_frames)
{
	struct bench *b = two_slaves();
	struct fault_plan *third = plan_of("frame=3 double");
	struct fault_plan *every = plan_of("every=4 delay by=300us");

	for (int n = 1; n <= 12; n++) {
		CHECK_EQ(judge(third, b).is_doubled, n == 3);
		CHECK_EQ(judge(every, b).delay_ns, n % 4 == 0 ? 300000 : 0);
	}
	fault_plan_destroy(third);
	fault_plan_destroy(every);
	bench_destroy(b);
}

TEST(sim_fault, transit_jitter_is_spread_over_its_range_and_follows_the_seed)
{
	struct bench *b = two_slaves();
	struct fault_plan *plan = plan_of("p=1 jitter by=500ns");
	struct fault_plan *again = plan_of("p=1 jitter by=500ns");
	int64_t low = INT64_MAX;
	int64_t high = 0;
	int64_t sum = 0;

	for (int n = 0; n < 1000; n++) {
		int64_t ns = judge(plan, b).transit_ns;

		CHECK_EQ(judge(again, b).transit_ns, ns);
		low = ns < low ? ns : low;
		high = ns > high ? ns : high;
		sum += ns;
	}
	CHECK(low >= 0 && low < 10);
	CHECK(high <= 500 && high > 490);
	CHECK(sum > 230 * 1000 && sum < 270 * 1000);
	fault_plan_destroy(plan);
	fault_plan_destroy(again);
	bench_destroy(b);
}

TEST(sim_fault, chances_follow_the_seed)
{
	struct bench *b = two_slaves();
	struct fault_plan *plan[2] = { plan_of("p=0.1 lose"), plan_of("p=0.1 lose") };
	int lost = 0;

	for (int n = 0; n < 2000; n++) {
		int first = judge(plan[0], b).is_lost;

		CHECK_EQ(judge(plan[1], b).is_lost, first);
		lost += first;
	}
	CHECK(lost > 150 && lost < 250);
	fault_plan_destroy(plan[0]);
	fault_plan_destroy(plan[1]);
	bench_destroy(b);
}

TEST(sim_fault, truncation_and_corruption_stay_within_the_frame)
{
	struct bench *b = two_slaves();
	struct fault_plan *cut = plan_of("every=1 truncate");
	struct fault_plan *spoil = plan_of("every=1 corrupt");

	for (int n = 0; n < 2000; n++) {
		struct fault_verdict c = judge(cut, b);
		struct fault_verdict s = judge(spoil, b);

		CHECK(c.truncate_to >= 1 && c.truncate_to < FRAME_BYTES);
		CHECK(s.corrupt_at >= ECAT_ETHERNET_BYTES && s.corrupt_at < FRAME_BYTES);
		CHECK(s.corrupt_xor != 0);
	}
	fault_plan_destroy(cut);
	fault_plan_destroy(spoil);
	bench_destroy(b);
}

TEST(sim_fault, cut_and_power_take_slaves_away_and_bring_them_back)
{
	struct bench *b = two_slaves();
	struct fault_plan *plan = plan_of("at=0s cut slave=1");
	uint8_t data[2] = { 0 };
	char error[64];

	judge(plan, b);
	CHECK_EQ(bench_send(b, ECAT_CMD_BRD, 0, ESC_REG_TYPE, data, 1), 1);
	CHECK_EQ(bench_read8(b, BENCH_STATION, ESC_REG_LOST_LINK_COUNTER + 1), 1);
	CHECK_EQ(fault_plan_add(plan, "at=0s heal slave=1", 2, error, sizeof(error)), 0);
	judge(plan, b);
	CHECK_EQ(bench_read16(b, SECOND, ESC_REG_STATION_ADDRESS), SECOND);
	CHECK_EQ(fault_plan_add(plan, "at=0s power-off slave=0", 2, error, sizeof(error)), 0);
	CHECK_EQ(fault_plan_add(plan, "at=100ms power-on slave=0", 2, error, sizeof(error)), 0);
	judge(plan, b);
	CHECK_EQ(segment_frame(b->segment, b->now_ns, b->frame, b->frame_len, &b->back_ns),
		 -ENOLINK);
	b->now_ns = 100 * MS;
	judge(plan, b);
	bench_wait(b, 10 * MS);
	CHECK_EQ(bench_send(b, ECAT_CMD_BRD, 0, ESC_REG_STATION_ADDRESS, data, 2), 2);
	CHECK_EQ(bench_send(b, ECAT_CMD_FPRD, BENCH_STATION, ESC_REG_TYPE, data, 1), 0);
	fault_plan_destroy(plan);
	bench_destroy(b);
}

TEST(sim_fault, drift_al_error_port_error_and_watchdog_show_in_the_slave)
{
	struct bench *b = two_slaves();
	struct fault_plan *plan = plan_of("at=0s al-error slave=1 code=0x001a");
	uint64_t before;
	uint64_t after;
	char error[64];

	CHECK_EQ(fault_plan_add(plan, "at=0s port-error slave=1 port=0", 2, error, sizeof(error)),
		 0);
	CHECK_EQ(fault_plan_add(plan, "at=0s watchdog slave=1", 2, error, sizeof(error)), 0);
	CHECK_EQ(fault_plan_add(plan, "at=0s drift slave=1 ppm=500", 2, error, sizeof(error)), 0);
	judge(plan, b);
	CHECK_EQ(bench_read16(b, SECOND, ESC_REG_AL_STATUS), AL_INIT | AL_ERROR);
	CHECK_EQ(bench_read16(b, SECOND, ESC_REG_AL_STATUS_CODE), 0x001a);
	CHECK_EQ(bench_read8(b, SECOND, ESC_REG_RX_ERROR_COUNTER + 1), 1);
	CHECK_EQ(bench_read8(b, SECOND, ESC_REG_WATCHDOG_COUNTER_PD), 1);
	before = bench_read64(b, SECOND, ESC_REG_DC_SYSTEM_TIME);
	bench_wait(b, 100 * MS - BENCH_STEP_NS);
	after = bench_read64(b, SECOND, ESC_REG_DC_SYSTEM_TIME);
	CHECK(after - before >= 100 * MS + 49990 && after - before <= 100 * MS + 50010);
	fault_plan_destroy(plan);
	bench_destroy(b);
}

TEST(sim_fault, a_stuck_mailbox_takes_requests_and_answers_nothing_until_its_time_is_over)
{
	struct bench *b = terminal_create(128);
	struct fault_plan *plan = plan_of("at=0s mailbox-stuck slave=0 for=50ms");
	uint8_t answer[128];

	terminal_to_preop(b, 128);
	judge(plan, b);
	CHECK_EQ(terminal_sdo(b, 0x40, 0x1018, 1, 0, answer), -1);
	bench_wait(b, 50 * MS);
	CHECK_EQ(terminal_sdo(b, 0x40, 0x1018, 1, 0, answer), 10);
	fault_plan_destroy(plan);
	bench_destroy(b);
}

TEST(sim_fault, a_changed_identity_is_read_from_the_eeprom)
{
	struct bench *b = two_slaves();
	struct fault_plan *plan = plan_of("at=0s identity slave=1 product=0xdeadbeef");
	uint8_t command[6] = { 0x00, 0x01, 0x0a };

	judge(plan, b);
	CHECK_EQ(bench_send(b, ECAT_CMD_FPWR, SECOND, ESC_REG_EEPROM_CONTROL, command, 6), 1);
	bench_wait(b, 2 * MS);
	CHECK_EQ(bench_read32(b, SECOND, ESC_REG_EEPROM_DATA), 0xdeadbeef);
	fault_plan_destroy(plan);
	bench_destroy(b);
}

TEST(sim_fault, a_full_plan_says_so)
{
	struct fault_plan *plan = fault_plan_create(1, 0);
	char error[128] = "";
	int n = 0;

	while (fault_plan_add(plan, "at=1s lose", 1, error, sizeof(error)) == 0) {
		n++;
	}
	CHECK_EQ(n, 1024);
	CHECK_STR(error, "more than FAULTS_MAX = 1024 faults");
	fault_plan_destroy(plan);
}
