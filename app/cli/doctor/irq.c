/* SPDX-License-Identifier: MIT */
#include "cli/doctor/irq.h"

#include <ctype.h>
#include <errno.h>
#include <inttypes.h>
#include <stdlib.h>
#include <string.h>

#include "base/cpu_list.h"
#include "cli/doctor/check.h"
#include "cli/doctor/thread.h"

int irq_parse(const char *line, struct irq *ret)
{
	struct irq irq = { .count = 0 };
	char *end;
	long number = strtol(line, &end, 10);
	size_t len;

	if (end == line || *end != ':' || number < 0 || number > INT32_MAX) {
		return -EBADMSG;
	}
	irq.number = (int)number;
	for (line = end + 1;; line = end) {
		unsigned long long count;

		line += strspn(line, " ");
		count = strtoull(line, &end, 10);
		/* A controller's name may begin with a digit: a count ends with a blank. */
		if (end == line || (*end != ' ' && *end != '\n')) {
			break;
		}
		irq.count += count;
	}
	len = strcspn(line, "\n");
	/* The name of the user is at the end. */
	if (len >= sizeof(irq.name)) {
		line += len - (sizeof(irq.name) - 1);
		len = sizeof(irq.name) - 1;
	}
	memcpy(irq.name, line, len);
	*ret = irq;
	return 0;
}

int irq_is_of(const struct irq *irq, const char *user)
{
	size_t len = strlen(user);
	const char *at = irq->name;

	while (len > 0 && (at = strstr(at, user)) != NULL) {
		char before = at == irq->name ? ' ' : at[-1];
		char behind = at[len];

		if ((before == ' ' || before == ',') && !isalnum((unsigned char)behind)) {
			return 1;
		}
		at++;
	}
	return 0;
}

int irq_list(const struct probe *p, struct irq irqs[IRQ_MAX])
{
	FILE *file = probe_open(p, "/proc/interrupts");
	char *line = NULL;
	size_t bytes = 0;
	int count = 0;

	if (file == NULL) {
		return -errno;
	}
	while (count < IRQ_MAX && getline(&line, &bytes, file) > 0) {
		if (irq_parse(line, &irqs[count]) == 0) {
			count++;
		}
	}
	free(line);
	fclose(file);
	return count;
}

int irq_cores(const struct probe *p, int number, char ret_list[PROBE_TEXT_BYTES])
{
	int r = probe_text(p, ret_list, "/proc/irq/%d/effective_affinity_list", number);

	/* Empty for a per-core interrupt (timer) and for one that is not in use. */
	if (r == 0) {
		ret_list[0] = '\0';
	} else if (r < 0) {
		/* Without it the kernel does not report where an interrupt really fires. */
		r = probe_text(p, ret_list, "/proc/irq/%d/smp_affinity_list", number);
	}
	return r < 0 ? r : 0;
}

/* --- checks --- */

struct irqs {
	struct irq all[IRQ_MAX];
	int is_nic[IRQ_MAX];
	int count;
	int nic_count;
};

/* Those of the port: named after it or its device, or message interrupts of the device. */
static int find(const struct target *t, struct irqs *irqs)
{
	char device[PROBE_TEXT_BYTES] = "";
	int is_idle = 1;

	irqs->nic_count = 0;
	irqs->count = irq_list(&t->probe, irqs->all);
	if (irqs->count < 0) {
		return irqs->count;
	}
	probe_link(&t->probe, device, "/sys/class/net/%s/device", t->nic);
	for (int i = 0; i < irqs->count; i++) {
		const struct irq *irq = &irqs->all[i];

		irqs->is_nic[i] = irq_is_of(irq, t->nic) || irq_is_of(irq, device) ||
				  probe_exists(&t->probe, "/sys/class/net/%s/device/msi_irqs/%d",
					       t->nic, irq->number);
		irqs->nic_count += irqs->is_nic[i];
		is_idle &= !irqs->is_nic[i] || irq->count == 0;
	}
	/* Some fire on link changes only: if others have fired, they do not count. */
	for (int i = 0; i < irqs->count && !is_idle; i++) {
		if (irqs->is_nic[i] && irqs->all[i].count == 0) {
			irqs->is_nic[i] = 0;
			irqs->nic_count--;
		}
	}
	return 0;
}

/* The port's interrupts in @ret; SKIP and NULL without them. Free it. */
static struct irqs *nic_irqs(const struct target *t, struct finding *f)
{
	struct irqs *irqs;
	int r;

	if (target_is_nic_virtual(t)) {
		finding_set(f, FINDING_SKIP, "%s is a virtual port", t->nic);
		return NULL;
	}
	irqs = calloc(1, sizeof(*irqs));
	r = irqs == NULL ? -ENOMEM : find(t, irqs);
	if (r < 0) {
		finding_unread(f, "/proc/interrupts", r);
	} else if (irqs->nic_count == 0) {
		finding_set(f, FINDING_SKIP, "/proc/interrupts has no interrupt of %s", t->nic);
	} else {
		return irqs;
	}
	free(irqs);
	return NULL;
}

static void judge_cores(const struct target *t, const struct irqs *irqs, struct finding *f)
{
	char wanted[16];
	char cores[PROBE_TEXT_BYTES];
	int number = 0;

	snprintf(wanted, sizeof(wanted), "%d", t->cpu);
	for (int i = 0; i < irqs->count; i++) {
		int r;

		if (!irqs->is_nic[i]) {
			continue;
		}
		number = irqs->all[i].number;
		r = irq_cores(&t->probe, number, cores);
		if (r < 0) {
			finding_unread(f, "/proc/irq", r);
			return;
		}
		if (strcmp(cores, wanted) != 0) {
			finding_set(f, FINDING_WARN,
				    "interrupt %d of %s fires on core %.60s, the cycle runs on "
				    "%d" REMEDY "echo %d > /proc/irq/%d/smp_affinity_list",
				    number, t->nic, cores, t->cpu, t->cpu, number);
			return;
		}
	}
	finding_set(f, FINDING_OK, "%d of %s on core %d", irqs->nic_count, t->nic, t->cpu);
}

static void judge_nic_irqs(const struct target *t, struct finding *f)
{
	struct irqs *irqs = nic_irqs(t, f);

	if (irqs != NULL) {
		judge_cores(t, irqs, f);
		free(irqs);
	}
}

struct handlers {
	const struct target *t;
	const struct irqs *irqs;
	unsigned count;
	struct thread lowest;
};

static int priority_of(const struct thread *thread)
{
	return thread->policy == THREAD_FIFO || thread->policy == THREAD_RR ? thread->priority : 0;
}

/* irq/45-ecat0 handles an interrupt, napi/ecat0-8 takes the frames where that is threaded, too. */
static void add_handler(void *ctx, const struct thread *thread)
{
	struct handlers *handlers = ctx;
	char head[32];
	int is_ours = 0;

	for (int i = 0; i < handlers->irqs->count && !is_ours; i++) {
		snprintf(head, sizeof(head), "irq/%d-", handlers->irqs->all[i].number);
		is_ours =
			handlers->irqs->is_nic[i] && strncmp(thread->name, head, strlen(head)) == 0;
	}
	snprintf(head, sizeof(head), "napi/%.15s-", handlers->t->nic);
	is_ours |= strncmp(thread->name, head, strlen(head)) == 0;
	if (!thread->is_kernel || !is_ours) {
		return;
	}
	if (handlers->count == 0 || priority_of(thread) < priority_of(&handlers->lowest)) {
		handlers->lowest = *thread;
	}
	handlers->count++;
}

static int is_spinning(const struct target *t)
{
	return t->cfg->cycle_poll == CONFIG_POLL_SPIN ||
	       (t->cfg->cycle_poll == CONFIG_POLL_AUTO && target_is_isolated(t, t->cpu));
}

static void judge_handlers(const struct handlers *handlers, struct finding *f)
{
	const struct target *t = handlers->t;
	const struct thread *lowest = &handlers->lowest;
	int priority = (int)t->cfg->cycle_priority;
	int starves = is_spinning(t) && cpu_list_has(lowest->cores, t->cpu);
	char policy[32];

	thread_policy(lowest, policy);
	if (priority_of(lowest) > priority) {
		finding_set(f, FINDING_OK, "%s: %s, above the cycle's %d", lowest->name, policy,
			    priority);
		return;
	}
	finding_set(f, starves ? FINDING_FAIL : FINDING_WARN,
		    "%s: %s, not above the cycle's %d%s" REMEDY "chrt --fifo --pid %d %" PRId64,
		    lowest->name, policy, priority,
		    starves ? ", and the cycle polls on the same core: frames are delayed" : "",
		    priority + 5 > 98 ? 98 : priority + 5, lowest->tid);
}

static void judge_irq_threads(const struct target *t, struct finding *f)
{
	struct irqs *irqs = nic_irqs(t, f);
	struct handlers handlers = { .t = t, .irqs = irqs };

	if (irqs == NULL) {
		return;
	}
	if (thread_each(&t->probe, 0, add_handler, &handlers) < 0 || handlers.count == 0) {
		finding_set(f, FINDING_SKIP, "no interrupt thread of %s found", t->nic);
	} else {
		judge_handlers(&handlers, f);
	}
	free(irqs);
}

/* Others that may fire on the cycle's core: how many, and the first. */
static int foreign(const struct target *t, const struct irqs *irqs, const struct irq **ret_first)
{
	char cores[PROBE_TEXT_BYTES];
	int count = 0;

	for (int i = 0; i < irqs->count; i++) {
		/* One that never fired since boot is not in use. */
		if (irqs->is_nic[i] || irqs->all[i].count == 0 ||
		    irq_cores(&t->probe, irqs->all[i].number, cores) < 0 ||
		    !cpu_list_has(cores, t->cpu)) {
			continue;
		}
		if (count++ == 0) {
			*ret_first = &irqs->all[i];
		}
	}
	return count;
}

static void judge_other_irqs(const struct target *t, struct finding *f)
{
	const struct irq *first = NULL;
	struct irqs *irqs;
	int r;

	irqs = calloc(1, sizeof(*irqs));
	r = irqs == NULL ? -ENOMEM : find(t, irqs);
	if (r < 0) {
		finding_unread(f, "/proc/interrupts", r);
		free(irqs);
		return;
	}
	r = foreign(t, irqs, &first);
	if (r == 0) {
		finding_set(f, FINDING_OK, "none on core %d", t->cpu);
	} else {
		finding_set(f, FINDING_WARN,
			    "%d may fire on core %d: %d (%s)%s" REMEDY
			    "kernel command line: irqaffinity= without core %d; or "
			    "/proc/irq/%d/smp_affinity_list",
			    r, t->cpu, first->number, first->name, r > 1 ? ", ..." : "", t->cpu,
			    first->number);
	}
	free(irqs);
}

const struct check checks_of_irqs[] = {
	{ .name = "nic_irqs", .needs = NEEDS_CORE | NEEDS_NIC, .judge = judge_nic_irqs },
	{ .name = "irq_threads", .needs = NEEDS_CORE | NEEDS_NIC, .judge = judge_irq_threads },
	{ .name = "other_irqs", .needs = NEEDS_CORE, .judge = judge_other_irqs },
	{ .name = NULL },
};
