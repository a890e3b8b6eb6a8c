/* SPDX-License-Identifier: MIT */
#include "cli/doctor/thread.h"

#include <ctype.h>
#include <errno.h>
#include <inttypes.h>
#include <stdlib.h>
#include <string.h>

#define FLAG_KTHREAD 0x00200000 /* PF_KTHREAD of the kernel's sched.h */

enum { STAT_BYTES = 1024 };

/* Numbers of the fields as proc(5) counts them. */
enum { FIELD_STATE = 3, FIELD_FLAGS = 9, FIELD_PRIORITY = 40, FIELD_POLICY = 41 };

int thread_parse_stat(const char *line, struct thread *ret)
{
	struct thread thread = { .pid = 0 };
	const char *open = strchr(line, '(');
	const char *close = strrchr(line, ')'); /* a name may hold brackets itself */
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

static int read_cores(const struct sight *s, struct thread *thread)
{
	static const char key[] = "Cpus_allowed_list:";
	FILE *file = sight_open(s, "/proc/%" PRId64 "/task/%" PRId64 "/status", thread->pid,
				thread->tid);
	char line[SIGHT_TEXT_BYTES];
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

int thread_read(const struct sight *s, int64_t pid, int64_t tid, struct thread *ret)
{
	FILE *file = sight_open(s, "/proc/%" PRId64 "/task/%" PRId64 "/stat", pid, tid);
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
		r = read_cores(s, &thread);
	}
	if (r == 0) {
		*ret = thread;
	}
	return r;
}

struct walk {
	const struct sight *s;
	int64_t pid;
	void (*each)(void *ctx, const struct thread *thread);
	void *ctx;
};

static void walk_thread(void *ctx, const char *name)
{
	const struct walk *walk = ctx;
	struct thread thread;

	/* One that has ended meanwhile is none. */
	if (isdigit((unsigned char)name[0]) &&
	    thread_read(walk->s, walk->pid, strtoll(name, NULL, 10), &thread) == 0) {
		walk->each(walk->ctx, &thread);
	}
}

static int walk_process(struct walk *walk, int64_t pid)
{
	char dir[64];

	snprintf(dir, sizeof(dir), "/proc/%" PRId64 "/task", pid);
	walk->pid = pid;
	return sight_each(walk->s, dir, walk_thread, walk);
}

static void walk_entry(void *ctx, const char *name)
{
	if (isdigit((unsigned char)name[0])) {
		walk_process(ctx, strtoll(name, NULL, 10));
	}
}

int thread_each(const struct sight *s, int64_t pid,
		void (*each)(void *ctx, const struct thread *thread), void *ctx)
{
	struct walk walk = { .s = s, .each = each, .ctx = ctx };

	return pid != 0 ? walk_process(&walk, pid) : sight_each(s, "/proc", walk_entry, &walk);
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
