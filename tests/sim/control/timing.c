/* SPDX-License-Identifier: MIT */
/* Which cycle a program's inputs are of, and which frame carries what it made of them. */
#include "harness/control_probe/probe.h"
#include "harness/test.h"
#include "sim/harness/virtual_master.h"

enum { RUN_CYCLES = 2000 };

static const char *const settings[] = {
	"slaves[0].name=a",
	"slaves[0].mode=oneshot",
	"bus.presence=any",
	"control.program=" PROBE_PATH,
	"outputs[0].channel=a.led",
	"outputs[0].owner=program",
	"outputs[1].channel=a.oneshot_time",
	"outputs[1].owner=program",
	NULL,
};

static struct virtual_bench b;
static struct virtual_master vm;
static struct ecdaq_input counter;
static struct ecdaq_input adc;
static struct ecdaq_output led;
static struct ecdaq_output number; /* 64 bits that a board in one-shot mode takes for the past */

static int find(const struct ecdaq_init *in, void **ret_state)
{
	(void)ret_state;
	return ecdaq_find_input(in, "piccolo1.counter", &counter) < 0 ||
			       ecdaq_find_input(in, "piccolo1.adc", &adc) < 0 ||
			       ecdaq_find_output(in, "a.led", &led) < 0 ||
			       ecdaq_find_output(in, "a.oneshot_time", &number) < 0
		       ? -1
		       : 0;
}

/* Something that only this cycle's inputs can give. */
static uint64_t made_of(uint64_t cycle, uint64_t counter_value, uint64_t adc_value)
{
	return (cycle & 0xffff) << 32 | counter_value << 16 | adc_value;
}

static int follow(const struct ecdaq_cycle *cy, void *state)
{
	uint64_t value = made_of(cy->number, ecdaq_get_raw(cy, counter), ecdaq_get_raw(cy, adc));

	(void)state;
	ecdaq_set_raw(cy, number, value);
	ecdaq_set(cy, led, (double)(value >> 16 & 1));
	return ECDAQ_GO_ON;
}

static uint64_t last_made;
static uint64_t last_cycle;
static unsigned checked;
static unsigned wrong;

static void check_frame(struct virtual_master *master)
{
	const struct sample_header *h;

	virtual_master_run(master, 0);
	h = virtual_master_sample(master);
	if (checked > 0 && h->cycle == last_cycle + 1) {
		wrong += virtual_master_value(master, "a.oneshot_time") != last_made;
		wrong += virtual_master_value(master, "a.led") != (last_made >> 16 & 1);
	}
	last_made = made_of(h->cycle, virtual_master_value(master, "piccolo1.counter"),
			    virtual_master_value(master, "piccolo1.adc"));
	last_cycle = h->cycle;
	checked++;
}

TEST(sim_control, outputs_computed_from_cycle_k_are_sent_in_cycle_k_plus_1)
{
	struct probe *probe = probe_use();
	uint64_t calls;

	probe->init = find;
	probe->cycle = follow;
	checked = wrong = 0;
	virtual_bench_init(&b, &(struct virtual_spec){ .ppm = { 100, -100 }, .seed = 9 });
	virtual_master_init(&vm, &b, settings);
	if (virtual_master_bring_up(&vm) < 0) {
		test_fail(__FILE__, __LINE__, "%s", vm.failure.text);
	}
	virtual_master_run(&vm, 10);
	virtual_master_forget(&vm);
	calls = session_page(vm.session)->control.calls;
	vm.each_cycle = check_frame;
	virtual_master_run(&vm, RUN_CYCLES);
	vm.each_cycle = NULL;
	CHECK_EQ(checked, RUN_CYCLES);
	CHECK_EQ(wrong, 0);
	CHECK_EQ(vm.result.gaps, 0);
	CHECK_EQ(vm.result.bad_unexplained, 0);
	CHECK_EQ(session_page(vm.session)->control.calls - calls, RUN_CYCLES);
	virtual_master_close(&vm);
}
