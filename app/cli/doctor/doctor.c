/* SPDX-License-Identifier: MIT */
/* ecdaq doctor: is this machine fit for the cycle? A table of checks, each with its mend. */
#include <errno.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "cli/args.h"
#include "cli/doctor/patient.h"
#include "cli/doctor/target.h"
#include "cli/json.h"
#include "cli/source.h"
#include "cli/text.h"

#define CYCLE_THREAD "ecdaqd-cycle"

static const struct {
	const char *name;
	check_fn *check;
} checks[] = {
	{ "machine", check_machine },
	{ "kernel", check_kernel },
	{ "isolation", check_isolation },
	{ "nohz_full", check_nohz_full },
	{ "rcu_nocbs", check_rcu_nocbs },
	{ "rt_throttling", check_rt_throttling },
	{ "timer_migration", check_timer_migration },
	{ "smt", check_smt },
	{ "governor", check_governor },
	{ "idle_states", check_idle_states },
	{ "cycle_thread", check_cycle_thread },
	{ "core_users", check_core_users },
	{ "page_faults", check_page_faults },
	{ "memory_lock", check_memory_lock },
	{ "swap", check_swap },
	{ "huge_pages", check_huge_pages },
	{ "nic", check_nic },
	{ "nic_users", check_nic_users },
	{ "eee", check_eee },
	{ "coalescing", check_coalescing },
	{ "nic_irqs", check_nic_irqs },
	{ "irq_threads", check_irq_threads },
	{ "other_irqs", check_other_irqs },
	{ "clocksource", check_clocksource },
	{ "ntp", check_ntp },
	{ "tai", check_tai },
	{ "watchdog", check_watchdog },
	{ "disk", check_disk },
	{ "inodes", check_inodes },
	{ "power", check_power },
};

enum { CHECK_COUNT = sizeof(checks) / sizeof(checks[0]) };

struct doctor {
	struct cli *cli;
	const char *root;
	const char *nic;
	int is_json;
	int is_strict;
	struct config cfg;
	char config_name[SIGHT_PATH_BYTES];
	struct patient patient;
	struct finding finding[CHECK_COUNT];
	unsigned count[FINDING_LEVELS];
};

/* An ecdaqd that runs; one that has ended is none. One of here has no part in another machine. */
static enum exit_code find_daemon(struct doctor *d)
{
	struct patient *p = &d->patient;
	int is_copy = d->root[0] != '\0';
	const struct status_page *page;
	char path[CONFIG_PATH_BYTES];
	enum exit_code result;

	if (is_copy && d->cli->run_dir == NULL) {
		p->pid = target_find_daemon(&p->sight);
		p->page_err = p->pid == 0 ? 0 : -ENOENT;
		return EXIT_CODE_OK;
	}
	result = cli_path(d->cli, CONFIG_RUN_STATUS, path);
	if (result != EXIT_CODE_OK) {
		return result;
	}
	page = status_open(path, STATUS_MAGIC, sizeof(*page));
	if (page == NULL && errno != ENOENT) {
		p->page_err = -errno;
		p->pid = target_find_daemon(&p->sight);
	} else if (page != NULL && source_is_alive(page->pid)) {
		p->page = page;
		p->pid = page->pid;
	} else if (page != NULL) {
		source_status_close(page);
	}
	return EXIT_CODE_OK;
}

/* What --config names, else that of ecdaqd itself. */
static enum exit_code load_config(struct doctor *d)
{
	const char *path = d->cli->config;
	char error[512];

	if (path == NULL) {
		target_load(&d->patient.sight, d->patient.pid, &d->cfg, d->config_name);
		return EXIT_CODE_OK;
	}
	config_defaults(&d->cfg);
	if (config_load(path, &d->cfg, error, sizeof(error)) < 0) {
		return cli_fail(d->cli, EXIT_CODE_USAGE, "--config: %s", error);
	}
	snprintf(d->config_name, sizeof(d->config_name), "%s", path);
	return EXIT_CODE_OK;
}

static void keep_cycle(void *ctx, const struct thread *thread)
{
	struct patient *p = ctx;

	if (strcmp(thread->name, CYCLE_THREAD) == 0) {
		p->cycle = *thread;
	}
}

/* Does ecdaqd see other ports than this program (`build.sh run` gives it a network of its own)? */
static int has_own_network(const struct doctor *d)
{
	char its[SIGHT_TEXT_BYTES];
	char ours[SIGHT_TEXT_BYTES];

	return d->root[0] == '\0' &&
	       sight_link(&d->patient.sight, its, "/proc/%" PRId64 "/ns/net", d->patient.pid) >=
		       0 &&
	       sight_link(&d->patient.sight, ours, "/proc/self/ns/net") >= 0 &&
	       strcmp(its, ours) != 0;
}

/* What the configuration leaves open, the status page tells. */
static void adopt(struct doctor *d, const struct status_page *page)
{
	uint32_t cpu = atomic_load_explicit(&page->cycle_cpu, memory_order_relaxed);

	if (d->cli->config == NULL || d->cfg.interface[0] == '\0') {
		snprintf(d->cfg.interface, sizeof(d->cfg.interface), "%.*s",
			 (int)sizeof(page->interface) - 1, page->interface);
	}
	if (d->patient.cpu < 0 && cpu < INT32_MAX) {
		d->patient.cpu = (int)cpu;
	}
}

static void prepare(struct doctor *d)
{
	struct patient *p = &d->patient;

	p->cfg = &d->cfg;
	p->cpu = d->cfg.cycle_cpu;
	if (p->page != NULL) {
		adopt(d, p->page);
	}
	if (p->pid != 0) {
		thread_each(&p->sight, p->pid, keep_cycle, p);
		p->is_nic_elsewhere = d->nic == NULL && has_own_network(d);
	}
	p->nic = d->nic != NULL ? d->nic : d->cfg.interface;
}

static void examine(struct doctor *d)
{
	for (size_t i = 0; i < CHECK_COUNT; i++) {
		checks[i].check(&d->patient, &d->finding[i]);
		d->count[d->finding[i].level]++;
	}
}

static int wants_root(const struct doctor *d)
{
	int count = 0;

	for (size_t i = 0; i < CHECK_COUNT; i++) {
		count += d->finding[i].wants_root;
	}
	return count;
}

static void say_text(const struct doctor *d)
{
	char value[FINDING_TEXT_BYTES];
	char mend[FINDING_TEXT_BYTES];

	printf("port %s, cycle core %d, priority %u; configuration: %s\n",
	       d->patient.nic[0] == '\0' ? "none" : d->patient.nic, d->patient.cpu,
	       d->cfg.cycle_priority, d->config_name);
	for (size_t i = 0; i < CHECK_COUNT; i++) {
		const struct finding *f = &d->finding[i];

		text_plain(f->value, value, sizeof(value));
		text_plain(f->mend, mend, sizeof(mend));
		printf("%-4s  %-15s  %s%s%s\n", finding_level_to_str(f->level), checks[i].name,
		       value, mend[0] == '\0' ? "" : "  -> ", mend);
	}
	printf("%u checks: %u ok, %u warn, %u fail, %u skipped\n", (unsigned)CHECK_COUNT,
	       d->count[FINDING_OK], d->count[FINDING_WARN], d->count[FINDING_FAIL],
	       d->count[FINDING_SKIP]);
	if (wants_root(d) > 0) {
		printf("%d could not be made as this user: run ecdaq doctor as root\n",
		       wants_root(d));
	}
}

static void say_json(const struct doctor *d)
{
	struct json js;

	json_init(&js, stdout);
	json_object_begin(&js, NULL);
	json_text(&js, "interface", d->patient.nic);
	json_i64(&js, "cycle_cpu", d->patient.cpu);
	json_u64(&js, "cycle_priority", d->cfg.cycle_priority);
	json_text(&js, "config", d->config_name);
	json_truth(&js, "running", d->patient.pid != 0);
	json_u64(&js, "ok", d->count[FINDING_OK]);
	json_u64(&js, "warn", d->count[FINDING_WARN]);
	json_u64(&js, "fail", d->count[FINDING_FAIL]);
	json_u64(&js, "skip", d->count[FINDING_SKIP]);
	json_array_begin(&js, "check");
	for (size_t i = 0; i < CHECK_COUNT; i++) {
		const struct finding *f = &d->finding[i];

		json_object_begin(&js, NULL);
		json_text(&js, "name", checks[i].name);
		json_text(&js, "level", finding_level_to_str(f->level));
		json_text(&js, "value", f->value);
		if (f->mend[0] == '\0') {
			json_null(&js, "mend");
		} else {
			json_text(&js, "mend", f->mend);
		}
		json_truth(&js, "wants_root", f->wants_root);
		json_object_end(&js);
	}
	json_array_end(&js);
	json_object_end(&js);
	json_end_line(&js);
}

/* The names of the checks that make the exit code, in one line. */
static enum exit_code verdict(const struct doctor *d)
{
	enum finding_level least = d->is_strict ? FINDING_WARN : FINDING_FAIL;
	char names[512] = "";
	unsigned count = 0;

	for (size_t i = 0; i < CHECK_COUNT; i++) {
		enum finding_level level = d->finding[i].level;
		size_t used = strlen(names);

		if (level == FINDING_FAIL || level == least) {
			snprintf(names + used, sizeof(names) - used, " %s", checks[i].name);
			count++;
		}
	}
	if (count == 0) {
		return EXIT_CODE_OK;
	}
	return cli_fail(d->cli, EXIT_CODE_FAILED, "%u check%s to mend:%s", count,
			count == 1 ? "" : "s", names);
}

static enum exit_code run(struct doctor *d)
{
	enum exit_code result;

	d->patient.sight.root = d->root;
	if (d->root[0] != '\0' && access(d->root, X_OK) < 0) {
		return cli_fail(d->cli, EXIT_CODE_USAGE, "--root: %s cannot be entered", d->root);
	}
	result = find_daemon(d);
	if (result == EXIT_CODE_OK) {
		result = load_config(d);
	}
	if (result != EXIT_CODE_OK) {
		return result;
	}
	prepare(d);
	examine(d);
	if (d->is_json) {
		say_json(d);
	} else {
		say_text(d);
	}
	if (d->patient.page != NULL) {
		source_status_close(d->patient.page);
	}
	return verdict(d);
}

enum exit_code verb_doctor(struct cli *cli, int argc, char **argv)
{
	struct doctor *d = calloc(1, sizeof(*d));
	enum exit_code result;

	if (d == NULL) {
		return cli_fail(cli, EXIT_CODE_FAILED, "out of memory");
	}
	*d = (struct doctor){ .cli = cli, .root = "" };

	const struct args_option options[] = {
		{ "interface", 0, ARGS_TEXT, &d->nic, "NIC",
		  "the EtherCAT port, if not as configured" },
		{ "strict", 0, ARGS_FLAG, &d->is_strict, NULL, "a WARN fails, too" },
		{ "root", 0, ARGS_TEXT, &d->root, "DIR",
		  "judge the copy of another machine's files in DIR" },
		{ "json", 0, ARGS_FLAG, &d->is_json, NULL, "all of it as a JSON object" },
	};
	struct args args = { .options = options, .option_count = 4 };

	if (args_parse(cli, &args, argc, argv, &result) == ARGS_GO) {
		result = run(d);
	}
	free(d);
	return result;
}
