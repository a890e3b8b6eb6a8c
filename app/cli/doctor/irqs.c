/* SPDX-License-Identifier: MIT */
/* The EtherCAT port's interrupts belong on the cycle's core and above it; all others elsewhere. */
#include <errno.h>
#include <inttypes.h>
#include <stdlib.h>
#include <string.h>

#include "base/cpu_list.h"
#include "cli/doctor/irq.h"
#include "cli/doctor/patient.h"

struct irqs {
	struct irq all[IRQ_MAX];
	int is_nic[IRQ_MAX];
	int count;
	int nic_count;
};

/* Those of the port: named after it or its device, or message interrupts of the device. */
static int find(const struct patient *p, struct irqs *irqs)
{
	char device[SIGHT_TEXT_BYTES] = "";
	int is_idle = 1;

	irqs->nic_count = 0;
	irqs->count = irq_list(&p->sight, irqs->all);
	if (irqs->count < 0) {
		return irqs->count;
	}
	sight_link(&p->sight, device, "/sys/class/net/%s/device", p->nic);
	for (int i = 0; i < irqs->count; i++) {
		const struct irq *irq = &irqs->all[i];

		irqs->is_nic[i] = irq_is_of(irq, p->nic) || irq_is_of(irq, device) ||
				  sight_exists(&p->sight, "/sys/class/net/%s/device/msi_irqs/%d",
					       p->nic, irq->number);
		irqs->nic_count += irqs->is_nic[i];
		is_idle &= !irqs->is_nic[i] || irq->count == 0;
	}
	/* Some fire on changes of the link only: once frames have come, they do not count. */
	for (int i = 0; i < irqs->count && !is_idle; i++) {
		if (irqs->is_nic[i] && irqs->all[i].count == 0) {
			irqs->is_nic[i] = 0;
			irqs->nic_count--;
		}
	}
	return 0;
}

/* The port's interrupts in @ret; SKIP and NULL without them. Free it. */
static struct irqs *nic_irqs(const struct patient *p, struct finding *f)
{
	struct irqs *irqs;
	int r;

	if (!patient_has_core(p, f) || !patient_has_nic(p, f)) {
		return NULL;
	}
	if (patient_is_nic_virtual(p)) {
		finding_set(f, FINDING_SKIP, "%s is a virtual port", p->nic);
		return NULL;
	}
	irqs = malloc(sizeof(*irqs));
	r = irqs == NULL ? -ENOMEM : find(p, irqs);
	if (r < 0) {
		finding_unread(f, "/proc/interrupts", r);
	} else if (irqs->nic_count == 0) {
		finding_set(f, FINDING_SKIP, "/proc/interrupts names none of %s", p->nic);
	} else {
		return irqs;
	}
	free(irqs);
	return NULL;
}

static void judge_cores(const struct patient *p, const struct irqs *irqs, struct finding *f)
{
	char wanted[16];
	char cores[SIGHT_TEXT_BYTES];
	int number = 0;

	snprintf(wanted, sizeof(wanted), "%d", p->cpu);
	for (int i = 0; i < irqs->count; i++) {
		int r;

		if (!irqs->is_nic[i]) {
			continue;
		}
		number = irqs->all[i].number;
		r = irq_cores(&p->sight, number, cores);
		if (r < 0) {
			finding_unread(f, "/proc/irq", r);
			return;
		}
		if (strcmp(cores, wanted) != 0) {
			finding_set(f, FINDING_WARN,
				    "interrupt %d of %s fires on core %.60s, the cycle runs on %d",
				    number, p->nic, cores, p->cpu);
			finding_mend(f, "echo %d > /proc/irq/%d/smp_affinity_list", p->cpu, number);
			return;
		}
	}
	finding_set(f, FINDING_OK, "%d of %s on core %d", irqs->nic_count, p->nic, p->cpu);
}

void check_nic_irqs(const struct patient *p, struct finding *f)
{
	struct irqs *irqs = nic_irqs(p, f);

	if (irqs != NULL) {
		judge_cores(p, irqs, f);
		free(irqs);
	}
}

struct handlers {
	const struct patient *p;
	const struct irqs *irqs;
	unsigned count;
	struct thread lowest;
};

static int priority_of(const struct thread *thread)
{
	return thread->policy == THREAD_FIFO || thread->policy == THREAD_RR ? thread->priority : 0;
}

/* irq/45-ecat0 handles an interrupt, napi/ecat0-8 takes the frames where that is threaded, too. */
static void look_at_handler(void *ctx, const struct thread *thread)
{
	struct handlers *handlers = ctx;
	char head[32];
	int is_ours = 0;

	for (int i = 0; i < handlers->irqs->count && !is_ours; i++) {
		snprintf(head, sizeof(head), "irq/%d-", handlers->irqs->all[i].number);
		is_ours =
			handlers->irqs->is_nic[i] && strncmp(thread->name, head, strlen(head)) == 0;
	}
	snprintf(head, sizeof(head), "napi/%.15s-", handlers->p->nic);
	is_ours |= strncmp(thread->name, head, strlen(head)) == 0;
	if (!thread->is_kernel || !is_ours) {
		return;
	}
	if (handlers->count == 0 || priority_of(thread) < priority_of(&handlers->lowest)) {
		handlers->lowest = *thread;
	}
	handlers->count++;
}

static int is_spinning(const struct patient *p)
{
	return p->cfg->cycle_poll == CONFIG_POLL_SPIN ||
	       (p->cfg->cycle_poll == CONFIG_POLL_AUTO && patient_is_isolated(p, p->cpu));
}

static void judge_handlers(const struct handlers *handlers, struct finding *f)
{
	const struct patient *p = handlers->p;
	const struct thread *lowest = &handlers->lowest;
	int priority = (int)p->cfg->cycle_priority;
	int starves = is_spinning(p) && cpu_list_has(lowest->cores, p->cpu);
	char policy[32];

	thread_policy(lowest, policy);
	if (priority_of(lowest) > priority) {
		finding_set(f, FINDING_OK, "%s: %s, above the cycle's %d", lowest->name, policy,
			    priority);
		return;
	}
	finding_set(f, starves ? FINDING_FAIL : FINDING_WARN, "%s: %s, not above the cycle's %d%s",
		    lowest->name, policy, priority,
		    starves ? ", which spins on the same core: frames wait for it" : "");
	finding_mend(f, "chrt --fifo --pid %d %" PRId64, priority + 5 > 98 ? 98 : priority + 5,
		     lowest->tid);
}

void check_irq_threads(const struct patient *p, struct finding *f)
{
	struct irqs *irqs = nic_irqs(p, f);
	struct handlers handlers = { .p = p, .irqs = irqs };

	if (irqs == NULL) {
		return;
	}
	if (thread_each(&p->sight, 0, look_at_handler, &handlers) < 0 || handlers.count == 0) {
		finding_set(f, FINDING_SKIP, "%s has no interrupt thread that can be seen", p->nic);
	} else {
		judge_handlers(&handlers, f);
	}
	free(irqs);
}

/* Others that may fire on the cycle's core: how many, and the first. */
static int foreign(const struct patient *p, const struct irqs *irqs, const struct irq **ret_first)
{
	char cores[SIGHT_TEXT_BYTES];
	int count = 0;

	for (int i = 0; i < irqs->count; i++) {
		/* What never fired since boot will not do so now. */
		if (irqs->is_nic[i] || irqs->all[i].count == 0 ||
		    irq_cores(&p->sight, irqs->all[i].number, cores) < 0 ||
		    !cpu_list_has(cores, p->cpu)) {
			continue;
		}
		if (count++ == 0) {
			*ret_first = &irqs->all[i];
		}
	}
	return count;
}

void check_other_irqs(const struct patient *p, struct finding *f)
{
	const struct irq *first = NULL;
	struct irqs *irqs;
	int r;

	if (!patient_has_core(p, f)) {
		return;
	}
	irqs = malloc(sizeof(*irqs));
	r = irqs == NULL ? -ENOMEM : find(p, irqs);
	if (r < 0) {
		finding_unread(f, "/proc/interrupts", r);
		free(irqs);
		return;
	}
	r = foreign(p, irqs, &first);
	if (r == 0) {
		finding_set(f, FINDING_OK, "none on core %d", p->cpu);
	} else {
		finding_set(f, FINDING_WARN, "%d may fire on core %d: %d (%s)%s", r, p->cpu,
			    first->number, first->name, r > 1 ? ", ..." : "");
		finding_mend(f,
			     "kernel command line: irqaffinity= without core %d; or "
			     "/proc/irq/%d/smp_affinity_list",
			     p->cpu, first->number);
	}
	free(irqs);
}
