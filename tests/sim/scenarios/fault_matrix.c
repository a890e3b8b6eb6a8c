/* SPDX-License-Identifier: MIT */
/*
 * The fault matrix: each fault in several buses, moments and crystals. Of every row: the session
 * goes on, the bus is in OP again within the bounds, the slave and the cause are named, and no
 * value that was called good is another than that of its SYNC0 edge.
 *
 * ECDAQ_FAULT_TRIALS: trials of each row (default: 2); `./build.sh measure faults` takes 20.
 */
#include "base/bytes.h"
#include "base/event.h"
#include "harness/test.h"
#include "sim/scenarios/fault_trial.h"
#include "wire/esc_reg.h"

enum {
	TRIALS_DEFAULT = 2,
	TRIALS_MAX = 1000,
	FIRST_SEED = 7000,
	SM_ACTIVATE = 6,
	SII_VENDOR_BYTE = 0x10,
	SII_PRODUCT_BYTE = 0x14,
	SII_ALIAS_BYTE = 0x08,
	OTHER_PRODUCT = 0x12345678,
	PICCOLO_PRODUCT = 0x04570862,
};

static unsigned trial_count(void)
{
	const char *given = getenv("ECDAQ_FAULT_TRIALS");
	unsigned long count = given != NULL ? strtoul(given, NULL, 10) : TRIALS_DEFAULT;

	if (count < 1 || count > TRIALS_MAX) {
		test_fail(__FILE__, __LINE__, "ECDAQ_FAULT_TRIALS=%s: 1 to %d", given, TRIALS_MAX);
	}
	return (unsigned)count;
}

static int by_size(const void *a, const void *b)
{
	double x = *(const double *)a;
	double y = *(const double *)b;

	return (x > y) - (x < y);
}

struct figures {
	double back_ms[TRIALS_MAX];
	double detect[TRIALS_MAX];
	double bad[TRIALS_MAX];
	uint64_t false_good;
	uint64_t good;
};

static void print_row(const struct fault_row *row, struct figures *fig, unsigned trials)
{
	static int has_head;

	if (!has_head) {
		printf("%-44s %6s  %15s  %15s  %15s  %10s\n", "fault", "trials", "to OP, ms",
		       "detection, cyc", "bad samples", "false good");
		has_head = 1;
	}
	qsort(fig->back_ms, trials, sizeof(double), by_size);
	qsort(fig->detect, trials, sizeof(double), by_size);
	qsort(fig->bad, trials, sizeof(double), by_size);
	printf("%-44s %6u  %7.0f %7.0f  %7.0f %7.0f  %7.0f %7.0f  %10llu\n", row->name, trials,
	       fig->back_ms[trials / 2], fig->back_ms[trials - 1], fig->detect[trials / 2],
	       fig->detect[trials - 1], fig->bad[trials / 2], fig->bad[trials - 1],
	       (unsigned long long)fig->false_good);
}

static void check_row(const struct fault_row *row)
{
	static struct fault_trial t;
	static struct figures fig;
	unsigned trials = trial_count();

	memset(&fig, 0, sizeof(fig));
	for (unsigned i = 0; i < trials; i++) {
		fault_trial_run(&t, row, FIRST_SEED + i);
		fig.back_ms[i] = fault_trial_back_ms(&t);
		fig.detect[i] = (double)t.flagged;
		fig.bad[i] = (double)t.bad;
		fig.false_good += t.false_good;
		fig.good += t.good;
		CHECK(t.good > 0);
		CHECK((t.flagged > 0) == (row->detect > 0));
		CHECK(t.bad >= row->least_bad);
		CHECK(!row->has_bad_limits || t.bad <= row->worst_bad);
		CHECK(t.rounds <= (row->rounds > 0 ? row->rounds : 1));
	}
	print_row(row, &fig, trials);
	CHECK_EQ(fig.false_good, 0);
	CHECK(fig.back_ms[0] >= row->least_ms);
	CHECK(fig.back_ms[trials - 1] <= row->worst_ms);
	CHECK(fig.detect[trials - 1] <= row->detect);
}

/* --- what a line of faults cannot do --- */

static void write_sii(struct fault_trial *t, unsigned slave, size_t byte, uint32_t value)
{
	put_le32(segment_esc(t->b.segment, slave)->sii + byte, value);
}

static void ask_clear(struct fault_trial *t)
{
	struct admin_request rq = { .magic = ADMIN_MAGIC, .verb = ADMIN_CLEAR };

	CHECK_EQ(virtual_master_ask(&t->vm, &rq).result, 0);
}

/* --- rows: cables and power --- */

TEST(sim_fault_matrix, the_cable_at_the_master)
{
	check_row(&(struct fault_row){ .name = "cable at the master, 500 ms",
				       .breaks = { "at=0s cut slave=0" },
				       .repairs = { "at=0s heal slave=0" },
				       .out_ms = 500,
				       .event = EVENT_LINK,
				       .slave = EVENT_NO_SLAVE,
				       .words = "3 lost: interface virtual has no link",
				       .least_ms = 40,
				       .worst_ms = 220,
				       .detect = 2 });
}

static void cable_between(const char *name, const char *datagrams)
{
	check_row(&(struct fault_row){ .name = name,
				       .setting = datagrams,
				       .breaks = { "at=0s cut slave=1" },
				       .repairs = { "at=0s heal slave=1" },
				       .out_ms = 500,
				       .event = EVENT_SLAVE_LOST,
				       .slave = 1,
				       .words = "slave 1 (b)",
				       .least_ms = 40,
				       .worst_ms = 200,
				       .detect = 2 });
}

TEST(sim_fault_matrix, a_cable_between_slaves_with_one_datagram)
{
	cable_between("cable between, one datagram, 500 ms", "bus.datagrams=one");
}

TEST(sim_fault_matrix, a_cable_between_slaves_with_a_datagram_per_slave)
{
	cable_between("cable between, per_slave, 500 ms", "bus.datagrams=per_slave");
}

static void power_cycle(const char *name, const char *setting, unsigned slave)
{
	char off[32];
	char on[32];

	snprintf(off, sizeof(off), "at=0s power-off slave=%u", slave);
	snprintf(on, sizeof(on), "at=0s power-on slave=%u", slave);
	check_row(&(struct fault_row){ .name = name,
				       .setting = setting,
				       .breaks = { off },
				       .repairs = { on },
				       .out_ms = 500,
				       .event = EVENT_SLAVE_LOST,
				       .slave = (uint16_t)slave,
				       .least_ms = 100,
				       .worst_ms = 1100,
				       .detect = 2 });
}

TEST(sim_fault_matrix, power_of_the_last_slave)
{
	power_cycle("power of the last slave, 500 ms", NULL, 2);
}

TEST(sim_fault_matrix, power_of_a_slave_in_the_middle)
{
	power_cycle("power of a slave in the middle, 500 ms", NULL, 1);
}

TEST(sim_fault_matrix, power_of_the_reference_clock)
{
	power_cycle("power of the reference, 500 ms", NULL, 0);
}

TEST(sim_fault_matrix, power_of_the_reference_clock_with_a_datagram_per_slave)
{
	power_cycle("power of the reference, per_slave, 500 ms", "bus.datagrams=per_slave", 0);
}

static void restart(const char *name, unsigned slave)
{
	char reset[32];

	snprintf(reset, sizeof(reset), "at=0s reset slave=%u", slave);
	check_row(&(struct fault_row){ .name = name,
				       .breaks = { reset },
				       .event = EVENT_SLAVE_LOST,
				       .slave = (uint16_t)slave,
				       .least_ms = 100,
				       .worst_ms = 1100,
				       .detect = 2 });
}

TEST(sim_fault_matrix, a_slave_restarts_alone)
{
	restart("a slave restarts alone", 1);
}

TEST(sim_fault_matrix, the_reference_clock_restarts_alone)
{
	restart("the reference restarts alone", 0);
}

/* --- rows: not what it was --- */

static void make_c_another_product(struct fault_trial *t)
{
	write_sii(t, 2, SII_PRODUCT_BYTE, OTHER_PRODUCT);
}

static void swap_b_and_c(struct fault_trial *t)
{
	uint32_t b = get_le32(segment_esc(t->b.segment, 1)->sii + SII_PRODUCT_BYTE);
	uint32_t c = get_le32(segment_esc(t->b.segment, 2)->sii + SII_PRODUCT_BYTE);

	write_sii(t, 1, SII_PRODUCT_BYTE, c);
	write_sii(t, 2, SII_PRODUCT_BYTE, b);
}

#define POWER_CYCLE_B "at=0s power-off slave=1", "at=300ms power-on slave=1"
#define POWER_CYCLE_C "at=0s power-off slave=2", "at=300ms power-on slave=2"

TEST(sim_fault_matrix, two_slaves_are_exchanged)
{
	check_row(&(struct fault_row){ .name = "two slaves exchanged, and back",
				       .prepare = make_c_another_product,
				       .breaks = { POWER_CYCLE_B, POWER_CYCLE_C },
				       .break_it = swap_b_and_c,
				       .repairs = { POWER_CYCLE_B, POWER_CYCLE_C },
				       .repair_it = swap_b_and_c,
				       .out_ms = 2000,
				       .repair_takes_ms = 300,
				       .must_be_out = 1,
				       .event = EVENT_STRANGER,
				       .slave = EVENT_NO_SLAVE,
				       .value = INT64_C(2) << 32 | OTHER_PRODUCT,
				       .words = "position 1: a device that is not configured: "
						"vendor 0x00000002 product 0x12345678",
				       .least_ms = 150,
				       .worst_ms = 1050,
				       .detect = 2 });
}

static void change_product(struct fault_trial *t)
{
	write_sii(t, 1, SII_PRODUCT_BYTE, OTHER_PRODUCT);
}

static void restore_product(struct fault_trial *t)
{
	write_sii(t, 1, SII_PRODUCT_BYTE, PICCOLO_PRODUCT);
}

/* Slave b is without power for 300 ms and comes back with another EEPROM; the same to repair it. */
static void other_eeprom(const char *name, void (*change)(struct fault_trial *t),
			 void (*restore)(struct fault_trial *t), uint16_t event, const char *words)
{
	check_row(&(struct fault_row){ .name = name,
				       .breaks = { POWER_CYCLE_B },
				       .break_it = change,
				       .repairs = { POWER_CYCLE_B },
				       .repair_it = restore,
				       .out_ms = 2000,
				       .repair_takes_ms = 300,
				       .must_be_out = 1,
				       .event = event,
				       .slave = 1,
				       .words = words,
				       .least_ms = 150,
				       .worst_ms = 1000,
				       .detect = 2 });
}

TEST(sim_fault_matrix, a_wrong_device_takes_the_place_of_a_slave)
{
	other_eeprom("a wrong device, and the right one again", change_product, restore_product,
		     EVENT_SLAVE_WRONG, "wrong device");
}

static void erase_vendor(struct fault_trial *t)
{
	write_sii(t, 1, SII_VENDOR_BYTE, UINT32_MAX);
}

static void restore_vendor(struct fault_trial *t)
{
	write_sii(t, 1, SII_VENDOR_BYTE, 2);
}

TEST(sim_fault_matrix, an_eeprom_is_blank_after_a_power_cycle)
{
	other_eeprom("EEPROM blank after a power cycle", erase_vendor, restore_vendor,
		     EVENT_SLAVE_UNREADABLE, "EEPROM");
}

static uint32_t alias_kept;

static void damage_checksum(struct fault_trial *t)
{
	alias_kept = get_le32(segment_esc(t->b.segment, 1)->sii + SII_ALIAS_BYTE);
	write_sii(t, 1, SII_ALIAS_BYTE, 0xffff1234);
}

static void restore_checksum(struct fault_trial *t)
{
	write_sii(t, 1, SII_ALIAS_BYTE, alias_kept);
}

TEST(sim_fault_matrix, the_checksum_of_an_eeprom_is_wrong_after_a_power_cycle)
{
	other_eeprom("EEPROM checksum wrong after a power cycle", damage_checksum, restore_checksum,
		     EVENT_SLAVE_UNREADABLE, "EEPROM");
}

/* --- rows: states and errors of slaves --- */

static void switch_off_outputs(struct fault_trial *t)
{
	virtual_bench_write(&t->b, 0x1002, ESC_REG_SM + 2 * ESC_SM_BYTES + SM_ACTIVATE, 0);
}

TEST(sim_fault_matrix, a_sync_manager_is_switched_off_behind_the_masters_back)
{
	check_row(&(struct fault_row){ .name = "output SM off behind the master's back",
				       .break_it = switch_off_outputs,
				       .event = EVENT_SLAVE_STATE,
				       .slave = 1,
				       .least_ms = 40,
				       .worst_ms = 250,
				       .detect = 2 });
}

static void al_error(const char *name, const char *fault, int64_t code)
{
	check_row(&(struct fault_row){ .name = name,
				       .breaks = { fault },
				       .event = EVENT_SLAVE_STATE,
				       .slave = 1,
				       .value = code,
				       .least_ms = 30,
				       .worst_ms = 200,
				       .detect = 2 });
}

TEST(sim_fault_matrix, al_error_synchronisation)
{
	al_error("AL 0x001a, synchronisation", "at=0s al-error slave=1 code=0x001a", 0x1a);
}

TEST(sim_fault_matrix, al_error_fatal_sync)
{
	al_error("AL 0x002c, fatal sync error", "at=0s al-error slave=1 code=0x002c", 0x2c);
}

TEST(sim_fault_matrix, al_error_pll)
{
	al_error("AL 0x0032, PLL error", "at=0s al-error slave=1 code=0x0032", 0x32);
}

TEST(sim_fault_matrix, sync0_pulses_are_missing)
{
	check_row(&(struct fault_row){ .name = "300 SYNC0 pulses missing",
				       .breaks = { "at=0s sync0-lost slave=1 count=300" },
				       .event = EVENT_SLAVE_STATE,
				       .slave = 1,
				       .least_ms = 400,
				       .worst_ms = 2400,
				       .detect = 2 });
}

TEST(sim_fault_matrix, al_error_again_whenever_the_bus_is_in_op)
{
	check_row(&(struct fault_row){ .name = "AL 0x002c again whenever in OP, 10 s",
				       .setting = "bus.recovery_attempts=1000",
				       .breaks = { "at=0s al-error slave=1 code=0x002c" },
				       .out_ms = 10000,
				       .is_repeated = 1,
				       .event = EVENT_SLAVE_STATE,
				       .slave = 1,
				       .value = 0x2c,
				       .words = "slave 1 (b)",
				       .least_ms = 500,
				       .worst_ms = 8000,
				       .detect = 2,
				       .rounds = 6 });
}

static void not_retried(const char *name, const char *fault, int64_t code)
{
	check_row(&(struct fault_row){ .name = name,
				       .breaks = { fault },
				       .repair_it = ask_clear,
				       .out_ms = 3000,
				       .must_be_out = 1,
				       .event = EVENT_SLAVE_ALARM,
				       .slave = 1,
				       .value = code,
				       .words = "slave 1 (b)",
				       .least_ms = 30,
				       .worst_ms = 200,
				       .detect = 2 });
}

TEST(sim_fault_matrix, al_error_sync_configuration_waits_for_a_clear)
{
	not_retried("AL 0x0030, until cleared", "at=0s al-error slave=1 code=0x0030", 0x30);
}

TEST(sim_fault_matrix, al_error_sync_cycle_time_waits_for_a_clear)
{
	not_retried("AL 0x0035, until cleared", "at=0s al-error slave=1 code=0x0035", 0x35);
}

TEST(sim_fault_matrix, al_error_eeprom_waits_for_a_clear)
{
	not_retried("AL 0x0050, until cleared", "at=0s al-error slave=1 code=0x0050", 0x50);
}

static int read_vendor(struct fault_trial *t)
{
	struct admin_request rq = { .magic = ADMIN_MAGIC,
				    .verb = ADMIN_SDO_READ,
				    .slave_pos = 1,
				    .index = 0x1018,
				    .subindex = 1 };
	struct admin_reply reply = virtual_master_ask(&t->vm, &rq);

	snprintf(t->asked, sizeof(t->asked), "%s", reply.text);
	return reply.result;
}

static void ask_dead_mailbox(struct fault_trial *t)
{
	CHECK(read_vendor(t) < 0);
	CHECK(strstr(t->asked, "slave 1") != NULL);
}

static void ask_until_answered(struct fault_trial *t)
{
	while (read_vendor(t) < 0) {
		CHECK(virtual_bench_now_ns(&t->b) < t->repaired_ns + 10 * NS_PER_S);
	}
	t->served_ns = virtual_bench_now_ns(&t->b);
}

TEST(sim_fault_matrix, a_mailbox_is_stuck_while_a_request_is_pending)
{
	check_row(&(struct fault_row){ .name = "mailbox stuck, with a request",
				       .breaks = { "at=0s mailbox-stuck slave=1 for=2500ms" },
				       .break_it = ask_dead_mailbox,
				       .repair_it = ask_until_answered,
				       .out_ms = 2500,
				       .least_ms = 20,
				       .worst_ms = 150 });
}

/* --- rows: frames and the host --- */

/* From @least_bad to @worst_bad bad samples; that long OP may be left, too. */
static void frames(const char *name, const char *fault, uint16_t event, unsigned least_bad,
		   unsigned worst_bad)
{
	check_row(&(struct fault_row){ .name = name,
				       .breaks = { fault },
				       .event = event,
				       .slave = EVENT_NO_SLAVE,
				       .has_bad_limits = 1,
				       .least_bad = least_bad,
				       .worst_bad = worst_bad,
				       .worst_ms = worst_bad,
				       .detect = 2 });
}

TEST(sim_fault_matrix, a_frame_is_lost)
{
	frames("a frame lost behind the slaves", "at=0s lose", EVENT_FRAME_LOST, 1, 1);
}

TEST(sim_fault_matrix, a_frame_is_dropped)
{
	frames("a frame lost before the slaves", "at=0s drop", EVENT_FRAME_LOST, 1, 1);
}

TEST(sim_fault_matrix, a_frame_is_damaged)
{
	frames("a frame damaged on the wire", "at=0s damage slave=1", EVENT_FRAME_LOST, 1, 1);
}

TEST(sim_fault_matrix, frames_are_lost_for_50_ms)
{
	frames("frames lost for 50 ms", "at=0s for=50ms drop", EVENT_FRAME_LOST, 49, 250);
}

TEST(sim_fault_matrix, a_frame_is_late)
{
	frames("a frame late by 1.5 ms", "at=0s delay by=1500us", EVENT_FRAME_LATE, 1, 1);
}

TEST(sim_fault_matrix, a_frame_comes_twice)
{
	frames("a frame doubled", "at=0s double", EVENT_FRAME_DOUBLED, 0, 0);
}

TEST(sim_fault_matrix, a_frame_is_held_until_the_next_one)
{
	frames("a frame held until the next one", "at=0s hold", EVENT_FRAME_LATE, 1, 1);
}

TEST(sim_fault_matrix, a_frame_is_truncated)
{
	frames("a frame truncated", "at=0s truncate", EVENT_FRAME_LOST, 1, 1);
}

static void hold_up(struct fault_trial *t)
{
	in_process_stall(t->b.host, 300 * NS_PER_MS);
}

TEST(sim_fault_matrix, the_master_is_held_up_for_300_ms)
{
	check_row(&(struct fault_row){ .name = "the master held up 300 ms",
				       .break_it = hold_up,
				       .event = EVENT_OVERRUN,
				       .slave = EVENT_NO_SLAVE,
				       .least_ms = 300,
				       .worst_ms = 800,
				       .detect = 2 });
}
