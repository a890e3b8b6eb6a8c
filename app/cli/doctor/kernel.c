/* SPDX-License-Identifier: MIT */
/* What the machine is, how its kernel was built and started, and the cycle's core. */
#include <errno.h>
#include <inttypes.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "base/cpu_list.h"
#include "base/event.h"
#include "cli/doctor/check.h"

#define CPU_DIR "/sys/devices/system/cpu"
#define CORE_DIR CPU_DIR "/cpu{core}"
#define RT_RUNTIME "/proc/sys/kernel/sched_rt_runtime_us"
#define RT_PERIOD "/proc/sys/kernel/sched_rt_period_us"
#define IMAGE "/usr/lib/ecdaq/image"
#define TIMER_MIGRATION "/proc/sys/kernel/timer_migration"
#define NO_CLAIM                                                                                   \
	"latencies measured here do not apply to hardware" REMEDY "measure on the target "         \
	"hardware"

/* A shorter exit latency does not make a cycle late. */
#define IDLE_TOLERABLE_US 10

/* Debian's point releases come every two to three months, security updates in between. */
enum { ARCHIVE_DAYS_MAX = 90, SECONDS_OF_DAY = 86400 };
enum { CMDLINE_BYTES = 4096, CPUINFO_LINES = 64, IDLE_STATES_MAX = 16 };

/* --- what it is --- */

static int is_container(const struct target *t)
{
	return probe_exists(&t->probe, "/run/systemd/container") ||
	       probe_exists(&t->probe, "/.dockerenv") ||
	       probe_exists(&t->probe, "/run/.containerenv");
}

/* On x86 a hypervisor sets a CPU flag. */
static int has_hypervisor_flag(const struct target *t)
{
	FILE *file = probe_open(&t->probe, "/proc/cpuinfo");
	char *line = NULL;
	size_t bytes = 0;
	int found = 0;

	for (int i = 0; file != NULL && i < CPUINFO_LINES && getline(&line, &bytes, file) > 0;
	     i++) {
		found |= strncmp(line, "flags", 5) == 0 && strstr(line, " hypervisor") != NULL;
	}
	free(line);
	if (file != NULL) {
		fclose(file);
	}
	return found;
}

/* By vendor in the DMI tables or by device tree. NULL: a real machine. */
static const char *hypervisor(const struct target *t)
{
	static const char *const makers[] = { "QEMU",       "VMware",    "innotek",
					      "VirtualBox", "Xen",       "Amazon EC2",
					      "Google",     "Parallels", "Bochs" };
	char text[PROBE_TEXT_BYTES] = "";

	if (probe_text(&t->probe, text, "/sys/class/dmi/id/sys_vendor") >= 0) {
		for (size_t i = 0; i < sizeof(makers) / sizeof(makers[0]); i++) {
			if (strstr(text, makers[i]) != NULL) {
				return makers[i];
			}
		}
	}
	if (probe_text(&t->probe, text, "/proc/device-tree/compatible") >= 0 &&
	    strcmp(text, "linux,dummy-virt") == 0) {
		return "QEMU's virt";
	}
	if (probe_exists(&t->probe, "/proc/device-tree/hypervisor") || has_hypervisor_flag(t)) {
		return "a hypervisor";
	}
	return NULL;
}

static void judge_machine(const struct target *t, struct finding *f)
{
	const char *under = hypervisor(t);
	char model[PROBE_TEXT_BYTES] = "";

	if (probe_text(&t->probe, model, "/proc/device-tree/model") < 0 || model[0] == '\0') {
		probe_text(&t->probe, model, "/sys/class/dmi/id/product_name");
	}
	if (is_container(t)) {
		finding_set(f, FINDING_WARN, "a container%s: " NO_CLAIM,
			    under == NULL ? "" : " in a virtual machine");
	} else if (under != NULL) {
		finding_set(f, FINDING_WARN, "a virtual machine (%s): " NO_CLAIM, under);
	} else {
		finding_set(f, FINDING_OK, "%.100s", model[0] == '\0' ? "hardware" : model);
	}
}

/* Days from the date behind "Debian archive: " to now. -1: no date, or a clock before it. */
static int64_t days_since_archive(const struct target *t, const char *image)
{
	static const char before[] = "Debian archive: ";
	const char *date = strstr(image, before);
	char clock[PROBE_TEXT_BYTES];
	struct tm day = { 0 };
	int64_t now_s;

	if (date == NULL || strptime(date + strlen(before), "%Y-%m-%d", &day) == NULL ||
	    probe_call(&t->probe, "clock", "", clock) < 0 ||
	    probe_figure(clock, "utc_s", &now_s) < 0 || now_s < timegm(&day)) {
		return -1;
	}
	return (now_s - timegm(&day)) / SECONDS_OF_DAY;
}

static void judge_image(const struct target *t, struct finding *f)
{
	char image[PROBE_TEXT_BYTES] = "";
	int r = probe_text(&t->probe, image, IMAGE);
	int64_t days = days_since_archive(t, image);

	if (r == -ENOENT) {
		finding_set(f, FINDING_SKIP, "not an image of ecdaq");
	} else if (r < 0) {
		finding_unread(f, IMAGE, r);
	} else if (days > ARCHIVE_DAYS_MAX) {
		finding_set(f, FINDING_WARN,
			    "%.150s: %" PRId64
			    " days old, without the security updates since" REMEDY
			    "./build.sh bundle with --refresh before it, then ecdaq-update install",
			    image, days);
	} else {
		finding_set(f, FINDING_OK, "%.200s", image);
	}
}

/* --- isolation --- */

int target_is_isolated(const struct target *t, int cpu)
{
	char list[PROBE_TEXT_BYTES];

	if (cpu < 0) {
		return 0;
	}
	return (probe_text(&t->probe, list, CPU_DIR "/isolated") >= 0 && cpu_list_has(list, cpu)) ||
	       (probe_text(&t->probe, list, "/sys/fs/cgroup/cpuset.cpus.isolated") >= 0 &&
		cpu_list_has(list, cpu));
}

static const char *list_or_none(const char *list)
{
	return list[0] < '0' || list[0] > '9' ? "none" : list;
}

static void judge_isolation(const struct target *t, struct finding *f)
{
	char isolated[PROBE_TEXT_BYTES] = "";
	char online[PROBE_TEXT_BYTES] = "";
	int r = probe_text(&t->probe, online, CPU_DIR "/online");

	probe_text(&t->probe, isolated, CPU_DIR "/isolated");
	if (r < 0) {
		finding_unread(f, CPU_DIR "/online", r);
	} else if (t->cpu < 0) {
		finding_set(f, FINDING_WARN,
			    "cycle.cpu is -1: the cycle shares its core (isolated: %.60s)" REMEDY
			    "isolate the last core N of %.60s (isolcpus=managed_irq,domain,N) and "
			    "set cycle.cpu: N",
			    list_or_none(isolated), list_or_none(online));
	} else if (!cpu_list_has(online, t->cpu)) {
		finding_set(f, FINDING_FAIL,
			    "core %d does not exist (online: %.60s)" REMEDY
			    "set cycle.cpu to one of %.60s",
			    t->cpu, online, online);
	} else if (!target_is_isolated(t, t->cpu)) {
		finding_set(f, FINDING_FAIL,
			    "core %d is not isolated (isolated: %.60s)" REMEDY
			    "kernel command line: isolcpus=managed_irq,domain,%d",
			    t->cpu, list_or_none(isolated), t->cpu);
	} else if (t->cpu == 0) {
		finding_set(f, FINDING_WARN,
			    "core 0 is isolated, but the kernel's housekeeping runs on it" REMEDY
			    "isolate the last core instead of core 0");
	} else {
		finding_set(f, FINDING_OK, "core %d of %.60s", t->cpu, online);
	}
}

/* The list behind the word @name= of the kernel's command line; 0, or -ENOENT without it. */
static int cmdline_list(const struct target *t, const char *name, char ret[PROBE_TEXT_BYTES])
{
	char line[CMDLINE_BYTES];
	size_t name_len = strlen(name);
	FILE *file = probe_open(&t->probe, "/proc/cmdline");
	char *left = line;
	const char *word;
	int r = -ENOENT;

	if (file == NULL) {
		return -errno;
	}
	if (fgets(line, sizeof(line), file) == NULL) {
		line[0] = '\0';
	}
	fclose(file);
	while ((word = strsep(&left, " \n")) != NULL) {
		if (strncmp(word, name, name_len) == 0 && word[name_len] == '=') {
			snprintf(ret, PROBE_TEXT_BYTES, "%s", word + name_len + 1);
			r = 0;
		}
	}
	return r;
}

static void judge_rcu_nocbs(const struct target *t, struct finding *f)
{
	char nocbs[PROBE_TEXT_BYTES] = "";
	char nohz[PROBE_TEXT_BYTES] = "";
	int r = cmdline_list(t, "rcu_nocbs", nocbs);

	probe_text(&t->probe, nohz, CPU_DIR "/nohz_full");
	if (r < 0 && r != -ENOENT) {
		finding_unread(f, "/proc/cmdline", r);
	} else if (cpu_list_has(nocbs, t->cpu) || strcmp(nocbs, "all") == 0) {
		finding_set(f, FINDING_OK, "rcu_nocbs=%.60s", nocbs);
	} else if (cpu_list_has(nohz, t->cpu)) {
		finding_set(f, FINDING_OK, "core %d, implied by nohz_full", t->cpu);
	} else {
		finding_set(f, FINDING_WARN,
			    "core %d runs RCU callbacks" REMEDY "kernel command line: rcu_nocbs=%d",
			    t->cpu, t->cpu);
	}
}

/* --- idle states --- */

struct idle {
	char name[PROBE_TEXT_BYTES];
	int64_t latency_us;
};

/* The state within @limit_us that has the longest exit latency. 0, or -errno without any state. */
static int deepest(const struct target *t, int cpu, int64_t limit_us, struct idle *ret)
{
	struct idle idle = { .latency_us = -1 };
	int found = -ENOENT;

	for (int i = 0; i < IDLE_STATES_MAX; i++) {
		int64_t latency_us;
		int64_t is_disabled = 0;
		int r = probe_number(&t->probe, &latency_us,
				     CPU_DIR "/cpu%d/cpuidle/state%d/latency", cpu, i);

		if (r < 0) {
			found = found == 0 || r == -ENOENT ? found : r;
			break;
		}
		found = 0;
		probe_number(&t->probe, &is_disabled, CPU_DIR "/cpu%d/cpuidle/state%d/disable", cpu,
			     i);
		if (is_disabled == 0 && latency_us <= limit_us && latency_us > idle.latency_us) {
			snprintf(idle.name, sizeof(idle.name), "state %d", i);
			probe_text(&t->probe, idle.name, CPU_DIR "/cpu%d/cpuidle/state%d/name", cpu,
				   i);
			idle.latency_us = latency_us;
		}
	}
	if (found == 0) {
		*ret = idle;
	}
	return found;
}

/* The strictest limit that any process holds. */
static int read_limit(const struct target *t, int64_t *ret_us)
{
	FILE *file = probe_open(&t->probe, "/dev/cpu_dma_latency");
	int32_t limit_us;
	size_t got;

	if (file == NULL) {
		return -errno;
	}
	got = fread(&limit_us, sizeof(limit_us), 1, file);
	fclose(file);
	if (got != 1) {
		return -EBADMSG;
	}
	*ret_us = limit_us;
	return 0;
}

/* ecdaqd holds its own limit while it runs; its status page shows if it was refused. */
static int64_t daemon_limit(const struct target *t)
{
	uint32_t degraded =
		t->page == NULL ? 0
				: atomic_load_explicit(&t->page->rt_degraded, memory_order_relaxed);

	return t->cfg->cycle_cpu_dma_latency_us >= 0 && (degraded >> EVENT_RT_DMA_LATENCY & 1) == 0
		       ? t->cfg->cycle_cpu_dma_latency_us
		       : INT32_MAX;
}

static void judge_idle_states(const struct target *t, struct finding *f)
{
	int cpu = t->cpu < 0 ? 0 : t->cpu;
	int64_t limit_us = 0;
	int64_t daemon_us = daemon_limit(t);
	const char *when = "";
	struct idle idle;
	int r;

	/* Without ecdaqd the present limit is not that of a running cycle. */
	if (read_limit(t, &limit_us) < 0 || (t->pid == 0 && daemon_us < limit_us)) {
		limit_us = daemon_us;
		when = t->pid == 0 && daemon_us < INT32_MAX ? ", while ecdaqd runs" : "";
	}
	r = deepest(t, cpu, limit_us, &idle);
	if (r == -ENOENT) {
		finding_set(f, FINDING_OK, "Linux does not put core %d into idle states", cpu);
	} else if (r < 0) {
		finding_unread(f, "cpuidle", r);
	} else if (idle.latency_us < 0) {
		finding_set(f, FINDING_OK, "none: exit latency is limited to %" PRId64 " us%s",
			    limit_us, when);
	} else if (idle.latency_us <= IDLE_TOLERABLE_US) {
		finding_set(f, FINDING_OK, "at most %.60s: exit latency %" PRId64 " us%s",
			    idle.name, idle.latency_us, when);
	} else {
		finding_set(f, FINDING_WARN,
			    "core %d may enter %.60s: exit latency %" PRId64 " us" REMEDY
			    "cycle.cpu_dma_latency: 0us, and let ecdaqd write to "
			    "/dev/cpu_dma_latency",
			    cpu, idle.name, idle.latency_us);
	}
}

const struct check checks_of_kernel[] = {
	{ .name = "machine", .judge = judge_machine },
	{ .name = "image", .judge = judge_image },
	{ .name = "slots",
	  .fact = "/run/ecdaq-slots/slots",
	  .rules = { { FINDING_SKIP, "not a machine with two slots, or its start is not good yet",
		       IF_ABSENT, NULL, NULL },
		     { .level = FINDING_OK, .text = "{text}" } } },
	{ .name = "kernel",
	  .fact = "/proc/sys/kernel/osrelease",
	  .rules = { { FINDING_OK, "{text} PREEMPT_RT", IF_AT_LEAST, "1", "/sys/kernel/realtime" },
		     { FINDING_OK, "{text} PREEMPT_RT", IF_HAS, "PREEMPT_RT",
		       "/proc/sys/kernel/version" },
		     { .level = FINDING_FAIL,
		       .text = "{text} is not PREEMPT_RT: the cycle wakes late under load" REMEDY
			       "boot a PREEMPT_RT kernel (mainline from 6.12 on; Debian: "
			       "linux-image-rt-*)" } } },
	{ .name = "isolation", .judge = judge_isolation },
	{ .name = "nohz_full",
	  .needs = NEEDS_CORE,
	  .rules = { { FINDING_OK, "core {core}", IF_LISTS_CORE, NULL, CPU_DIR "/nohz_full" },
		     { .level = FINDING_WARN,
		       .text = "core {core} has the kernel's periodic tick" REMEDY
			       "kernel command line: nohz_full={core}" } } },
	{ .name = "rcu_nocbs", .needs = NEEDS_CORE, .judge = judge_rcu_nocbs },
	{ .name = "rt_throttling",
	  .fact = RT_RUNTIME,
	  .rules = { { FINDING_OK, "off ({text})", IF_AT_LEAST, RT_PERIOD, NULL },
		     { FINDING_WARN,
		       "real-time threads may run only {text} us in each {" RT_PERIOD "} us" REMEDY
		       "sysctl kernel.sched_rt_runtime_us=-1",
		       IF_AT_LEAST, "0", NULL },
		     { .level = FINDING_OK, .text = "off ({text})" } } },
	{ .name = "timer_migration",
	  .needs = NEEDS_CORE,
	  .fact = TIMER_MIGRATION,
	  .rules = { { FINDING_WARN,
		       "the cycle's timer may fire on another core, which then wakes core "
		       "{core}" REMEDY "sysctl kernel.timer_migration=0",
		       IF_AT_LEAST, "1", NULL },
		     { .level = FINDING_OK, .text = "off" } } },
	{ .name = "smt",
	  .needs = NEEDS_CORE,
	  .fact = CORE_DIR "/topology/thread_siblings_list",
	  .rules = { { FINDING_OK, "core {core} has no hardware sibling", IF_IN, "{core}", NULL },
		     { .level = FINDING_WARN,
		       .text = "core {core} shares its hardware: cores {text}" REMEDY
			       "nosmt on the kernel command line, or echo 0 > " CPU_DIR
			       "/cpuN/online for the other one" } } },
	{ .name = "governor",
	  .fact = CORE_DIR "/cpufreq/scaling_governor",
	  .rules = { { FINDING_OK, "Linux does not change the frequency of core {core}", IF_ABSENT,
		       NULL, NULL },
		     { FINDING_OK, "{text} on core {core}", IF_IN, "performance", NULL },
		     { FINDING_OK, "{text} on core {core}, with one frequency", IF_AT_LEAST,
		       CORE_DIR "/cpufreq/scaling_max_freq", CORE_DIR "/cpufreq/scaling_min_freq" },
		     { .level = FINDING_WARN,
		       .text = "{text}: core {core} slows down and takes time to speed up" REMEDY
			       "echo performance > " CORE_DIR "/cpufreq/scaling_governor" } } },
	{ .name = "idle_states", .judge = judge_idle_states },
	{ .name = NULL },
};
