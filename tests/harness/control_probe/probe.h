/* SPDX-License-Identifier: MIT */
/* A control program configured by the test that loads it. */
#ifndef TESTS_HARNESS_CONTROL_PROBE_PROBE_H
#define TESTS_HARNESS_CONTROL_PROBE_PROBE_H

#include <ecdaq/control.h>

/* Each may be NULL: then it does nothing and is content. */
struct probe {
	int (*init)(const struct ecdaq_init *in, void **ret_state);
	int (*cycle)(const struct ecdaq_cycle *cy, void *state);
	void (*exit)(void *state);
};

#define PROBE_PATH ECDAQ_TEST_PROGRAMS "/probe.so"

/** The probe's functions, to be set before it is loaded as a program. Ends the test if it is not
 * there. */
struct probe *probe_use(void);

#endif
