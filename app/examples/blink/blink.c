/* SPDX-License-Identifier: MIT */
/*
 * Blinks, in one of two ways, at instants that are whole multiples of `every` on the DC time scale:
 *
 *	by=led		the LED of the board, a bit in its outputs, on and off (default)
 *	by=oneshot	a single SYNC0 pulse of a board in one-shot mode: its time is written some
 *			cycles ahead, and the board's clock fires it to the nanosecond
 *
 * control.options: slave=piccolo0 (default), by=led|oneshot, every=CYCLES (default 500),
 * ahead=CYCLES (default 100; by=oneshot only).
 */
#include <ecdaq/control.h>
#include <errno.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

struct blink {
	int is_oneshot;
	int64_t every_ns;
	int64_t ahead_ns;
	int64_t target_ns; /* of the shot that stands; 0: none */
	struct ecdaq_output led;
	struct ecdaq_output time;
};

static int option_cycles(const struct ecdaq_init *in, const char *key, int64_t *ret_ns)
{
	double cycles = (double)*ret_ns / (double)in->period_ns;
	int r = ecdaq_option_number(in, key, &cycles);

	if (r == -EINVAL) {
		return r; /* ecdaqd says why */
	}
	if (!(cycles >= 1 && cycles <= 1000000)) {
		ecdaq_say(in, "every and ahead are 1 to 1000000 cycles");
		return -ERANGE;
	}
	*ret_ns = (int64_t)cycles * in->period_ns;
	return 0;
}

static int blink_init(const struct ecdaq_init *in, void **ret_state)
{
	static struct blink blink;
	char slave[32] = "piccolo0";
	char by[16] = "led";
	char name[64];
	int r;

	blink = (struct blink){ .every_ns = 500 * in->period_ns, .ahead_ns = 100 * in->period_ns };
	*ret_state = &blink;
	ecdaq_option_text(in, "slave", slave, sizeof(slave));
	ecdaq_option_text(in, "by", by, sizeof(by));
	blink.is_oneshot = strcmp(by, "oneshot") == 0;
	if (!blink.is_oneshot && strcmp(by, "led") != 0) {
		ecdaq_say(in, "by is led or oneshot");
		return -EINVAL;
	}
	r = option_cycles(in, "every", &blink.every_ns);
	if (r == 0 && blink.is_oneshot) {
		r = option_cycles(in, "ahead", &blink.ahead_ns);
	}
	if (r < 0) {
		return r;
	}
	if (blink.is_oneshot) {
		snprintf(name, sizeof(name), "%s.oneshot_time", slave);
		return ecdaq_find_output(in, name, &blink.time);
	}
	snprintf(name, sizeof(name), "%s.led", slave);
	return ecdaq_find_output(in, name, &blink.led);
}

/* The multiple of @step that comes next after @t. */
static int64_t next_multiple(int64_t t, int64_t step)
{
	return (t / step + 1) * step;
}

static void shoot(const struct ecdaq_cycle *cy, struct blink *blink, int64_t next_ns)
{
	if ((cy->flags & ECDAQ_FIRST) != 0) {
		blink->target_ns = 0;
	}
	/* Another value would withdraw a shot that has not fired yet. */
	if (next_ns > blink->target_ns + cy->period_ns) {
		blink->target_ns = next_multiple(next_ns + blink->ahead_ns, blink->every_ns);
	}
	/* A physical value is a double, and a time in ns since 2000 needs more digits. */
	ecdaq_set_raw(cy, blink->time, (uint64_t)blink->target_ns);
}

static int blink_cycle(const struct ecdaq_cycle *cy, void *state)
{
	struct blink *blink = state;
	/* What is set now goes out with the frame of the next cycle. */
	int64_t next_ns = cy->dc_time_ns + cy->period_ns;

	if (cy->dc_time_ns == 0) { /* a bus without clocks: count cycles instead */
		next_ns = (int64_t)(cy->number + 1) * cy->period_ns;
	}
	if (blink->is_oneshot) {
		shoot(cy, blink, next_ns);
	} else {
		ecdaq_set(cy, blink->led, next_ns / blink->every_ns % 2 == 0);
	}
	return ECDAQ_GO_ON;
}

const struct ecdaq_program ecdaq_program = {
	ECDAQ_PROGRAM_HEAD,
	.name = "blink",
	.init = blink_init,
	.cycle = blink_cycle,
};
