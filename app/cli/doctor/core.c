/* SPDX-License-Identifier: MIT */
/* The cycle's core itself: its sibling, its frequency, how deep it may sleep. */
#include <errno.h>
#include <inttypes.h>
#include <string.h>

#include "base/cpu_list.h"
#include "base/event.h"
#include "cli/doctor/patient.h"

#define CPU_DIR "/sys/devices/system/cpu"

/* Waking from a state that takes less than this is no cause of a late cycle. */
#define IDLE_TOLERABLE_US 10

enum { CORES_MAX = 1024, IDLE_STATES_MAX = 16 };

void check_smt(const struct patient *p, struct finding *f)
{
	char siblings[SIGHT_TEXT_BYTES];
	int r;

	if (!patient_has_core(p, f)) {
		return;
	}
	r = sight_text(&p->sight, siblings, CPU_DIR "/cpu%d/topology/thread_siblings_list", p->cpu);
	if (r < 0) {
		finding_unread(f, "topology/thread_siblings_list", r);
		return;
	}
	for (int cpu = 0; cpu < CORES_MAX; cpu++) {
		if (cpu != p->cpu && cpu_list_has(siblings, cpu)) {
			finding_set(f, FINDING_WARN, "core %d shares its hardware with core %d",
				    p->cpu, cpu);
			finding_mend(f, "echo 0 > " CPU_DIR "/cpu%d/online, or nosmt", cpu);
			return;
		}
	}
	finding_set(f, FINDING_OK, "core %d is a whole one", p->cpu);
}

void check_governor(const struct patient *p, struct finding *f)
{
	int cpu = p->cpu < 0 ? 0 : p->cpu;
	char governor[SIGHT_TEXT_BYTES];
	int64_t min_khz = 0;
	int64_t max_khz = -1;
	int r = sight_text(&p->sight, governor, CPU_DIR "/cpu%d/cpufreq/scaling_governor", cpu);

	if (r == -ENOENT) {
		finding_set(f, FINDING_OK, "Linux does not change the frequency of core %d", cpu);
		return;
	}
	if (r < 0) {
		finding_unread(f, "cpufreq/scaling_governor", r);
		return;
	}
	sight_number(&p->sight, &min_khz, CPU_DIR "/cpu%d/cpufreq/scaling_min_freq", cpu);
	sight_number(&p->sight, &max_khz, CPU_DIR "/cpu%d/cpufreq/scaling_max_freq", cpu);
	if (strcmp(governor, "performance") == 0 || min_khz == max_khz) {
		finding_set(f, FINDING_OK, "%.60s on core %d", governor, cpu);
		return;
	}
	finding_set(f, FINDING_WARN, "%.60s: core %d slows down and takes time to speed up",
		    governor, cpu);
	finding_mend(f, "echo performance > " CPU_DIR "/cpu%d/cpufreq/scaling_governor", cpu);
}

struct idle {
	char name[SIGHT_TEXT_BYTES];
	int64_t latency_us;
};

/* The state within @limit_us that takes longest to wake from. 0, or -errno without any state. */
static int deepest(const struct patient *p, int cpu, int64_t limit_us, struct idle *ret)
{
	struct idle idle = { .latency_us = -1 };
	int found = -ENOENT;

	for (int i = 0; i < IDLE_STATES_MAX; i++) {
		int64_t latency_us;
		int64_t is_disabled = 0;
		int r = sight_number(&p->sight, &latency_us,
				     CPU_DIR "/cpu%d/cpuidle/state%d/latency", cpu, i);

		if (r < 0) {
			found = found == 0 || r == -ENOENT ? found : r;
			break;
		}
		found = 0;
		sight_number(&p->sight, &is_disabled, CPU_DIR "/cpu%d/cpuidle/state%d/disable", cpu,
			     i);
		if (is_disabled == 0 && latency_us <= limit_us && latency_us > idle.latency_us) {
			snprintf(idle.name, sizeof(idle.name), "state %d", i);
			sight_text(&p->sight, idle.name, CPU_DIR "/cpu%d/cpuidle/state%d/name", cpu,
				   i);
			idle.latency_us = latency_us;
		}
	}
	if (found == 0) {
		*ret = idle;
	}
	return found;
}

/* What /dev/cpu_dma_latency says: the least that anybody holds it at. */
static int read_limit(const struct patient *p, int64_t *ret_us)
{
	FILE *file = sight_open(&p->sight, "/dev/cpu_dma_latency");
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

/* ecdaqd holds its own limit while it runs, and says so if it was refused. */
static int64_t daemon_limit(const struct patient *p)
{
	int wants = p->cfg->cycle_cpu_dma_latency_us >= 0;
	uint32_t degraded =
		p->page == NULL ? 0
				: atomic_load_explicit(&p->page->rt_degraded, memory_order_relaxed);

	return wants && (degraded >> EVENT_RT_DMA_LATENCY & 1) == 0
		       ? p->cfg->cycle_cpu_dma_latency_us
		       : INT32_MAX;
}

void check_idle_states(const struct patient *p, struct finding *f)
{
	int cpu = p->cpu < 0 ? 0 : p->cpu;
	int64_t limit_us = 0;
	int64_t daemon_us = daemon_limit(p);
	const char *when = "";
	struct idle idle;
	int r;

	/* Without an ecdaqd the limit of now says nothing of when it runs. */
	if (read_limit(p, &limit_us) < 0 || (p->pid == 0 && daemon_us < limit_us)) {
		limit_us = daemon_us;
		when = p->pid == 0 && daemon_us < INT32_MAX ? ", while ecdaqd runs" : "";
	}
	r = deepest(p, cpu, limit_us, &idle);
	if (r == -ENOENT) {
		finding_set(f, FINDING_OK, "Linux does not put core %d into idle states", cpu);
	} else if (r < 0) {
		finding_unread(f, "cpuidle", r);
	} else if (idle.latency_us < 0) {
		finding_set(f, FINDING_OK, "none within %" PRId64 " us to wake: held off%s",
			    limit_us, when);
	} else if (idle.latency_us <= IDLE_TOLERABLE_US) {
		finding_set(f, FINDING_OK, "at most %.60s: %" PRId64 " us to wake%s", idle.name,
			    idle.latency_us, when);
	} else {
		finding_set(f, FINDING_WARN, "core %d may sleep in %.60s: %" PRId64 " us to wake",
			    cpu, idle.name, idle.latency_us);
		finding_mend(f, "cycle.cpu_dma_latency: 0us, and let ecdaqd write to "
				"/dev/cpu_dma_latency");
	}
}
