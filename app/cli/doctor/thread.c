/* SPDX-License-Identifier: MIT */
#include "cli/doctor/thread.h"

#include <ctype.h>
#include <errno.h>
#include <inttypes.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/cpu_list.h"
#include "base/event.h"
#include "cli/doctor/check.h"

#define FLAG_KTHREAD 0x00200000 /* PF_KTHREAD of the kernel's sched.h */

enum { STAT_BYTES = 1024 };

/* Numbers of the fields as proc(5) counts them. */
enum { FIELD_STATE = 3, FIELD_FLAGS = 9, FIELD_PRIORITY = 40, FIELD_POLICY = 41 };

int thread_parse_stat(const char *line, struct thread *ret)
{
	struct thread thread = { .pid = 0 };
	const char *open = strchr(line, '(');
	const char *close = strrchr(line, ')'); /* a name may contain brackets */
	size_t len;
	char *end;

	thread.tid = strtoll(line, &end, 10);
	if (end == line || thread.tid <= 0 || open == NULL || close == NULL || close < open) {
		return -EBADMSG;
	}
	len = (size_t)(close - open - 1);
	if (len >= sizeof(thread.name)) {
		len = sizeof(thread.name) - 1;
	}
	memcpy(thread.name, open + 1, len);
	for (int field = FIELD_STATE; field <= FIELD_POLICY; field++) {
		long long value;

		close = strchr(close, ' ');
		if (close == NULL) {
			return -EBADMSG;
		}
		close++;
		value = strtoll(close, NULL, 10);
		if (field == FIELD_FLAGS) {
			thread.is_kernel = (value & FLAG_KTHREAD) != 0;
		} else if (field == FIELD_PRIORITY) {
			thread.priority = (int)value;
		} else if (field == FIELD_POLICY) {
			thread.policy = (int)value;
		}
	}
	*ret = thread;
	return 0;
}

static int read_cores(const struct probe *p, struct thread *thread)
{
	static const char key[] = "Cpus_allowed_list:";
	FILE *file = probe_open(p, "/proc/%" PRId64 "/task/%" PRId64 "/status", thread->pid,
				thread->tid);
	char line[PROBE_TEXT_BYTES];
	int r = -EBADMSG;

	if (file == NULL) {
		return -errno;
	}
	while (r != 0 && fgets(line, sizeof(line), file) != NULL) {
		if (strncmp(line, key, sizeof(key) - 1) == 0) {
			const char *value = line + sizeof(key) - 1;

			value += strspn(value, " \t");
			snprintf(thread->cores, sizeof(thread->cores), "%.*s",
				 (int)strcspn(value, "\n"), value);
			r = 0;
		}
	}
	fclose(file);
	return r;
}

int thread_read(const struct probe *p, int64_t pid, int64_t tid, struct thread *ret)
{
	FILE *file = probe_open(p, "/proc/%" PRId64 "/task/%" PRId64 "/stat", pid, tid);
	char line[STAT_BYTES];
	struct thread thread;
	int r;

	if (file == NULL) {
		return -errno;
	}
	r = fgets(line, sizeof(line), file) == NULL ? -ENOENT : thread_parse_stat(line, &thread);
	fclose(file);
	if (r == 0) {
		thread.pid = pid;
		r = read_cores(p, &thread);
	}
	if (r == 0) {
		*ret = thread;
	}
	return r;
}

struct walk {
	const struct probe *probe;
	int64_t pid;
	void (*each)(void *ctx, const struct thread *thread);
	void *ctx;
};

static void walk_thread(void *ctx, const char *name)
{
	const struct walk *walk = ctx;
	struct thread thread;

	/* Ignore one that has ended meanwhile. */
	if (isdigit((unsigned char)name[0]) &&
	    thread_read(walk->probe, walk->pid, strtoll(name, NULL, 10), &thread) == 0) {
		walk->each(walk->ctx, &thread);
	}
}

static int walk_process(struct walk *walk, int64_t pid)
{
	char dir[64];

	snprintf(dir, sizeof(dir), "/proc/%" PRId64 "/task", pid);
	walk->pid = pid;
	return probe_each(walk->probe, dir, walk_thread, walk);
}

static void walk_entry(void *ctx, const char *name)
{
	if (isdigit((unsigned char)name[0])) {
		walk_process(ctx, strtoll(name, NULL, 10));
	}
}

int thread_each(const struct probe *p, int64_t pid,
		void (*each)(void *ctx, const struct thread *thread), void *ctx)
{
	struct walk walk = { .probe = p, .each = each, .ctx = ctx };

	return pid != 0 ? walk_process(&walk, pid) : probe_each(p, "/proc", walk_entry, &walk);
}

const char *thread_policy(const struct thread *thread, char buf[32])
{
	static const char *const names[] = { "SCHED_OTHER",   "SCHED_FIFO", "SCHED_RR",
					     "SCHED_BATCH",   "",           "SCHED_IDLE",
					     "SCHED_DEADLINE" };
	size_t policy = (size_t)thread->policy;

	if (policy == THREAD_FIFO || policy == THREAD_RR) {
		snprintf(buf, 32, "%s %d", names[policy], thread->priority);
	} else if (policy < sizeof(names) / sizeof(names[0])) {
		snprintf(buf, 32, "%s", names[policy]);
	} else {
		snprintf(buf, 32, "policy %d", thread->policy);
	}
	return buf;
}

/* --- checks --- */

#define HUGE_PAGES "/sys/kernel/mm/transparent_hugepage/enabled"
#define LOCK_REMEDY "LimitMEMLOCK=infinity in ecdaqd's unit, or CAP_IPC_LOCK"
#define GET(field) atomic_load_explicit(&(field), memory_order_relaxed)

enum { NAMES_SHOWN = 3 };

/* Does it run on the cycle's core and nowhere else? */
static int is_pinned(const struct target *t)
{
	char wanted[16];

	snprintf(wanted, sizeof(wanted), "%d", t->cpu);
	return strcmp(t->cycle.cores, wanted) == 0;
}

static void judge_cycle_thread(const struct target *t, struct finding *f)
{
	char policy[32];

	if (t->cycle.tid == 0) {
		if (target_has(t, NEEDS_PAGE, f)) {
			finding_set(f, FINDING_SKIP, "ecdaqd runs no cycle now (%s)",
				    bus_state_to_str(GET(t->page->bus_state)));
		}
		return;
	}
	thread_policy(&t->cycle, policy);
	if (t->cycle.policy != THREAD_FIFO) {
		finding_set(f, FINDING_FAIL, "%s: any thread can delay the cycle" REMEDY "%s",
			    policy,
			    t->cfg->cycle_priority == 0
				    ? "set cycle.priority"
				    : "LimitRTPRIO=98 in ecdaqd's unit, or CAP_SYS_NICE");
	} else if (t->cfg->cycle_priority != 0 &&
		   t->cycle.priority != (int)t->cfg->cycle_priority) {
		finding_set(f, FINDING_WARN,
			    "%s, but cycle.priority is %u" REMEDY
			    "restart ecdaqd with this configuration",
			    policy, t->cfg->cycle_priority);
	} else if (t->cpu >= 0 && !is_pinned(t)) {
		finding_set(f, FINDING_FAIL,
			    "%s, but may run on %.60s instead of core %d alone" REMEDY
			    "add core %d to ecdaqd's cpuset (AllowedCPUs=)",
			    policy, t->cycle.cores, t->cpu, t->cpu);
	} else {
		finding_set(f, FINDING_OK, "%s on core %.60s", policy, t->cycle.cores);
	}
}

struct users {
	const struct target *t;
	unsigned count;
	unsigned shown;
	char names[FINDING_TEXT_BYTES / 2];
	struct thread rival; /* not below the cycle in priority */
};

static void add_user(void *ctx, const struct thread *thread)
{
	struct users *users = ctx;
	const struct target *t = users->t;
	size_t used = strlen(users->names);
	int is_realtime = thread->policy == THREAD_FIFO || thread->policy == THREAD_RR;

	/* Not the kernel's own threads, and not this short-lived program. */
	if (thread->is_kernel || thread->tid == t->cycle.tid ||
	    (t->probe.root[0] == '\0' && thread->pid == getpid()) ||
	    !cpu_list_has(thread->cores, t->cpu)) {
		return;
	}
	users->count++;
	if (is_realtime && thread->priority >= (int)t->cfg->cycle_priority) {
		users->rival = *thread;
	}
	if (users->shown < NAMES_SHOWN && strstr(users->names, thread->name) == NULL) {
		snprintf(users->names + used, sizeof(users->names) - used, "%s%s",
			 used > 0 ? ", " : "", thread->name);
		users->shown++;
	}
}

static void judge_core_users(const struct target *t, struct finding *f)
{
	struct users users = { .t = t };
	struct thread init;
	char policy[32];
	int r;

	/* With hidepid= the processes of other users are invisible. */
	r = thread_read(&t->probe, 1, 1, &init);
	if (r == 0) {
		r = thread_each(&t->probe, 0, add_user, &users);
	}
	if (r < 0) {
		finding_unread(f, "/proc/1", r == -ENOENT ? -EACCES : r);
	} else if (users.rival.tid != 0) {
		finding_set(f, FINDING_FAIL,
			    "%s (%s) may preempt the cycle on core %d" REMEDY
			    "move it to another core (CPUAffinity=) or lower its priority",
			    users.rival.name, thread_policy(&users.rival, policy), t->cpu);
	} else if (users.count > 0) {
		finding_set(f, FINDING_WARN,
			    "%u other thread%s may run on core %d: %s%s" REMEDY "%s", users.count,
			    users.count == 1 ? "" : "s", t->cpu, users.names,
			    users.count > users.shown ? ", ..." : "",
			    target_is_isolated(t, t->cpu)
				    ? "move them to other cores (CPUAffinity=, taskset)"
				    : "isolate the core (isolcpus=)");
	} else {
		finding_set(f, FINDING_OK, "no other thread may run on core %d", t->cpu);
	}
}

static void judge_page_faults(const struct target *t, struct finding *f)
{
	uint64_t faults = GET(t->page->cycle.page_faults);

	finding_set(f, faults == 0 ? FINDING_OK : FINDING_FAIL,
		    "%" PRIu64 " in %" PRIu64 " cycles of ecdaqd%s", faults,
		    GET(t->page->cycle.cycles),
		    faults == 0 ? ""
				: REMEDY "cycle.lock_memory: on, and LimitMEMLOCK=infinity in "
					 "ecdaqd's unit");
}

/* The number behind @key in a file of /proc, -1 for "unlimited". */
static int number_behind(FILE *file, const char *key, int64_t *ret)
{
	char line[PROBE_TEXT_BYTES];
	size_t key_len = strlen(key);
	int r = -EBADMSG;

	if (file == NULL) {
		return -errno;
	}
	while (r < 0 && fgets(line, sizeof(line), file) != NULL) {
		const char *value = line + key_len;

		if (strncmp(line, key, key_len) != 0) {
			continue;
		}
		value += strspn(value, " \t");
		if (strncmp(value, "unlimited", 9) == 0) {
			*ret = -1;
			r = 0;
		} else if (isdigit((unsigned char)value[0])) {
			*ret = strtoll(value, NULL, 10);
			r = 0;
		}
	}
	fclose(file);
	return r;
}

static void judge_locked(const struct target *t, struct finding *f)
{
	FILE *file = probe_open(&t->probe, "/proc/%" PRId64 "/status", t->pid);
	int64_t locked_kib = 0;
	int r = number_behind(file, "VmLck:", &locked_kib);

	if (r < 0) {
		finding_unread(f, "/proc/PID/status of ecdaqd", r);
	} else if (locked_kib > 0) {
		finding_set(f, FINDING_OK, "%" PRId64 " KiB of ecdaqd are locked", locked_kib);
	} else {
		finding_set(f, FINDING_FAIL, "ecdaqd has locked no memory" REMEDY LOCK_REMEDY);
	}
}

static void judge_limit(const struct target *t, struct finding *f)
{
	FILE *file = probe_open(&t->probe, "/proc/self/limits");
	int64_t limit_bytes = 0;
	int r = number_behind(file, "Max locked memory", &limit_bytes);

	if (r < 0) {
		finding_unread(f, "/proc/self/limits", r);
	} else if (limit_bytes < 0) {
		finding_set(f, FINDING_OK, "unlimited here; ecdaqd is not running");
	} else {
		finding_set(f, FINDING_WARN,
			    "%" PRId64 " KiB may be locked here; ecdaqd is not running" REMEDY
			    "LimitMEMLOCK=infinity in ecdaqd's unit, or ulimit -l unlimited",
			    limit_bytes / 1024);
	}
}

static void judge_memory_lock(const struct target *t, struct finding *f)
{
	if (!t->cfg->cycle_lock_memory) {
		finding_set(f, FINDING_WARN,
			    "cycle.lock_memory is off: memory may be paged out" REMEDY
			    "cycle.lock_memory: on");
	} else if (t->page != NULL && (GET(t->page->rt_degraded) >> EVENT_RT_MEMORY & 1) != 0) {
		finding_set(f, FINDING_FAIL, "ecdaqd could not lock its memory" REMEDY LOCK_REMEDY);
	} else if (t->pid == 0 && t->page_err == 0) {
		judge_limit(t, f);
	} else if (t->cycle.tid != 0) {
		judge_locked(t, f);
	} else if (target_has(t, NEEDS_PAGE, f)) {
		finding_set(f, FINDING_SKIP, "ecdaqd locks its memory with its first cycle");
	}
}

const struct check checks_of_threads[] = {
	{ .name = "cycle_thread", .judge = judge_cycle_thread },
	{ .name = "core_users", .needs = NEEDS_CORE, .judge = judge_core_users },
	{ .name = "page_faults", .needs = NEEDS_PAGE, .judge = judge_page_faults },
	{ .name = "memory_lock", .judge = judge_memory_lock },
	{ .name = "swap",
	  .fact = "/proc/swaps",
	  .rules = { { FINDING_OK, "not built into this kernel", IF_ABSENT, NULL, NULL },
		     { FINDING_WARN,
		       "in use: memory that is not locked may be paged out" REMEDY
		       "swapoff --all, and remove it from /etc/fstab",
		       IF_HAS, "\n", NULL },
		     { .level = FINDING_OK, .text = "none" } } },
	{ .name = "huge_pages",
	  .fact = HUGE_PAGES,
	  .rules = { { FINDING_OK, "not built into this kernel", IF_ABSENT, NULL, NULL },
		     { FINDING_WARN,
		       "always: the kernel may move the cycle's memory at any time" REMEDY
		       "echo madvise > " HUGE_PAGES,
		       IF_HAS, "[always]", NULL },
		     { .level = FINDING_OK, .text = "{text}" } } },
	{ .name = NULL },
};
