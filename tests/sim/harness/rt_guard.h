/* SPDX-License-Identifier: MIT */
/*
 * What the cycle must not do, held to at link time: every test program that links ecdaq_rt_guard
 * has its allocation, locks, file and console calls wrapped (-Wl,--wrap). Between rt_guard_arm()
 * and rt_guard_disarm(), on that thread, such a call ends the program and names itself. The
 * simulated segment is no part of the cycle: its doors disarm and arm again.
 */
#ifndef TESTS_SIM_HARNESS_RT_GUARD_H
#define TESTS_SIM_HARNESS_RT_GUARD_H

#include <stdint.h>

void rt_guard_arm(void);
void rt_guard_disarm(void);
/** Is this thread armed? For doors: disarm, remember, arm again. */
int rt_guard_is_armed(void);

/** Instead of ending the program, count (for tests of the guard). NULL: end it again. */
void rt_guard_count_to(uint64_t *counter, const char **ret_last);

#endif
