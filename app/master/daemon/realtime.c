/* SPDX-License-Identifier: MIT */
#include "daemon/realtime.h"

#include <errno.h>
#include <fcntl.h>
#include <sched.h>
#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <unistd.h>

#include "base/cpu_list.h"

#define DMA_LATENCY_PATH "/dev/cpu_dma_latency"
#define ISOLATED_PATH "/sys/devices/system/cpu/isolated"

enum { STACK_BYTES = 1024 * 1024, GUARD_BYTES = 64 * 1024, TEXT_BYTES = 320, PROBE_BYTES = 4096 };

static void report(struct realtime *rt, enum event_rt which, int err, const char *format, ...)
	__attribute__((format(printf, 4, 5)));

static void report(struct realtime *rt, enum event_rt which, int err, const char *format, ...)
{
	char text[TEXT_BYTES];
	va_list args;

	if (rt->reported >> which & 1) {
		return;
	}
	rt->reported |= 1u << which;
	va_start(args, format);
	vsnprintf(text, sizeof(text), format, args);
	va_end(args);
	rt->degraded(rt->ctx, which, err, text);
}

/* --- cores --- */

int realtime_is_isolated(int cpu)
{
	char list[1024];
	int fd = open(ISOLATED_PATH, O_RDONLY | O_CLOEXEC);
	ssize_t len;

	if (fd < 0) {
		return 0;
	}
	len = read(fd, list, sizeof(list) - 1);
	close(fd);
	list[len > 0 ? len : 0] = '\0';
	return cpu_list_has(list, cpu);
}

/* This thread, and those it will start, keep off the cycle's core, unless there is no other. */
static void leave_core(const struct config *cfg)
{
	cpu_set_t set;

	if (cfg->cycle_cpu < 0 || cfg->cycle_cpu >= CPU_SETSIZE ||
	    sched_getaffinity(0, sizeof(set), &set) < 0) {
		return;
	}
	CPU_CLR((unsigned)cfg->cycle_cpu, &set);
	if (CPU_COUNT(&set) > 0) {
		sched_setaffinity(0, sizeof(set), &set);
	}
}

static void pin(struct realtime *rt)
{
	int cpu = rt->cfg->cycle_cpu;
	cpu_set_t set;
	int r = EINVAL;

	rt->is_pinned = 0;
	if (cpu < 0) {
		return;
	}
	if (cpu < CPU_SETSIZE) {
		CPU_ZERO(&set);
		CPU_SET((unsigned)cpu, &set);
		r = pthread_setaffinity_np(rt->thread, sizeof(set), &set);
	}
	if (r != 0) {
		report(rt, EVENT_RT_CPU, r,
		       "cycle.cpu %d: %s: this machine has cores 0 to %ld, or a cpuset forbids it; "
		       "the cycle thread is not pinned",
		       cpu, strerror(r), sysconf(_SC_NPROCESSORS_ONLN) - 1);
		return;
	}
	rt->is_pinned = 1;
}

/* --- priority --- */

static void raise_priority(struct realtime *rt)
{
	struct sched_param param = { .sched_priority = (int)rt->cfg->cycle_priority };
	int r;

	if (param.sched_priority == 0) {
		return;
	}
	r = pthread_setschedparam(rt->thread, SCHED_FIFO, &param);
	if (r != 0) {
		report(rt, EVENT_RT_PRIORITY, r,
		       "cycle.priority %d: SCHED_FIFO refused: %s: requires CAP_SYS_NICE (or "
		       "`ulimit -r`, LimitRTPRIO=); the cycle will wake late under load",
		       param.sched_priority, strerror(r));
	}
}

/* --- memory --- */

/* Rights are found by trying: in a user namespace CAP_IPC_LOCK may be set and mlockall still fail.
 */
static int may_lock_without_limit(void)
{
	struct rlimit old;
	struct rlimit none;
	static char probe[PROBE_BYTES];
	int may;

	if (getrlimit(RLIMIT_MEMLOCK, &old) < 0) {
		return 0;
	}
	if (old.rlim_cur == RLIM_INFINITY) {
		return 1;
	}
	none = (struct rlimit){ .rlim_cur = 0, .rlim_max = old.rlim_max };
	if (setrlimit(RLIMIT_MEMLOCK, &none) < 0) {
		return 0;
	}
	may = mlock(probe, sizeof(probe)) == 0;
	if (may) {
		munlock(probe, sizeof(probe));
	}
	setrlimit(RLIMIT_MEMLOCK, &old);
	return may;
}

static void raise_memory_limit(void)
{
	struct rlimit limit;

	if (getrlimit(RLIMIT_MEMLOCK, &limit) == 0 && limit.rlim_cur != limit.rlim_max) {
		limit.rlim_cur = limit.rlim_max;
		setrlimit(RLIMIT_MEMLOCK, &limit);
	}
}

/*
 * With a limit, MCL_FUTURE would make a later allocation of the service thread fail when it is
 * reached; so only the present memory is locked. All that the cycle uses is allocated by now.
 */
static void lock_memory(struct realtime *rt)
{
	int flags;

	if (!rt->cfg->cycle_lock_memory) {
		return;
	}
	raise_memory_limit();
	flags = may_lock_without_limit() ? MCL_CURRENT | MCL_FUTURE : MCL_CURRENT;
	if (mlockall(flags) < 0) {
		int err = errno;

		report(rt, EVENT_RT_MEMORY, err,
		       "cycle.lock_memory: mlockall refused: %s: requires CAP_IPC_LOCK, or a "
		       "higher "
		       "`ulimit -l` (LimitMEMLOCK=), or a smaller ring.depth; memory may be paged "
		       "out",
		       strerror(err));
	}
}

/* --- CPU sleep --- */

static void hold_cpu_awake(struct realtime *rt)
{
	int32_t latency_us = rt->cfg->cycle_cpu_dma_latency_us;

	rt->dma_latency = -1;
	if (latency_us < 0) {
		return;
	}
	rt->dma_latency = open(DMA_LATENCY_PATH, O_RDWR | O_CLOEXEC);
	if (rt->dma_latency < 0 || write(rt->dma_latency, &latency_us, sizeof(latency_us)) !=
					   (ssize_t)sizeof(latency_us)) {
		int err = errno;

		report(rt, EVENT_RT_DMA_LATENCY, err,
		       "cycle.cpu_dma_latency: " DMA_LATENCY_PATH
		       ": %s: make it writable for ecdaqd, or set cycle.cpu_dma_latency to -1us; "
		       "the CPU may sleep deeply and wake late",
		       strerror(err));
		if (rt->dma_latency >= 0) {
			close(rt->dma_latency);
			rt->dma_latency = -1;
		}
	}
}

void realtime_open(struct realtime *rt, const struct config *cfg, realtime_degraded_fn *degraded,
		   void *ctx)
{
	memset(rt, 0, sizeof(*rt));
	rt->cfg = cfg;
	rt->degraded = degraded;
	rt->ctx = ctx;
	hold_cpu_awake(rt);
	leave_core(cfg);
}

void realtime_close(struct realtime *rt)
{
	if (rt->dma_latency >= 0) {
		close(rt->dma_latency);
		rt->dma_latency = -1;
	}
}

/* --- the thread --- */

static void *cycle_thread(void *arg)
{
	struct realtime *rt = arg;

	/* Until the service thread has given this one its priority and its core. */
	while (sem_wait(&rt->gate) < 0 && errno == EINTR) {
	}
	rt->result = cycle_run(rt->cycle);
	atomic_store_explicit(&rt->has_ended, 1, memory_order_release);
	return NULL;
}

/* Own pages, touched now, a guard below: the stack neither faults nor overwrites other memory. */
static int make_stack(struct realtime *rt)
{
	size_t bytes = STACK_BYTES + GUARD_BYTES;
	void *stack = mmap(NULL, bytes, PROT_READ | PROT_WRITE,
			   MAP_PRIVATE | MAP_ANONYMOUS | MAP_STACK, -1, 0);

	if (stack == MAP_FAILED) {
		return -errno;
	}
	if (mprotect(stack, GUARD_BYTES, PROT_NONE) < 0) {
		int r = -errno;

		munmap(stack, bytes);
		return r;
	}
	memset((char *)stack + GUARD_BYTES, 0, STACK_BYTES);
	rt->stack = stack;
	return 0;
}

static void free_stack(struct realtime *rt)
{
	munmap(rt->stack, STACK_BYTES + GUARD_BYTES);
	rt->stack = NULL;
}

/* Signals are the service thread's. */
static int start_thread(struct realtime *rt)
{
	pthread_attr_t attr;
	sigset_t all;
	sigset_t old;
	int r;

	pthread_attr_init(&attr);
	pthread_attr_setstack(&attr, (char *)rt->stack + GUARD_BYTES, STACK_BYTES);
	sigfillset(&all);
	pthread_sigmask(SIG_SETMASK, &all, &old);
	r = pthread_create(&rt->thread, &attr, cycle_thread, rt);
	pthread_sigmask(SIG_SETMASK, &old, NULL);
	pthread_attr_destroy(&attr);
	return -r;
}

int realtime_cycle_start(void *ctx, struct cycle *cycle, struct failure *failure)
{
	struct realtime *rt = ctx;
	int r = make_stack(rt);

	if (r < 0) {
		return failure_set(failure, EXIT_CODE_RESOURCES, r, "cycle thread: stack: %s",
				   strerror(-r));
	}
	rt->cycle = cycle;
	rt->result = 0;
	atomic_store_explicit(&rt->has_ended, 0, memory_order_relaxed);
	sem_init(&rt->gate, 0, 0);
	r = start_thread(rt);
	if (r < 0) {
		sem_destroy(&rt->gate);
		free_stack(rt);
		return failure_set(failure, EXIT_CODE_RESOURCES, r, "cycle thread: %s",
				   strerror(-r));
	}
	rt->is_running = 1;
	pthread_setname_np(rt->thread, "ecdaqd-cycle");
	pin(rt);
	raise_priority(rt);
	lock_memory(rt);
	sem_post(&rt->gate);
	return 0;
}

int realtime_cycle_end(void *ctx)
{
	struct realtime *rt = ctx;

	if (!rt->is_running) {
		return 0;
	}
	cycle_stop(rt->cycle);
	pthread_join(rt->thread, NULL);
	rt->is_running = 0;
	sem_destroy(&rt->gate);
	free_stack(rt);
	return rt->result;
}

int realtime_cycle_has_ended(void *ctx)
{
	struct realtime *rt = ctx;

	return atomic_load_explicit(&rt->has_ended, memory_order_acquire);
}
