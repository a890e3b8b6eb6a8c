/* SPDX-License-Identifier: MIT */
/* What the kernel was built for and told at boot: preemption, isolation, ticks, RCU, throttling. */
#include <errno.h>
#include <inttypes.h>
#include <string.h>

#include "base/cpu_list.h"
#include "cli/doctor/patient.h"

#define CPU_DIR "/sys/devices/system/cpu"

enum { CMDLINE_BYTES = 4096 };

int patient_is_isolated(const struct patient *p, int cpu)
{
	char list[SIGHT_TEXT_BYTES];

	if (cpu < 0) {
		return 0;
	}
	return (sight_text(&p->sight, list, CPU_DIR "/isolated") >= 0 && cpu_list_has(list, cpu)) ||
	       (sight_text(&p->sight, list, "/sys/fs/cgroup/cpuset.cpus.isolated") >= 0 &&
		cpu_list_has(list, cpu));
}

int patient_has_core(const struct patient *p, struct finding *f)
{
	if (p->cpu < 0) {
		finding_set(f, FINDING_SKIP, "the cycle has no core of its own (cycle.cpu)");
		return 0;
	}
	return 1;
}

void check_kernel(const struct patient *p, struct finding *f)
{
	char release[SIGHT_TEXT_BYTES] = "";
	char version[SIGHT_TEXT_BYTES] = "";
	int64_t is_realtime = 0;
	int r = sight_text(&p->sight, release, "/proc/sys/kernel/osrelease");

	if (r < 0) {
		finding_unread(f, "/proc/sys/kernel/osrelease", r);
		return;
	}
	sight_text(&p->sight, version, "/proc/sys/kernel/version");
	sight_number(&p->sight, &is_realtime, "/sys/kernel/realtime");
	if (is_realtime == 1 || strstr(version, "PREEMPT_RT") != NULL) {
		finding_set(f, FINDING_OK, "%.100s PREEMPT_RT", release);
		return;
	}
	finding_set(f, FINDING_FAIL, "%.100s is not PREEMPT_RT: the cycle wakes late under load",
		    release);
	finding_mend(f, "boot a PREEMPT_RT kernel (mainline from 6.12 on; Debian: "
			"linux-image-rt-*)");
}

static const char *list_or_none(const char *list)
{
	return list[0] < '0' || list[0] > '9' ? "none" : list;
}

static void mend_isolation(const struct patient *p, struct finding *f)
{
	char online[SIGHT_TEXT_BYTES] = "";

	if (p->cpu >= 0) {
		finding_mend(f, "kernel command line: isolcpus=managed_irq,domain,%d", p->cpu);
		return;
	}
	sight_text(&p->sight, online, CPU_DIR "/online");
	finding_mend(f,
		     "isolate the last core N of %.60s (isolcpus=managed_irq,domain,N) and set "
		     "cycle.cpu: N",
		     list_or_none(online));
}

void check_isolation(const struct patient *p, struct finding *f)
{
	char isolated[SIGHT_TEXT_BYTES] = "";
	char online[SIGHT_TEXT_BYTES] = "";
	int r = sight_text(&p->sight, online, CPU_DIR "/online");

	if (r < 0) {
		finding_unread(f, CPU_DIR "/online", r);
		return;
	}
	sight_text(&p->sight, isolated, CPU_DIR "/isolated");
	if (p->cpu < 0) {
		finding_set(f, FINDING_WARN,
			    "cycle.cpu is -1: the cycle shares its core (isolated: %.60s)",
			    list_or_none(isolated));
		mend_isolation(p, f);
	} else if (!cpu_list_has(online, p->cpu)) {
		finding_set(f, FINDING_FAIL, "core %d is not there (online: %.60s)", p->cpu,
			    online);
		finding_mend(f, "set cycle.cpu to one of %.60s", online);
	} else if (!patient_is_isolated(p, p->cpu)) {
		finding_set(f, FINDING_FAIL, "core %d is not isolated (isolated: %.60s)", p->cpu,
			    list_or_none(isolated));
		mend_isolation(p, f);
	} else if (p->cpu == 0) {
		finding_set(f, FINDING_WARN, "core 0 is isolated, but does the kernel's own work");
		finding_mend(f, "isolate the last core instead of core 0");
	} else {
		finding_set(f, FINDING_OK, "core %d of %.60s", p->cpu, online);
	}
}

/* The list behind the word @name= of the kernel's command line; 0, or -ENOENT without it. */
static int cmdline_list(const struct patient *p, const char *name, char ret[SIGHT_TEXT_BYTES])
{
	char line[CMDLINE_BYTES];
	size_t name_len = strlen(name);
	FILE *file = sight_open(&p->sight, "/proc/cmdline");
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
			snprintf(ret, SIGHT_TEXT_BYTES, "%s", word + name_len + 1);
			r = 0;
		}
	}
	return r;
}

static int has_nohz_full(const struct patient *p)
{
	char list[SIGHT_TEXT_BYTES];

	return sight_text(&p->sight, list, CPU_DIR "/nohz_full") >= 0 && cpu_list_has(list, p->cpu);
}

void check_nohz_full(const struct patient *p, struct finding *f)
{
	if (!patient_has_core(p, f)) {
		return;
	}
	if (has_nohz_full(p)) {
		finding_set(f, FINDING_OK, "core %d", p->cpu);
		return;
	}
	finding_set(f, FINDING_WARN, "core %d keeps the kernel's tick", p->cpu);
	finding_mend(f, "kernel command line: nohz_full=%d", p->cpu);
}

void check_rcu_nocbs(const struct patient *p, struct finding *f)
{
	char list[SIGHT_TEXT_BYTES] = "";
	int r;

	if (!patient_has_core(p, f)) {
		return;
	}
	r = cmdline_list(p, "rcu_nocbs", list);
	if (r < 0 && r != -ENOENT) {
		finding_unread(f, "/proc/cmdline", r);
	} else if (cpu_list_has(list, p->cpu) || strcmp(list, "all") == 0) {
		finding_set(f, FINDING_OK, "rcu_nocbs=%.60s", list);
	} else if (has_nohz_full(p)) {
		finding_set(f, FINDING_OK, "core %d, as nohz_full has it", p->cpu);
	} else {
		finding_set(f, FINDING_WARN, "core %d runs RCU callbacks", p->cpu);
		finding_mend(f, "kernel command line: rcu_nocbs=%d", p->cpu);
	}
}

void check_rt_throttling(const struct patient *p, struct finding *f)
{
	static const char path[] = "/proc/sys/kernel/sched_rt_runtime_us";
	int64_t runtime_us;
	int64_t period_us = 1000000; /* the kernel's own */
	int r = sight_number(&p->sight, &runtime_us, "%s", path);

	if (r < 0) {
		finding_unread(f, path, r);
		return;
	}
	sight_number(&p->sight, &period_us, "/proc/sys/kernel/sched_rt_period_us");
	if (runtime_us < 0 || runtime_us >= period_us) {
		finding_set(f, FINDING_OK, "off (%" PRId64 ")", runtime_us);
		return;
	}
	finding_set(f, FINDING_WARN,
		    "real-time threads may be held for %" PRId64 " us in each %" PRId64 " us",
		    period_us - runtime_us, period_us);
	finding_mend(f, "sysctl kernel.sched_rt_runtime_us=-1");
}

void check_timer_migration(const struct patient *p, struct finding *f)
{
	static const char path[] = "/proc/sys/kernel/timer_migration";
	int64_t value;
	int r;

	if (!patient_has_core(p, f)) {
		return;
	}
	r = sight_number(&p->sight, &value, "%s", path);
	if (r < 0) {
		finding_unread(f, path, r);
	} else if (value == 0) {
		finding_set(f, FINDING_OK, "off");
	} else {
		finding_set(f, FINDING_WARN,
			    "the cycle's timer may fire on another core, which then wakes core %d",
			    p->cpu);
		finding_mend(f, "sysctl kernel.timer_migration=0");
	}
}
