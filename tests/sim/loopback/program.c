/* SPDX-License-Identifier: MIT */
/* The example "loopback" in the cycle: what goes in at the coupler comes out one cycle later. */
#include "coupler.h"
#include "harness/test.h"

enum { FIRST_LAMP = 4, LAST_LAMP = 8, SETTLE_CYCLES = 20, FAIL_SAFE_COUNTS = 1024 };
enum { HISTORY_CYCLES = 4096 };

#define PROGRAM(n, name) "outputs[" #n "].channel=wago0." name, "outputs[" #n "].owner=program"

static const char *const settings[] = {
	"control.program=" ECDAQ_EXAMPLE_PROGRAMS "/loopback.so",
	"bus.monitor=off",
	PROGRAM(0, "slot2_channel_1_data"),
	"outputs[0].fail_safe=1024",
	PROGRAM(1, "slot4_channel_4_data"),
	PROGRAM(2, "slot4_channel_5_data"),
	PROGRAM(3, "slot4_channel_6_data"),
	PROGRAM(4, "slot4_channel_7_data"),
	PROGRAM(5, "slot4_channel_8_data"),
	NULL,
};

static struct virtual_bench b;
static struct virtual_master vm;

/* One frame: what it carried to the coupler, what it brought back, and the terminals then. */
struct cycle_values {
	uint64_t cycle;
	uint32_t flags;
	int16_t ai;
	int16_t ao;
	uint8_t di;    /* channel 1 */
	uint8_t lamps; /* digital outputs, channel 1 in bit 0 */
	int terminal_ai;
	int terminal_ao;
	int terminal_lamp;
};

static struct cycle_values history[HISTORY_CYCLES];
static size_t history_count;

/* After each cycle, also those during waits of the service loop. */
static void remember(struct virtual_master *master)
{
	struct cycle_values *v = &history[history_count++];
	char name[64];

	CHECK(history_count <= HISTORY_CYCLES);
	virtual_master_run(master, 0); /* takes the new sample */
	*v = (struct cycle_values){ .cycle = virtual_master_sample(master)->cycle,
				    .flags = virtual_master_sample(master)->flags };
	v->ai = (int16_t)virtual_master_value(master, "wago0.slot1_channel_1_data");
	v->ao = (int16_t)virtual_master_value(master, "wago0.slot2_channel_1_data");
	v->di = (uint8_t)virtual_master_value(master, "wago0.slot3_channel_1_data");
	for (unsigned channel = 1; channel <= LAST_LAMP; channel++) {
		snprintf(name, sizeof(name), "wago0.slot4_channel_%u_data", channel);
		v->lamps |= (uint8_t)(virtual_master_value(master, name) << (channel - 1));
	}
	v->terminal_ai = coupler_get(&b, COUPLER_AI, 1);
	v->terminal_ao = coupler_get(&b, COUPLER_AO, 1);
	v->terminal_lamp = coupler_get(&b, COUPLER_DO, FIRST_LAMP);
}

/* All cycles were seen: each is one more than the one before. */
static void check_whole(void)
{
	CHECK(history_count > 1);
	for (size_t i = 1; i < history_count; i++) {
		CHECK_EQ(history[i].cycle, history[i - 1].cycle + 1);
	}
}

static uint8_t lamps_for(uint8_t di)
{
	return di != 0 ? (uint8_t)(0xff << (FIRST_LAMP - 1)) : 0;
}

static void open_all(void)
{
	coupler_bench_init(&b, 7.0);
	coupler_bring_up(&vm, &b, settings);
	virtual_master_run(&vm, SETTLE_CYCLES);
	virtual_master_forget(&vm);
	history_count = 0;
	vm.each_cycle = remember;
}

static void close_all(void)
{
	vm.each_cycle = NULL;
	CHECK_EQ(virtual_master_stop(&vm), 0);
	virtual_master_close(&vm);
}

TEST(sim_loopback, analog_output_1_is_analog_input_1_of_the_cycle_before)
{
	int changes = 0;

	open_all();
	CHECK_EQ(virtual_master_run(&vm, 3000), SESSION_GOES_ON);
	check_whole();
	for (size_t i = 1; i < history_count; i++) {
		CHECK_EQ(history[i].flags, 0);
		CHECK_EQ(history[i].ao, history[i - 1].ai);
		changes += history[i].ai != history[i - 1].ai;
	}
	/* A sine of 7 Hz that goes through its range is another value in nearly every cycle. */
	CHECK(changes > 2500);
	CHECK_EQ(vm.result.bad, 0);
	close_all();
}

TEST(sim_loopback, the_terminal_has_what_its_frame_carried_from_the_next_sync0_on)
{
	open_all();
	virtual_master_run(&vm, 500);
	check_whole();
	for (size_t i = 1; i < history_count; i++) {
		CHECK_EQ(history[i].terminal_ao, history[i - 1].ao);
		CHECK_EQ(history[i].terminal_ai, history[i].ai);
	}
	close_all();
}

TEST(sim_loopback, digital_input_1_drives_digital_outputs_4_to_8_in_the_next_frame)
{
	int edges = 0;

	open_all();
	for (int i = 0; i < 500; i++) {
		coupler_set(&b, COUPLER_DI, 1, i % 7 < 3);
		coupler_set(&b, COUPLER_DI, 2, i % 2); /* must not matter */
		virtual_master_run(&vm, 1);
	}
	check_whole();
	for (size_t i = 1; i < history_count; i++) {
		CHECK_EQ(history[i].lamps, lamps_for(history[i - 1].di));
		edges += history[i].di != history[i - 1].di;
	}
	CHECK(edges > 100);
	close_all();
}

TEST(sim_loopback, a_lost_frame_leaves_the_outputs_as_they_are)
{
	size_t lost = 0;

	open_all();
	virtual_master_run(&vm, 5);
	virtual_bench_fault(&b, "at=0s lose");
	virtual_master_run(&vm, 5);
	check_whole();
	while (lost < history_count && (history[lost].flags & SAMPLE_LOST) == 0) {
		lost++;
	}
	CHECK(lost >= 5 && lost + 2 < history_count);
	CHECK_EQ(history[lost].ao, history[lost - 1].ai);
	CHECK_EQ(history[lost + 1].flags & (SAMPLE_LOST | SAMPLE_FAIL_SAFE), 0);
	CHECK_EQ(history[lost + 1].ao, history[lost - 1].ai);
	CHECK_EQ(history[lost + 2].ao, history[lost + 1].ai);
	close_all();
}

/* What must hold from the first low working counter until the bus is in OP again. */
static size_t check_safe(size_t from)
{
	static const uint32_t trouble = SAMPLE_WKC_LOW | SAMPLE_NOT_OP;
	size_t i = from + 1;

	CHECK(history[from].flags & SAMPLE_WKC_LOW);
	for (; i < history_count && (history[i].flags & trouble) != 0; i++) {
		CHECK((history[i].flags & SAMPLE_FAIL_SAFE) != 0);
		CHECK_EQ(history[i].ao, FAIL_SAFE_COUNTS);
		CHECK_EQ(history[i].lamps, 0);
		CHECK_EQ(history[i].terminal_lamp, 0);
	}
	return i;
}

TEST(sim_loopback, a_low_working_counter_makes_the_outputs_safe_until_op_is_back)
{
	const struct cycle_values *last;
	size_t low = 0;
	size_t back;

	open_all();
	coupler_set(&b, COUPLER_DI, 1, 1);
	virtual_master_run(&vm, 5);
	CHECK_EQ(history[history_count - 1].lamps, 0xf8);
	/* A reset coupler forwards frames and does not process them: WKC 0. */
	virtual_bench_fault(&b, "at=0s reset slave=0");
	virtual_master_run(&vm, 2000);
	check_whole();
	while (low + 1 < history_count && (history[low].flags & SAMPLE_WKC_LOW) == 0) {
		low++;
	}
	back = check_safe(low);
	printf("OP again after %zu cycles\n", back - low);
	CHECK(back + 100 < history_count);
	last = &history[history_count - 1];
	CHECK_EQ(last->flags, 0);
	CHECK_EQ(last->lamps, 0xf8);
	CHECK_EQ(last->terminal_lamp, 1);
	close_all();
}

/* --- mismatches with the configuration --- */

static void check_bring_up_fails(const struct virtual_spec *spec, const char *const *config,
				 const char *const *wanted)
{
	virtual_bench_init(&b, spec);
	virtual_master_init(&vm, &b, config);
	CHECK(virtual_master_bring_up(&vm) < 0);
	for (; *wanted != NULL; wanted++) {
		if (strstr(vm.failure.text, *wanted) == NULL) {
			test_fail(__FILE__, __LINE__, "\"%s\" does not say \"%s\"", vm.failure.text,
				  *wanted);
		}
	}
	CHECK(strchr(vm.failure.text, '\n') == NULL);
	virtual_master_close(&vm);
}

TEST(sim_loopback, another_slave_than_the_coupler_is_named_with_both_identities)
{
	static const char *const config[] = { "slaves[0].vendor=0x21",
					      "slaves[0].product=0x07500354", NULL };
	static const char *const wanted[] = { "slave 0",
					      "expected vendor 0x00000021",
					      "product 0x07500354",
					      "found vendor 0x00000002",
					      "product 0x04570862",
					      NULL };

	check_bring_up_fails(&(struct virtual_spec){ .slaves = 1, .seed = 1 }, config, wanted);
}

TEST(sim_loopback, a_coupler_where_a_board_is_expected_is_named_too)
{
	static const char *const config[] = { "slaves[0].vendor=0x2",
					      "slaves[0].product=0x04570862", NULL };
	static const char *const wanted[] = { "expected vendor 0x00000002",
					      "found vendor 0x00000021 product 0x07500354",
					      "WAGO Series 750 Bus Coupler", NULL };

	check_bring_up_fails(&(struct virtual_spec){ .slaves = 1, .make = coupler_make, .seed = 1 },
			     config, wanted);
}

TEST(sim_loopback, the_program_on_boards_names_the_channel_that_is_missing)
{
	static const char *const config[] = { "control.program=" ECDAQ_EXAMPLE_PROGRAMS
					      "/loopback.so",
					      NULL };
	static const char *const wanted[] = { "loopback", "wago0.slot1_channel_1_data", NULL };

	check_bring_up_fails(&(struct virtual_spec){ .slaves = 1, .seed = 1 }, config, wanted);
}

TEST(sim_loopback, an_output_that_is_not_the_programs_is_named)
{
	static const char *const config[] = { "control.program=" ECDAQ_EXAMPLE_PROGRAMS
					      "/loopback.so",
					      NULL };
	static const char *const wanted[] = { "wago0.slot2_channel_1_data", "owner", NULL };

	check_bring_up_fails(&(struct virtual_spec){ .slaves = 1, .make = coupler_make, .seed = 1 },
			     config, wanted);
}
