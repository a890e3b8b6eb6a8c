/* SPDX-License-Identifier: MIT */
/* ecdaqd as it runs: the cycle's thread, who else may run on its core, its memory. */
#include <ctype.h>
#include <errno.h>
#include <inttypes.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/cpu_list.h"
#include "base/event.h"
#include "cli/doctor/patient.h"

#define MEND_LOCK "LimitMEMLOCK=infinity in ecdaqd's unit, or CAP_IPC_LOCK"
#define GET(field) atomic_load_explicit(&(field), memory_order_relaxed)

enum { NAMES_SHOWN = 3 };

int patient_has_page(const struct patient *p, struct finding *f)
{
	if (p->page != NULL) {
		return 1;
	}
	if (p->page_err < 0) {
		finding_unread(f, "ecdaqd's status page", p->page_err);
	} else {
		finding_set(f, FINDING_SKIP, "ecdaqd is not running");
		finding_mend(f, "start ecdaqd and look again");
	}
	return 0;
}

/* Does it run on the cycle's core and nowhere else? */
static int is_pinned(const struct patient *p)
{
	char wanted[16];

	snprintf(wanted, sizeof(wanted), "%d", p->cpu);
	return strcmp(p->cycle.cores, wanted) == 0;
}

void check_cycle_thread(const struct patient *p, struct finding *f)
{
	char policy[32];

	if (p->cycle.tid == 0) {
		if (patient_has_page(p, f)) {
			finding_set(f, FINDING_SKIP, "ecdaqd has no cycle now (%s)",
				    bus_state_to_str(GET(p->page->bus_state)));
		}
		return;
	}
	thread_policy(&p->cycle, policy);
	if (p->cycle.policy != THREAD_FIFO) {
		finding_set(f, FINDING_FAIL, "%s: anything may hold the cycle up", policy);
		finding_mend(f, p->cfg->cycle_priority == 0
					? "set cycle.priority"
					: "LimitRTPRIO=98 in ecdaqd's unit, or CAP_SYS_NICE");
	} else if (p->cfg->cycle_priority != 0 &&
		   p->cycle.priority != (int)p->cfg->cycle_priority) {
		finding_set(f, FINDING_WARN, "%s, but cycle.priority is %u", policy,
			    p->cfg->cycle_priority);
		finding_mend(f, "restart ecdaqd with this configuration");
	} else if (p->cpu >= 0 && !is_pinned(p)) {
		finding_set(f, FINDING_FAIL, "%s, but may run on %.60s instead of core %d alone",
			    policy, p->cycle.cores, p->cpu);
		finding_mend(f, "let ecdaqd's cpuset have core %d (AllowedCPUs=)", p->cpu);
	} else {
		finding_set(f, FINDING_OK, "%s on core %.60s", policy, p->cycle.cores);
	}
}

struct users {
	const struct patient *p;
	unsigned count;
	unsigned shown;
	char names[FINDING_TEXT_BYTES / 2];
	struct thread rival; /* not below the cycle in priority */
};

static void look_at_user(void *ctx, const struct thread *thread)
{
	struct users *users = ctx;
	const struct patient *p = users->p;
	size_t used = strlen(users->names);
	int is_realtime = thread->policy == THREAD_FIFO || thread->policy == THREAD_RR;

	/* The kernel's threads of a core belong to it; this program is gone in a moment. */
	if (thread->is_kernel || thread->tid == p->cycle.tid ||
	    (p->sight.root[0] == '\0' && thread->pid == getpid()) ||
	    !cpu_list_has(thread->cores, p->cpu)) {
		return;
	}
	users->count++;
	if (is_realtime && thread->priority >= (int)p->cfg->cycle_priority) {
		users->rival = *thread;
	}
	if (users->shown < NAMES_SHOWN && strstr(users->names, thread->name) == NULL) {
		snprintf(users->names + used, sizeof(users->names) - used, "%s%s",
			 used > 0 ? ", " : "", thread->name);
		users->shown++;
	}
}

void check_core_users(const struct patient *p, struct finding *f)
{
	struct users users = { .p = p };
	struct thread init;
	char policy[32];
	int r;

	if (!patient_has_core(p, f)) {
		return;
	}
	/* With hidepid= the processes of others are not seen at all. */
	r = thread_read(&p->sight, 1, 1, &init);
	if (r == 0) {
		r = thread_each(&p->sight, 0, look_at_user, &users);
	}
	if (r < 0) {
		finding_unread(f, "/proc/1", r == -ENOENT ? -EACCES : r);
	} else if (users.rival.tid != 0) {
		finding_set(f, FINDING_FAIL, "%s (%s) may run on core %d before the cycle",
			    users.rival.name, thread_policy(&users.rival, policy), p->cpu);
		finding_mend(f, "give it another core (CPUAffinity=) or less priority");
	} else if (users.count > 0) {
		finding_set(f, FINDING_WARN, "%u other thread%s may run on core %d: %s%s",
			    users.count, users.count == 1 ? "" : "s", p->cpu, users.names,
			    users.count > users.shown ? ", ..." : "");
		finding_mend(f, patient_is_isolated(p, p->cpu)
					? "give them other cores (CPUAffinity=, taskset)"
					: "isolate the core (isolcpus=)");
	} else {
		finding_set(f, FINDING_OK, "nothing else may run on core %d", p->cpu);
	}
}

void check_page_faults(const struct patient *p, struct finding *f)
{
	uint64_t faults;

	if (!patient_has_page(p, f)) {
		return;
	}
	faults = GET(p->page->cycle.page_faults);
	finding_set(f, faults == 0 ? FINDING_OK : FINDING_FAIL,
		    "%" PRIu64 " in %" PRIu64 " cycles of ecdaqd", faults,
		    GET(p->page->cycle.cycles));
	if (faults > 0) {
		finding_mend(f,
			     "cycle.lock_memory: on, and LimitMEMLOCK=infinity in ecdaqd's unit");
	}
}

/* The number behind @key in a file of /proc, -1 for "unlimited". */
static int number_behind(FILE *file, const char *key, int64_t *ret)
{
	char line[SIGHT_TEXT_BYTES];
	size_t key_len = strlen(key);

	while (fgets(line, sizeof(line), file) != NULL) {
		const char *value = line + key_len;

		if (strncmp(line, key, key_len) != 0) {
			continue;
		}
		value += strspn(value, " \t");
		if (!isdigit((unsigned char)value[0]) && strncmp(value, "unlimited", 9) != 0) {
			return -EBADMSG;
		}
		*ret = isdigit((unsigned char)value[0]) ? strtoll(value, NULL, 10) : -1;
		return 0;
	}
	return -EBADMSG;
}

static int read_behind(FILE *file, const char *key, int64_t *ret)
{
	int r;

	if (file == NULL) {
		return -errno;
	}
	r = number_behind(file, key, ret);
	fclose(file);
	return r;
}

static void judge_locked(const struct patient *p, struct finding *f)
{
	FILE *file = sight_open(&p->sight, "/proc/%" PRId64 "/status", p->pid);
	int64_t locked_kib = 0;
	int r = read_behind(file, "VmLck:", &locked_kib);

	if (r < 0) {
		finding_unread(f, "/proc/PID/status of ecdaqd", r);
	} else if (locked_kib > 0) {
		finding_set(f, FINDING_OK, "%" PRId64 " KiB of ecdaqd are locked", locked_kib);
	} else {
		finding_set(f, FINDING_FAIL, "ecdaqd has a cycle, but has locked nothing");
		finding_mend(f, MEND_LOCK);
	}
}

static void judge_limit(const struct patient *p, struct finding *f)
{
	FILE *file = sight_open(&p->sight, "/proc/self/limits");
	int64_t limit_bytes = 0;
	int r = read_behind(file, "Max locked memory", &limit_bytes);

	if (r < 0) {
		finding_unread(f, "/proc/self/limits", r);
	} else if (limit_bytes < 0) {
		finding_set(f, FINDING_OK, "unlimited here; ecdaqd is not running");
	} else {
		finding_set(f, FINDING_WARN,
			    "%" PRId64 " KiB may be locked here; ecdaqd is not running",
			    limit_bytes / 1024);
		finding_mend(f, "LimitMEMLOCK=infinity in ecdaqd's unit, or ulimit -l unlimited");
	}
}

void check_memory_lock(const struct patient *p, struct finding *f)
{
	if (!p->cfg->cycle_lock_memory) {
		finding_set(f, FINDING_WARN, "cycle.lock_memory is off: memory may be paged out");
		finding_mend(f, "cycle.lock_memory: on");
	} else if (p->page != NULL && (GET(p->page->rt_degraded) >> EVENT_RT_MEMORY & 1) != 0) {
		finding_set(f, FINDING_FAIL, "ecdaqd was refused to lock its memory");
		finding_mend(f, MEND_LOCK);
	} else if (p->pid == 0 && p->page_err == 0) {
		judge_limit(p, f);
	} else if (p->cycle.tid != 0) {
		judge_locked(p, f);
	} else if (patient_has_page(p, f)) {
		finding_set(f, FINDING_SKIP, "ecdaqd locks its memory with its first cycle");
	}
}
