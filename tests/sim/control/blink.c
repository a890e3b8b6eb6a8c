/* SPDX-License-Identifier: MIT */
/* The example "blink": the LED by process data, a pulse by one-shot SYNC0. */
#include "devices/fb1111_piccolo.h"
#include "harness/test.h"
#include "sim/harness/virtual_master.h"

enum { EVERY_CYCLES = 40, RUN_CYCLES = 1000 };

static struct virtual_bench b;
static struct virtual_master vm;

static void open_all(const char *const *settings)
{
	virtual_bench_init(&b, &(struct virtual_spec){ .ppm = { 40, -60 }, .seed = 5 });
	virtual_master_init(&vm, &b, settings);
	if (virtual_master_bring_up(&vm) < 0) {
		test_fail(__FILE__, __LINE__, "%s", vm.failure.text);
	}
}

static void close_all(void)
{
	virtual_master_close(&vm);
}

static int seen_op;
static unsigned wrong;
static unsigned changes;
static uint64_t last_led;

/* After each cycle: the LED bit in its frame is the one that its DC time requires. */
static void check_led(struct virtual_master *master)
{
	const struct sample_header *h;
	uint64_t led;
	int wanted;

	virtual_master_run(master, 0); /* takes the new sample */
	h = virtual_master_sample(master);
	if ((h->flags & (SAMPLE_NOT_OP | SAMPLE_FAIL_SAFE)) != 0) {
		return;
	}
	led = virtual_master_value(master, "a.led");
	wanted = h->dc_time_ns / (EVERY_CYCLES * NS_PER_MS) % 2 == 0;
	wrong += led != (uint64_t)wanted;
	changes += seen_op > 0 && led != last_led;
	last_led = led;
	seen_op++;
}

TEST(sim_control, blink_switches_the_led_in_exactly_the_promised_cycles)
{
	static const char *const settings[] = {
		"slaves[0].name=a",
		"control.program=" ECDAQ_EXAMPLE_PROGRAMS "/blink.so",
		"control.options=slave=a, every=40",
		"outputs[0].channel=a.led",
		"outputs[0].owner=program",
		"bus.presence=any",
		NULL,
	};
	int on = 0;

	seen_op = 0;
	wrong = changes = 0;
	open_all(settings);
	virtual_master_run(&vm, 10);
	vm.each_cycle = check_led;
	virtual_master_run(&vm, RUN_CYCLES);
	vm.each_cycle = NULL;
	CHECK(seen_op >= RUN_CYCLES - 10);
	CHECK_EQ(wrong, 0);
	CHECK_EQ(changes, RUN_CYCLES / EVERY_CYCLES);
	/* And the LED itself, once the board has looked at its outputs (every 10 ms). */
	for (int i = 0; i < 4; i++) {
		on += fb1111_piccolo_led(segment_device(b.segment, 0));
		virtual_master_run(&vm, EVERY_CYCLES);
	}
	CHECK_EQ(on, 2);
	CHECK_EQ(session_page(vm.session)->control.overruns, 0);
	CHECK_EQ(session_page(vm.session)->control.state, CONTROL_RUNNING);
	close_all();
}

TEST(sim_control, blink_fires_sync0_at_whole_multiples_on_the_dc_time_scale)
{
	static const char *const settings[] = {
		"slaves[0].name=a",
		"slaves[0].mode=oneshot",
		"slaves[1].name=b",
		"slaves[1].mode=oneshot",
		"control.program=" ECDAQ_EXAMPLE_PROGRAMS "/blink.so",
		"control.options=slave=a, by=oneshot, every=100, ahead=40",
		"outputs[0].channel=a.oneshot_time",
		"outputs[0].owner=program",
		NULL,
	};
	uint64_t edges;

	open_all(settings);
	edges = b.scope.edges[0];
	for (int i = 1; i <= 5; i++) {
		for (int n = 0; b.scope.edges[0] < edges + (unsigned)i && n < 300; n++) {
			virtual_master_run(&vm, 1);
		}
		CHECK_EQ(b.scope.edges[0], edges + (unsigned)i);
		CHECK_EQ(b.scope.system_ns[0] % (100 * NS_PER_MS), 0);
	}
	virtual_master_run(&vm, 5);
	CHECK_EQ(virtual_master_value(&vm, "a.sample_time"), b.scope.system_ns[0]);
	CHECK_EQ(b.scope.edges[1], 0);
	close_all();
}

static void check_refused(const char *options, const char *why)
{
	const char *settings[] = { "slaves[0].name=a", "bus.presence=any",
				   "control.program=" ECDAQ_EXAMPLE_PROGRAMS "/blink.so", options,
				   NULL };
	char wanted[320];

	virtual_bench_init(&b, &(struct virtual_spec){ .seed = 5 });
	virtual_master_init(&vm, &b, settings);
	CHECK(virtual_master_bring_up(&vm) < 0);
	CHECK_EQ(vm.failure.code, EXIT_CODE_CONFIG);
	snprintf(wanted, sizeof(wanted), "control: " ECDAQ_EXAMPLE_PROGRAMS "/blink.so: %s", why);
	CHECK_STR(vm.failure.text, wanted);
	close_all();
}

TEST(sim_control, blink_reports_errors_in_its_options)
{
	check_refused("control.options=slave=a",
		      "init() failed: a.led: does not belong to the program (outputs: owner: "
		      "program)");
	check_refused("control.options=slave=c",
		      "init() failed: c.led: no such channel (see `ecdaq channels`)");
	check_refused("control.options=by=hand", "init() failed: by is led or oneshot");
	check_refused("control.options=every=0",
		      "init() failed: every and ahead are 1 to 1000000 cycles");
	check_refused("control.options=every=x",
		      "init() failed: every: the value in control.options is not a number");
}
