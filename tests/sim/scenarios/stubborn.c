/* SPDX-License-Identifier: MIT */
/*
 * Slaves that are slow, refuse, fall back again and again, or are not what they were: how often the
 * master tries, what it reports, and what ends it.
 */
#include <stdio.h>
#include <unistd.h>

#include "base/bytes.h"
#include "harness/test.h"
#include "sim/harness/run_dir.h"
#include "sim/harness/virtual_master.h"
#include "wire/al.h"
#include "wire/esc_reg.h"

enum { SII_VENDOR_BYTE = 0x10, SII_PRODUCT_BYTE = 0x14, SII_ALIAS_BYTE = 0x08, SM_ACTIVATE = 6 };

static struct virtual_bench b;
static struct virtual_master vm;
static struct ring_reader *events;

static const struct status_page *page(void)
{
	return session_page(vm.session);
}

static uint32_t state(void)
{
	return atomic_load(&page()->bus_state);
}

static void open_with(const char *setting)
{
	const char *const settings[] = { "slaves[0].name=a", "slaves[1].name=b", setting, NULL };
	char path[200];

	virtual_bench_init(&b,
			   &(struct virtual_spec){ .slaves = 2, .seed = 5, .ppm = { 30, -40 } });
	virtual_master_init(&vm, &b, settings);
	virtual_master_settle(&vm);
	snprintf(path, sizeof(path), "%s/" CONFIG_RUN_EVENTS, vm.dir);
	CHECK_EQ(ring_reader_open(path, &events), 0);
	ring_seek(events, ring_newest(events));
}

static void close_all(void)
{
	ring_reader_destroy(events);
	virtual_master_close(&vm);
}

/* Events since the last call; @ret_last the newest with @id. */
static unsigned count_events(uint16_t id, struct event *ret_last)
{
	struct event ev;
	uint64_t lost;
	unsigned count = 0;

	while (ring_read(events, &ev, sizeof(ev), &lost) == RING_OK) {
		count += id == EVENT_NONE || ev.id == id;
		if (ev.id == id && ret_last != NULL) {
			*ret_last = ev;
		}
	}
	return count;
}

static void power_cycle(void)
{
	virtual_bench_fault(&b, "at=10ms power-off slave=1");
	virtual_bench_fault(&b, "at=500ms power-on slave=1");
	virtual_master_run(&vm, 600);
}

/* Seconds until the bus is in OP. */
static unsigned run_to_op(unsigned limit_s)
{
	for (unsigned s = 0; s <= limit_s; s++) {
		if (state() == BUS_OP) {
			return s;
		}
		virtual_master_run(&vm, 1000);
	}
	virtual_master_print_events(&vm, 10);
	test_fail(__FILE__, __LINE__, "not in OP after %u s: %s", limit_s, page()->message);
}

/* D5 */
static void check_slow(const char *fault, const char *setting, unsigned at_least_s,
		       unsigned at_most_s)
{
	unsigned s;

	open_with(setting);
	virtual_bench_fault(&b, fault);
	power_cycle();
	s = run_to_op(30);
	printf("%s: OP again after %u s\n", fault, s);
	CHECK(s >= at_least_s);
	CHECK(s <= at_most_s);
	CHECK_EQ(count_events(EVENT_SLAVE_ALARM, NULL), 0);
	close_all();
}

TEST(sim_stubborn, a_slave_that_needs_three_seconds_for_safe_op_comes_back)
{
	check_slow("at=0s slow slave=1 state=safeop by=3s", "slaves[1].op_timeout=0s", 3, 5);
}

TEST(sim_stubborn, a_slave_that_needs_nine_seconds_for_op_comes_back)
{
	check_slow("at=0s slow slave=1 state=op by=9s", "slaves[1].op_timeout=0s", 9, 11);
}

TEST(sim_stubborn, a_slave_comes_back_in_the_time_its_configuration_gives_it)
{
	check_slow("at=0s slow slave=1 state=preop by=8s", "slaves[1].preop_timeout=10s", 8, 11);
}

TEST(sim_stubborn, a_slave_comes_back_in_the_time_its_vendor_gives_it)
{
	static const char text[] =
		"<EtherCATInfo><Vendor><Id>2</Id></Vendor><Descriptions><Devices><Device><Type "
		"ProductCode=\"#x04570862\" RevisionNo=\"0\">B</Type><Info><StateMachine><Timeout>"
		"<PreopTimeout>10000</PreopTimeout></Timeout></StateMachine></Info></Device>"
		"</Devices></Descriptions></EtherCATInfo>";
	char dir[64];
	char path[96];
	char setting[96];
	FILE *file;

	run_dir_make(dir, sizeof(dir));
	snprintf(path, sizeof(path), "%s/board.xml", dir);
	snprintf(setting, sizeof(setting), "bus.esi_dir=%s", dir);
	file = fopen(path, "we");
	CHECK(file != NULL);
	CHECK(fputs(text, file) >= 0);
	CHECK_EQ(fclose(file), 0);
	check_slow("at=0s slow slave=1 state=preop by=8s", setting, 8, 11);
	unlink(path);
	run_dir_remove(dir);
}

TEST(sim_stubborn, a_slave_slower_than_its_time_is_named_and_started_over)
{
	open_with("slaves[1].op_timeout=2s");
	virtual_bench_fault(&b, "at=0s slow slave=1 state=safeop by=1000s");
	power_cycle();
	virtual_master_run(&vm, 3000);
	printf("%s\n", page()->message);
	CHECK(strstr(page()->message, "slave 1 (b)") != NULL);
	CHECK(strstr(page()->message, "did not arrive in time") != NULL);
	/* Longer pauses than its time-outs: these begin after the pause. */
	virtual_master_run(&vm, 20000);
	CHECK_EQ(count_events(EVENT_SLAVE_ALARM, NULL), 0);
	virtual_bench_fault(&b, "at=0s obey slave=1");
	CHECK(run_to_op(20) <= 17);
	close_all();
}

/* D12 */
TEST(sim_stubborn, a_slave_that_refuses_for_ever_is_named_with_its_reason_and_few_events)
{
	unsigned count;

	open_with("bus.recovery_attempts=1000");
	virtual_bench_fault(&b, "at=0s refuse slave=1 state=safeop code=0x0018");
	power_cycle();
	virtual_master_run(&vm, 60000);
	count = count_events(EVENT_NONE, NULL);
	printf("%u events in a minute: %s\n", count, page()->message);
	CHECK(count >= 3);
	CHECK(count <= 40);
	CHECK(strstr(page()->message, "slave 1 (b)") != NULL);
	CHECK(strstr(page()->message, "refuses SAFE-OP") != NULL);
	CHECK(strstr(page()->message, "0x0018, no valid inputs available") != NULL);
	CHECK(strstr(page()->message, "attempt ") != NULL);
	virtual_bench_fault(&b, "at=0s obey slave=1");
	CHECK(run_to_op(40) <= 35);
	CHECK_STR(page()->message, "");
	close_all();
}

static void ask_clear(void)
{
	struct admin_request rq = { .magic = ADMIN_MAGIC, .verb = ADMIN_CLEAR };

	CHECK_EQ(virtual_master_ask(&vm, &rq).result, 0);
}

TEST(sim_stubborn, after_the_last_attempt_an_alarm_stands_until_the_operator_clears_it)
{
	struct event alarm = { 0 };

	open_with("bus.recovery_attempts=3");
	virtual_bench_fault(&b, "at=0s refuse slave=1 state=safeop code=0x0018");
	power_cycle();
	virtual_master_run(&vm, 20000);
	CHECK_EQ(count_events(EVENT_SLAVE_ALARM, &alarm), 1);
	CHECK_EQ(alarm.slave_pos, 1);
	CHECK_EQ(alarm.arg[1], 3);
	CHECK_EQ(alarm.value, 0x18);
	CHECK(strstr(page()->message, "not tried again") != NULL);
	virtual_bench_fault(&b, "at=0s obey slave=1");
	virtual_master_run(&vm, 60000);
	CHECK_EQ(state(), BUS_RECOVERING);
	ask_clear();
	CHECK(run_to_op(5) <= 2);
	close_all();
}

TEST(sim_stubborn, a_power_cycle_ends_an_alarm_too)
{
	open_with("bus.recovery_attempts=1");
	virtual_bench_fault(&b, "at=0s refuse slave=1 state=safeop code=0x0018");
	power_cycle();
	virtual_master_run(&vm, 5000);
	CHECK_EQ(count_events(EVENT_SLAVE_ALARM, NULL), 1);
	virtual_bench_fault(&b, "at=0s obey slave=1");
	power_cycle();
	CHECK(run_to_op(5) <= 2);
	close_all();
}

/* Row 17, 19: what no repetition cures. */
TEST(sim_stubborn, an_error_that_needs_a_person_is_not_tried_again)
{
	static const unsigned code[] = { 0x0030, 0x0035, 0x0050, 0x0051 };

	for (size_t i = 0; i < sizeof(code) / sizeof(code[0]); i++) {
		char fault[64];
		char text[16];

		open_with("bus.recovery_attempts=1000");
		snprintf(fault, sizeof(fault), "at=0s al-error slave=1 code=0x%04x", code[i]);
		virtual_bench_fault(&b, fault);
		virtual_master_run(&vm, 60000);
		snprintf(text, sizeof(text), "0x%04x", code[i]);
		CHECK(strstr(page()->message, text) != NULL);
		CHECK(strstr(page()->message, "slave 1 (b)") != NULL);
		CHECK_EQ(state(), BUS_RECOVERING);
		CHECK_EQ(count_events(EVENT_SLAVE_ALARM, NULL), 1);
		ask_clear();
		CHECK(run_to_op(5) <= 1);
		close_all();
	}
}

/* Row 16p: 171 rounds in 10 s before. */
TEST(sim_stubborn, a_slave_that_falls_back_whenever_it_is_in_op_is_given_more_and_more_time)
{
	unsigned rounds = 0;
	unsigned count;
	int was_op = 0;

	open_with("bus.recovery_attempts=1000");
	for (unsigned ms = 0; ms < 10000; ms += 10) {
		int is_op = state() == BUS_OP;

		if (is_op && !was_op) {
			virtual_bench_fault(&b, "at=0s al-error slave=1 code=0x002c");
			rounds++;
		}
		was_op = is_op;
		virtual_master_run(&vm, 10);
	}
	count = count_events(EVENT_NONE, NULL);
	printf("%u rounds, %u events in 10 s: %s\n", rounds, count, page()->message);
	CHECK(rounds >= 3);
	CHECK(rounds <= 6);
	CHECK(count <= 60);
	CHECK(strstr(page()->message, "slave 1 (b)") != NULL);
	CHECK(strstr(page()->message, "0x002c") != NULL);
	CHECK(run_to_op(20) <= 10);
	close_all();
}

/* --- not what it was --- */

static void swap_device(void)
{
	struct esc *esc = segment_esc(b.segment, 1);

	virtual_bench_fault(&b, "at=10ms power-off slave=1");
	virtual_master_run(&vm, 500);
	put_le32(esc->sii + SII_PRODUCT_BYTE, 0x12345678);
	virtual_bench_fault(&b, "at=0s power-on slave=1");
	virtual_master_run(&vm, 2000);
}

TEST(sim_stubborn, a_wrong_device_at_run_time_is_named_and_the_right_one_is_taken_back)
{
	struct esc *esc;
	struct event wrong = { 0 };

	open_with("bus.recovery_attempts=10");
	esc = segment_esc(b.segment, 1);
	swap_device();
	printf("%s\n", page()->message);
	CHECK_EQ(count_events(EVENT_SLAVE_WRONG, &wrong), 1);
	CHECK_EQ(wrong.slave_pos, 1);
	CHECK_EQ((uint32_t)wrong.value, 0x12345678);
	CHECK(strstr(page()->message, "wrong device") != NULL);
	CHECK(strstr(page()->message, "product 0x12345678") != NULL);
	CHECK(strstr(page()->message, "slave 1 (b)") != NULL);
	CHECK_EQ(get_le16(esc->reg + ESC_REG_AL_STATUS), AL_INIT);
	virtual_bench_fault(&b, "at=0s power-off slave=1");
	virtual_master_run(&vm, 500);
	put_le32(esc->sii + SII_PRODUCT_BYTE, 0x04570862);
	virtual_bench_fault(&b, "at=0s power-on slave=1");
	virtual_master_run(&vm, 10);
	CHECK(run_to_op(5) <= 2);
	CHECK_STR(page()->message, "");
	close_all();
}

static void check_unreadable(size_t sii_byte, uint32_t value)
{
	struct event unreadable = { 0 };
	struct esc *esc;
	uint32_t kept;

	open_with("bus.recovery_attempts=10");
	esc = segment_esc(b.segment, 1);
	virtual_bench_fault(&b, "at=10ms power-off slave=1");
	virtual_master_run(&vm, 500);
	kept = get_le32(esc->sii + sii_byte);
	put_le32(esc->sii + sii_byte, value);
	virtual_bench_fault(&b, "at=0s power-on slave=1");
	virtual_master_run(&vm, 5000);
	printf("%s\n", page()->message);
	CHECK_EQ(count_events(EVENT_SLAVE_UNREADABLE, &unreadable), 1);
	CHECK_EQ(unreadable.slave_pos, 1);
	CHECK(strstr(page()->message, "EEPROM") != NULL);
	CHECK(strstr(page()->message, "slave 1 (b)") != NULL);
	virtual_bench_fault(&b, "at=0s power-off slave=1");
	virtual_master_run(&vm, 500);
	put_le32(esc->sii + sii_byte, kept);
	virtual_bench_fault(&b, "at=0s power-on slave=1");
	virtual_master_run(&vm, 10);
	CHECK(run_to_op(5) <= 2);
	close_all();
}

/* Row 19 */
TEST(sim_stubborn, a_blank_or_damaged_eeprom_at_run_time_is_named)
{
	check_unreadable(SII_VENDOR_BYTE, UINT32_MAX);
	check_unreadable(SII_ALIAS_BYTE, 0xffff1234); /* the checksum is wrong */
}

/* D17: the same type with another revision has another mapping. */
TEST(sim_stubborn, another_revision_in_the_place_is_a_wrong_device)
{
	struct esc *esc;

	open_with("bus.recovery_attempts=10");
	esc = segment_esc(b.segment, 1);
	virtual_bench_fault(&b, "at=10ms power-off slave=1");
	virtual_master_run(&vm, 500);
	put_le32(esc->sii + SII_PRODUCT_BYTE + 4, 0x7);
	virtual_bench_fault(&b, "at=0s power-on slave=1");
	virtual_master_run(&vm, 3000);
	CHECK_EQ(count_events(EVENT_SLAVE_WRONG, NULL), 1);
	CHECK(strstr(page()->message, "revision 0x00000007") != NULL);
	CHECK_EQ(get_le16(esc->reg + ESC_REG_AL_STATUS), AL_INIT);
	close_all();
}

/* D22: such a number was ignored for ever. */
TEST(sim_stubborn, a_slave_in_a_state_that_does_not_exist_is_named_and_started_over)
{
	static const uint8_t number[] = { 5, 7, 9, 0 };

	for (size_t i = 0; i < sizeof(number); i++) {
		open_with("bus.recovery_attempts=10");
		virtual_bench_fault(&b, "at=0s slow slave=1 state=preop by=500ms");
		esc_force_al_status(segment_esc(b.segment, 1), number[i], 0);
		virtual_master_run(&vm, 15);
		CHECK_EQ(state(), BUS_RECOVERING);
		printf("%u: %s\n", number[i], page()->message);
		CHECK(strstr(page()->message,
			     "slave 1 (b): is in an AL state that does not exist") != NULL);
		CHECK(run_to_op(5) <= 2);
		close_all();
	}
}

/* Row 4: nobody loses a link, the address is gone. */
TEST(sim_stubborn, a_slave_that_restarts_by_itself_is_back_soon)
{
	open_with("bus.recovery_attempts=10");
	for (unsigned slave = 0; slave < 2; slave++) {
		char fault[40];
		unsigned ms = 0;

		snprintf(fault, sizeof(fault), "at=0s reset slave=%u", slave);
		virtual_bench_fault(&b, fault);
		virtual_master_run(&vm, 50);
		CHECK_EQ(state(), BUS_RECOVERING);
		while (state() != BUS_OP && ms < 2000) {
			virtual_master_run(&vm, 10);
			ms += 10;
		}
		printf("%s: OP again after %u ms\n", fault, ms);
		CHECK(ms <= 1000);
	}
	close_all();
}

/* Row 8 */
TEST(sim_stubborn, a_slave_whose_output_sync_manager_was_switched_off_is_set_up_again)
{
	unsigned ms = 0;

	open_with("bus.recovery_attempts=10");
	virtual_bench_write(&b, 0x1002, ESC_REG_SM + 2 * ESC_SM_BYTES + SM_ACTIVATE, 0);
	virtual_master_run(&vm, 300);
	while (state() != BUS_OP && ms < 5000) {
		virtual_master_run(&vm, 10);
		ms += 10;
	}
	printf("SM 2 off: OP again after %u ms: %s\n", ms, page()->message);
	CHECK_EQ(state(), BUS_OP);
	CHECK(count_events(EVENT_SLAVE_STATE, NULL) > 0);
	virtual_master_forget(&vm);
	virtual_master_run(&vm, 500);
	CHECK_EQ(vm.result.wkc_low, 0);
	close_all();
}
