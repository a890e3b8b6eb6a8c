/* SPDX-License-Identifier: MIT */
/*
 * Inputs to outputs, on a WAGO 750-354 with, in this order, 750-457
 * (4 AI), 750-557 (4 AO), 750-430 (8 DI) and 750-530 (8 DO): analog input 1 goes to analog output
 * 1, digital input 1 drives digital outputs 4 to 8. What the inputs of one cycle say travels with
 * the next frame.
 *
 * control.options: slave=wago0 (default). All of outputs 1 of slot 2 and 4 to 8 of slot 4 must have
 * the owner `program`.
 */
#include <ecdaq/control.h>
#include <stdint.h>
#include <stdio.h>

enum { FIRST_LAMP = 4, LAMPS = 5 };

struct loopback {
	struct ecdaq_input analog_in;
	struct ecdaq_input digital_in;
	struct ecdaq_output analog_out;
	struct ecdaq_output lamp[LAMPS];
};

static int find_outputs(const struct ecdaq_init *in, const char *slave, struct loopback *lb)
{
	char name[64];
	int r;

	snprintf(name, sizeof(name), "%s.slot2_channel_1_data", slave);
	r = ecdaq_find_output(in, name, &lb->analog_out);
	for (int i = 0; r == 0 && i < LAMPS; i++) {
		snprintf(name, sizeof(name), "%s.slot4_channel_%d_data", slave, FIRST_LAMP + i);
		r = ecdaq_find_output(in, name, &lb->lamp[i]);
	}
	return r;
}

static int loopback_init(const struct ecdaq_init *in, void **ret_state)
{
	static struct loopback lb;
	char slave[32] = "wago0";
	char name[64];
	int r;

	*ret_state = &lb;
	ecdaq_option_text(in, "slave", slave, sizeof(slave));
	snprintf(name, sizeof(name), "%s.slot1_channel_1_data", slave);
	r = ecdaq_find_input(in, name, &lb.analog_in);
	if (r == 0) {
		snprintf(name, sizeof(name), "%s.slot3_channel_1_data", slave);
		r = ecdaq_find_input(in, name, &lb.digital_in);
	}
	return r == 0 ? find_outputs(in, slave, &lb) : r;
}

static int loopback_cycle(const struct ecdaq_cycle *cy, void *state)
{
	struct loopback *lb = state;
	uint64_t is_on;

	/* The coupler has not answered for its inputs, or not taken its outputs. */
	if ((cy->flags & ECDAQ_WKC_LOW) != 0) {
		return ECDAQ_MAKE_SAFE;
	}
	/* A frame that was lost says nothing: the outputs stay as they are. */
	if (!ecdaq_is_good(cy, lb->analog_in)) {
		return ECDAQ_GO_ON;
	}
	ecdaq_set_raw(cy, lb->analog_out, ecdaq_get_raw(cy, lb->analog_in));
	is_on = ecdaq_get_raw(cy, lb->digital_in);
	for (int i = 0; i < LAMPS; i++) {
		ecdaq_set_raw(cy, lb->lamp[i], is_on);
	}
	return ECDAQ_GO_ON;
}

const struct ecdaq_program ecdaq_program = {
	ECDAQ_PROGRAM_HEAD,
	.name = "loopback",
	.init = loopback_init,
	.cycle = loopback_cycle,
};
