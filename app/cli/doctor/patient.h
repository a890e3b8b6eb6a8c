/* SPDX-License-Identifier: MIT */
/*
 * What is examined: a machine, the configuration that it shall serve, and an ecdaqd if one runs. A
 * check is a function of this alone. Context: blocking.
 */
#ifndef CLI_DOCTOR_PATIENT_H
#define CLI_DOCTOR_PATIENT_H

#include <stdint.h>

#include "base/status.h"
#include "cli/doctor/finding.h"
#include "cli/doctor/sight.h"
#include "cli/doctor/thread.h"
#include "config/config.h"

struct patient {
	struct sight sight;
	const struct config *cfg;
	int64_t pid;                    /* of an ecdaqd that runs; 0: none is seen */
	const struct status_page *page; /* its page; NULL: none, or it cannot be read */
	int page_err;                   /* why: 0 there is none, else -errno */
	const char *nic;
	int is_nic_elsewhere; /* in a network namespace of ecdaqd's own */
	int cpu;              /* the cycle's core; -1: not pinned */
	struct thread cycle;  /* the cycle's thread; tid 0: there is none */
};

typedef void check_fn(const struct patient *p, struct finding *f);

/* kernel.c */
check_fn check_kernel;
check_fn check_isolation;
check_fn check_nohz_full;
check_fn check_rcu_nocbs;
check_fn check_rt_throttling;
check_fn check_timer_migration;
/* core.c */
check_fn check_smt;
check_fn check_governor;
check_fn check_idle_states;
/* threads.c */
check_fn check_cycle_thread;
check_fn check_core_users;
check_fn check_page_faults;
check_fn check_memory_lock;
/* irqs.c */
check_fn check_nic_irqs;
check_fn check_irq_threads;
check_fn check_other_irqs;
/* nic.c */
check_fn check_nic;
check_fn check_eee;
check_fn check_coalescing;
check_fn check_nic_users;
/* clocks.c */
check_fn check_clocksource;
check_fn check_ntp;
check_fn check_tai;
/* machine.c */
check_fn check_machine;
check_fn check_watchdog;
check_fn check_disk;
check_fn check_inodes;
check_fn check_swap;
check_fn check_huge_pages;
check_fn check_power;

/** Does the kernel keep other work off @cpu, by its command line or by a cpuset partition? */
int patient_is_isolated(const struct patient *p, int cpu);
/** SKIP in @f, and 0, if no core is set for the cycle. */
int patient_has_core(const struct patient *p, struct finding *f);
/** SKIP in @f, and 0, if no running ecdaqd shows its status page. */
int patient_has_page(const struct patient *p, struct finding *f);
/** SKIP in @f, and 0, if the EtherCAT port is not there, or cannot be seen from here. */
int patient_has_nic(const struct patient *p, struct finding *f);
/** No hardware behind the EtherCAT port: veth, tap. */
int patient_is_nic_virtual(const struct patient *p);

#endif
