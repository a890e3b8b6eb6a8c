/* SPDX-License-Identifier: MIT */
/* Programs that crash, request fail-safe, take too long, or run when the bus fails. */
#include <errno.h>
#include <signal.h>

#include "base/event.h"
#include "devices/fb1111_piccolo.h"
#include "harness/control_probe/probe.h"
#include "harness/test.h"
#include "sim/harness/rt_guard.h"
#include "sim/harness/virtual_master.h"
#include "wire/al.h"

static const char *const settings[] = {
	"slaves[0].name=a",         "bus.presence=any",         "control.program=" PROBE_PATH,
	"outputs[0].channel=a.led", "outputs[0].owner=program", NULL,
};

static struct virtual_bench b;
static struct virtual_master vm;
static struct ecdaq_output led;
static uint64_t crash_at;
static uint64_t calls;
static unsigned firsts;

static int find(const struct ecdaq_init *in, void **ret_state)
{
	(void)ret_state;
	return ecdaq_find_output(in, "a.led", &led);
}

static int light_up(const struct ecdaq_cycle *cy, void *state)
{
	(void)state;
	calls++;
	firsts += (cy->flags & ECDAQ_FIRST) != 0;
	ecdaq_set(cy, led, 1);
	if (cy->number == crash_at) {
		raise(SIGSEGV);
	}
	return ECDAQ_GO_ON;
}

static void open_with(const char *const *wanted,
		      int (*cycle)(const struct ecdaq_cycle *cy, void *state))
{
	struct probe *probe = probe_use();

	probe->init = find;
	probe->cycle = cycle;
	crash_at = UINT64_MAX;
	calls = firsts = 0;
	virtual_bench_init(&b, &(struct virtual_spec){ .ppm = { 40, -60 }, .seed = 5 });
	virtual_master_init(&vm, &b, wanted);
	if (virtual_master_bring_up(&vm) < 0) {
		test_fail(__FILE__, __LINE__, "%s", vm.failure.text);
	}
	virtual_master_run(&vm, 100);
	CHECK_EQ(fb1111_piccolo_led(segment_device(b.segment, 0)), 1);
}

static void open_all(int (*cycle)(const struct ecdaq_cycle *cy, void *state))
{
	open_with(settings, cycle);
}

static void close_all(void)
{
	virtual_master_close(&vm);
}

/* How many events of this kind there were, and the text of the last one. */
static unsigned events(enum event_id id, char *ret_text, size_t text_bytes)
{
	struct ring_reader *reader = NULL;
	struct event ev;
	char path[128];
	uint64_t lost;
	unsigned count = 0;

	snprintf(path, sizeof(path), "%s/" CONFIG_RUN_EVENTS, vm.dir);
	CHECK_EQ(ring_reader_open(path, &reader), 0);
	ring_seek(reader, ring_oldest(reader));
	while (ring_read(reader, &ev, sizeof(ev), &lost) == RING_OK) {
		if (ev.id == id) {
			count++;
			event_format(&ev, ret_text, text_bytes);
		}
	}
	ring_reader_destroy(reader);
	return count;
}

static uint64_t safe_from; /* first cycle after the crash whose frame carried LED off */
static uint64_t lit_after;

static void watch_led(struct virtual_master *master)
{
	const struct sample_header *h;

	virtual_master_run(master, 0);
	h = virtual_master_sample(master);
	if (h->cycle <= crash_at) {
		return;
	}
	if (virtual_master_value(master, "a.led") != 0) {
		lit_after++;
	} else if (safe_from == 0) {
		safe_from = h->cycle;
		CHECK((h->flags & SAMPLE_FAIL_SAFE) != 0);
	}
}

TEST(sim_control, a_crash_is_followed_by_fail_safe_frames_and_an_orderly_end)
{
	char text[256] = "";
	int r;

	safe_from = lit_after = 0;
	open_all(light_up);
	crash_at = virtual_master_sample(&vm)->cycle + 50;
	vm.each_cycle = watch_led;
	r = virtual_master_run(&vm, 1000);
	vm.each_cycle = NULL;
	CHECK_EQ(r, -EFAULT);
	CHECK_EQ(vm.failure.code, EXIT_CODE_CONTROL);
	CHECK(strstr(vm.failure.text, "crashed with SIGSEGV") != NULL);
	/* The frame right after the crash is safe already, and so are the last four. */
	CHECK_EQ(safe_from, crash_at + 1);
	CHECK_EQ(lit_after, 0);
	CHECK_EQ(virtual_master_sample(&vm)->cycle, crash_at + 4);
	CHECK_EQ(events(EVENT_CONTROL_CRASHED, text, sizeof(text)), 1);
	CHECK(strstr(text, "(SEGV)") != NULL);
	CHECK_EQ(session_page(vm.session)->control.state, CONTROL_CRASHED);
	CHECK_EQ(virtual_master_stop(&vm), 0);
	CHECK_EQ(fb1111_piccolo_led(segment_device(b.segment, 0)), 0);
	close_all();
}

TEST(sim_control, when_the_process_dies_the_slave_s_own_watchdog_makes_the_outputs_safe)
{
	uint8_t status;
	int64_t start_ns;

	open_all(light_up);
	start_ns = virtual_bench_now_ns(&b);
	session_drop(vm.session); /* as by SIGKILL, or by a program that never comes back */
	segment_advance(b.segment, start_ns + 50 * NS_PER_MS);
	CHECK_EQ(fb1111_piccolo_led(segment_device(b.segment, 0)), 1);
	segment_advance(b.segment, start_ns + 160 * NS_PER_MS); /* bus.watchdog is 100 ms */
	CHECK_EQ(fb1111_piccolo_led(segment_device(b.segment, 0)), 0);
	esc_pdi_read(segment_esc(b.segment, 0), start_ns + 160 * NS_PER_MS, 0x0130, &status, 1);
	CHECK_EQ(status, AL_SAFEOP | AL_ERROR);
	close_all();
}

TEST(sim_control, a_program_runs_in_op_only_and_restarts_when_op_is_back)
{
	uint64_t before;

	open_all(light_up);
	CHECK_EQ(firsts, 1);
	virtual_bench_fault(&b, "at=0s al-error slave=1 code=0x1b");
	virtual_master_run(&vm, 20);
	before = calls;
	virtual_master_run(&vm, 3000);
	CHECK_EQ(session_page(vm.session)->bus_state, BUS_OP);
	CHECK_EQ(firsts, 2);
	CHECK(calls > before);
	CHECK(calls < 100 + 20 + 3000);
	virtual_master_stop(&vm);
	before = calls;
	CHECK_EQ(session_page(vm.session)->control.state, CONTROL_WAITING);
	CHECK_EQ(calls, before);
	close_all();
}

static int inits;
static int exits;

static int count_init(const struct ecdaq_init *in, void **ret_state)
{
	inits++;
	return find(in, ret_state);
}

static void count_exit(void *state)
{
	(void)state;
	exits++;
}

TEST(sim_control, each_bring_up_has_its_own_init_and_exit)
{
	struct probe *probe;

	inits = exits = 0;
	open_all(light_up);
	probe = probe_use();
	*probe = (struct probe){ .init = count_init, .cycle = light_up, .exit = count_exit };
	CHECK_EQ(virtual_master_stop(&vm), 0);
	CHECK_EQ(exits, 1);
	CHECK_EQ(virtual_master_bring_up(&vm), 0);
	CHECK_EQ(inits, 1);
	CHECK_EQ(exits, 1);
	virtual_master_run(&vm, 100);
	CHECK_EQ(virtual_master_value(&vm, "a.led"), 1);
	CHECK_EQ(virtual_master_stop(&vm), 0);
	CHECK_EQ(exits, 2);
	close_all();
}

static int make_safe(const struct ecdaq_cycle *cy, void *state)
{
	(void)state;
	ecdaq_set(cy, led, 1);
	calls++;
	return calls > 150 ? ECDAQ_MAKE_SAFE : ECDAQ_GO_ON;
}

TEST(sim_control, fail_safe_requested_by_a_program_is_in_the_next_frame)
{
	open_all(make_safe);
	virtual_master_run(&vm, 200 - calls);
	CHECK_EQ(calls, 200);
	CHECK_EQ(virtual_master_value(&vm, "a.led"), 0);
	CHECK((virtual_master_sample(&vm)->flags & SAMPLE_FAIL_SAFE) != 0);
	CHECK_EQ(session_page(vm.session)->control.safe_cycles, 50);
	CHECK_EQ(session_page(vm.session)->control.state, CONTROL_SAFE);
	virtual_master_stop(&vm);
	close_all();
}

static uint64_t slow_at;

/* In that cycle it takes 300 us of virtual time. */
static int be_slow_once(const struct ecdaq_cycle *cy, void *state)
{
	(void)state;
	calls++;
	ecdaq_set(cy, led, 1);
	if (cy->number == slow_at) {
		struct platform pf = in_process_platform(b.host);

		rt_guard_disarm(); /* the simulated world, not the cycle */
		pf.sleep_until(pf.ctx, mono_add(pf.now(pf.ctx), (span_t){ 300 * NS_PER_US }));
		rt_guard_arm();
	}
	return ECDAQ_GO_ON;
}

/* Run until the slow cycle and @cycles more; the result of virtual_master_run(). */
static int run_slowly(const char *policy, uint64_t cycles)
{
	static char overrun[64];
	const char *wanted[8] = { NULL };
	size_t n = 0;

	for (; settings[n] != NULL; n++) {
		wanted[n] = settings[n];
	}
	snprintf(overrun, sizeof(overrun), "control.overrun=%s", policy);
	wanted[n] = overrun;
	slow_at = UINT64_MAX;
	open_with(wanted, be_slow_once);
	slow_at = virtual_master_sample(&vm)->cycle + 20;
	return virtual_master_run(&vm, 20 + cycles);
}

static const struct control_status *seen(void)
{
	return &session_page(vm.session)->control;
}

TEST(sim_control, a_call_beyond_its_budget_is_counted_with_an_event)
{
	char text[256] = "";

	CHECK_EQ(run_slowly("count", 100), SESSION_GOES_ON);
	CHECK_EQ(seen()->overruns, 1);
	CHECK(seen()->time.max_ns >= 300 * NS_PER_US && seen()->time.max_ns < 400 * NS_PER_US);
	CHECK_EQ(seen()->state, CONTROL_RUNNING);
	CHECK_EQ(virtual_master_value(&vm, "a.led"), 1);
	CHECK_EQ(events(EVENT_CONTROL_OVERRUN, text, sizeof(text)), 1);
	CHECK(strstr(text, "of 200000 ns") != NULL);
	CHECK_EQ(session_page(vm.session)->cycle.overruns, 0);
	close_all();
}

TEST(sim_control, a_call_beyond_its_budget_can_make_its_outputs_safe)
{
	uint64_t before;

	CHECK_EQ(run_slowly("fail_safe", 100), SESSION_GOES_ON);
	before = calls;
	CHECK_EQ(seen()->state, CONTROL_PARKED);
	CHECK_EQ(virtual_master_value(&vm, "a.led"), 0);
	CHECK((virtual_master_sample(&vm)->flags & SAMPLE_FAIL_SAFE) != 0);
	virtual_master_run(&vm, 100);
	CHECK_EQ(calls, before);
	CHECK_EQ(session_page(vm.session)->bus_state, BUS_OP);
	close_all();
}

TEST(sim_control, a_call_beyond_its_budget_can_end_it_all_in_order)
{
	CHECK_EQ(run_slowly("stop", 100), -ETIMEDOUT);
	CHECK_EQ(vm.failure.code, EXIT_CODE_CONTROL);
	CHECK(strstr(vm.failure.text, "us of 200 us (control.budget) in cycle") != NULL);
	CHECK_EQ(seen()->state, CONTROL_STOPPED);
	CHECK_EQ(virtual_master_sample(&vm)->cycle, slow_at + 4);
	CHECK_EQ(virtual_master_value(&vm, "a.led"), 0);
	CHECK_EQ(virtual_master_stop(&vm), 0);
	CHECK_EQ(fb1111_piccolo_led(segment_device(b.segment, 0)), 0);
	close_all();
}
