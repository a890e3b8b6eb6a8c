/* SPDX-License-Identifier: MIT */
/*
 * Lights the LED of slave `a`, and after so many cycles is in trouble: how=crash, how=loop (it
 * never comes back), how=none. control.options: how, after.
 */
#include <ecdaq/control.h>
#include <errno.h>
#include <string.h>

static struct ecdaq_output led;
static char how[16] = "none";
static double after = 500;
static double calls;

static int trouble_init(const struct ecdaq_init *in, void **ret_state)
{
	(void)ret_state;
	calls = 0;
	if (ecdaq_option_text(in, "how", how, sizeof(how)) == -ENAMETOOLONG ||
	    ecdaq_option_number(in, "after", &after) == -EINVAL) {
		return -EINVAL;
	}
	return ecdaq_find_output(in, "a.led", &led);
}

__attribute__((noinline, no_sanitize("address"), no_sanitize("undefined"))) static void
write_to(uintptr_t address)
{
	*(volatile uint8_t *)address = 1;
}

static int trouble_cycle(const struct ecdaq_cycle *cy, void *state)
{
	static volatile int forever = 1;
	static volatile uintptr_t nothing = 16;

	(void)state;
	ecdaq_set(cy, led, 1);
	calls += 1;
	if (calls < after) {
		return ECDAQ_GO_ON;
	}
	if (strcmp(how, "crash") == 0) {
		write_to(nothing);
	}
	while (strcmp(how, "loop") == 0 && forever) {
	}
	return ECDAQ_GO_ON;
}

const struct ecdaq_program ecdaq_program = {
	ECDAQ_PROGRAM_HEAD,
	.name = "trouble",
	.init = trouble_init,
	.cycle = trouble_cycle,
};
