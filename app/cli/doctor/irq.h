/* SPDX-License-Identifier: MIT */
/* The interrupts of a machine, from /proc/interrupts and /proc/irq. Context: blocking. */
#ifndef CLI_DOCTOR_IRQ_H
#define CLI_DOCTOR_IRQ_H

#include <stdint.h>

#include "cli/probe.h"

enum { IRQ_MAX = 512 };

struct irq {
	int number;
	uint64_t count; /* over all cores, since boot */
	char name[64];  /* controller and user, as /proc/interrupts has it */
};

/** One line of /proc/interrupts. 0, or -EBADMSG for headings and the kernel's own (NMI, LOC). */
int irq_parse(const char *line, struct irq *ret);

/** Does the name hold @user as a word: "eth0", "eth0-rx-1", "mmc0, eth0"? */
int irq_is_of(const struct irq *irq, const char *user);

/** All of them, IRQ_MAX at most; the number or -errno. */
int irq_list(const struct probe *p, struct irq irqs[IRQ_MAX]);

/** The cores where it fires, "0-2". 0 or -errno. */
int irq_cores(const struct probe *p, int number, char ret_list[PROBE_TEXT_BYTES]);

#endif
