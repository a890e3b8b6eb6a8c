/* SPDX-License-Identifier: MIT */
/* ecdaq doctor: is this machine fit for the cycle? Tables of checks, each with its remedy. */
#include <errno.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/args.h"
#include "cli/cli.h"
#include "cli/doctor/check.h"
#include "cli/doctor/thread.h"
#include "cli/resolve.h"
#include "cli/source.h"
#include "cli/sync0_source.h"
#include "cli/text.h"
#include "program/json.h"
#include "reader/page.h"

#define CYCLE_THREAD "ecdaqd-cycle"

enum { CHECKS_MAX = 40 };

struct doctor {
	struct cli *cli;
	const char *root;
	const char *nic;
	int is_json;
	int is_strict;
	struct config cfg;
	char config_name[PROBE_PATH_BYTES];
	struct target target;
	const struct check *check[CHECKS_MAX];
	struct finding finding[CHECKS_MAX];
	size_t check_count;
	unsigned count[FINDING_LEVELS];
};

/* A running ecdaqd. One of this machine does not count for a copy of another machine. */
static enum exit_code find_daemon(struct doctor *d)
{
	struct target *t = &d->target;
	int is_copy = d->root[0] != '\0';
	const struct status_page *page;
	int r;

	if (is_copy && d->cli->run_dir == NULL) {
		t->pid = resolve_find_daemon(&t->probe);
		t->page_err = t->pid == 0 ? 0 : -ENOENT;
		return EXIT_CODE_OK;
	}
	t->sync0 = sync0_source_try(d->cli);
	if (t->sync0 != NULL && !page_is_alive(t->sync0->pid)) {
		sync0_source_close(t->sync0);
		t->sync0 = NULL;
	}
	r = source_try_status(d->cli, &page);
	if (r < 0 && r != -ENOENT) {
		t->page_err = r;
		t->pid = resolve_find_daemon(&t->probe);
	} else if (r == 0 && page_is_alive(page->pid)) {
		t->page = page;
		t->pid = page->pid;
	} else if (r == 0) {
		source_status_close(page);
	}
	return EXIT_CODE_OK;
}

/* The file of --config, else the configuration of ecdaqd. */
static enum exit_code load_config(struct doctor *d)
{
	const char *path = d->cli->config;
	char error[512];

	if (path == NULL) {
		resolve_load(&d->target.probe, d->target.pid, &d->cfg, d->config_name);
		return EXIT_CODE_OK;
	}
	config_defaults(&d->cfg);
	if (config_load(path, &d->cfg, error, sizeof(error)) < 0) {
		return cli_fail(d->cli, EXIT_CODE_CONFIG, "--config: %s", error);
	}
	snprintf(d->config_name, sizeof(d->config_name), "%s", path);
	return EXIT_CODE_OK;
}

static void find_cycle(void *ctx, const struct thread *thread)
{
	struct target *t = ctx;

	if (strcmp(thread->name, CYCLE_THREAD) == 0) {
		t->cycle = *thread;
	}
}

/* Is ecdaqd in another network namespace (`build.sh run`) and sees other ports? */
static int has_own_network(const struct doctor *d)
{
	char its[PROBE_TEXT_BYTES];
	char ours[PROBE_TEXT_BYTES];

	return d->root[0] == '\0' &&
	       probe_link(&d->target.probe, its, "/proc/%" PRId64 "/ns/net", d->target.pid) >= 0 &&
	       probe_link(&d->target.probe, ours, "/proc/self/ns/net") >= 0 &&
	       strcmp(its, ours) != 0;
}

/* Take from the status page what the configuration leaves open. */
static void adopt(struct doctor *d, const struct status_page *page)
{
	uint32_t cpu = atomic_load_explicit(&page->cycle_cpu, memory_order_relaxed);

	if (d->cli->config == NULL || d->cfg.interface[0] == '\0') {
		snprintf(d->cfg.interface, sizeof(d->cfg.interface), "%.*s",
			 (int)sizeof(page->interface) - 1, page->interface);
	}
	if (d->target.cpu < 0 && cpu < INT32_MAX) {
		d->target.cpu = (int)cpu;
	}
}

static void prepare(struct doctor *d)
{
	struct target *t = &d->target;

	t->cfg = &d->cfg;
	t->cpu = d->cfg.cycle_cpu;
	if (t->page != NULL) {
		adopt(d, t->page);
	}
	if (t->pid != 0) {
		thread_each(&t->probe, t->pid, find_cycle, t);
		t->is_nic_elsewhere = d->nic == NULL && has_own_network(d);
	}
	t->nic = d->nic != NULL ? d->nic : d->cfg.interface;
}

static void examine(struct doctor *d)
{
	static const struct check *const tables[] = { checks_of_kernel, checks_of_threads,
						      checks_of_nic, checks_of_irqs,
						      checks_of_system };

	for (size_t i = 0; i < sizeof(tables) / sizeof(tables[0]); i++) {
		for (const struct check *c = tables[i]; c->name != NULL; c++) {
			struct finding *f = &d->finding[d->check_count];

			check_run(c, &d->target, f);
			d->check[d->check_count++] = c;
			d->count[f->level]++;
		}
	}
}

static unsigned unread_count(const struct doctor *d)
{
	unsigned count = 0;

	for (size_t i = 0; i < d->check_count; i++) {
		count += d->finding[i].needs_root != 0;
	}
	return count;
}

static void write_text(const struct doctor *d)
{
	char value[FINDING_TEXT_BYTES];
	char remedy[FINDING_TEXT_BYTES];

	printf("port %s, cycle core %d, priority %u; configuration: %s\n",
	       d->target.nic[0] == '\0' ? "none" : d->target.nic, d->target.cpu,
	       d->cfg.cycle_priority, d->config_name);
	for (size_t i = 0; i < d->check_count; i++) {
		const struct finding *f = &d->finding[i];

		text_plain(f->value, value, sizeof(value));
		text_plain(f->remedy, remedy, sizeof(remedy));
		printf("%-4s  %-15s  %s%s%s\n", finding_level_to_str(f->level), d->check[i]->name,
		       value, remedy[0] == '\0' ? "" : "  -> ", remedy);
	}
	printf("%u checks: %u ok, %u warn, %u fail, %u skipped\n", (unsigned)d->check_count,
	       d->count[FINDING_OK], d->count[FINDING_WARN], d->count[FINDING_FAIL],
	       d->count[FINDING_SKIP]);
	if (unread_count(d) > 0) {
		printf("%u could not be read as this user: run ecdaq doctor as root\n",
		       unread_count(d));
	}
}

static void write_json(const struct doctor *d)
{
	struct json js;

	json_init(&js, stdout);
	json_object_begin(&js, NULL);
	json_text(&js, "interface", d->target.nic);
	json_i64(&js, "cycle_cpu", d->target.cpu);
	json_u64(&js, "cycle_priority", d->cfg.cycle_priority);
	json_text(&js, "config", d->config_name);
	json_truth(&js, "running", d->target.pid != 0);
	json_u64(&js, "ok", d->count[FINDING_OK]);
	json_u64(&js, "warn", d->count[FINDING_WARN]);
	json_u64(&js, "fail", d->count[FINDING_FAIL]);
	json_u64(&js, "skip", d->count[FINDING_SKIP]);
	json_array_begin(&js, "check");
	for (size_t i = 0; i < d->check_count; i++) {
		const struct finding *f = &d->finding[i];

		json_object_begin(&js, NULL);
		json_text(&js, "name", d->check[i]->name);
		json_text(&js, "level", finding_level_to_str(f->level));
		json_text(&js, "value", f->value);
		if (f->remedy[0] == '\0') {
			json_null(&js, "remedy");
		} else {
			json_text(&js, "remedy", f->remedy);
		}
		json_truth(&js, "wants_root", f->needs_root);
		json_object_end(&js);
	}
	json_array_end(&js);
	json_object_end(&js);
	json_end_line(&js);
}

/* One line with the names of the checks that decide the exit code. */
static enum exit_code verdict(const struct doctor *d)
{
	enum finding_level least = d->is_strict ? FINDING_WARN : FINDING_FAIL;
	char names[512] = "";
	unsigned count = 0;

	for (size_t i = 0; i < d->check_count; i++) {
		enum finding_level level = d->finding[i].level;
		size_t used = strlen(names);

		if (level == FINDING_FAIL || level == least) {
			snprintf(names + used, sizeof(names) - used, " %s", d->check[i]->name);
			count++;
		}
	}
	if (count == 0) {
		return EXIT_CODE_OK;
	}
	return cli_fail(d->cli, EXIT_CODE_FAILED, "%u check%s to fix:%s", count,
			count == 1 ? "" : "s", names);
}

static enum exit_code run(struct doctor *d)
{
	enum exit_code result;

	d->target.probe.root = d->root;
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
		write_json(d);
	} else {
		write_text(d);
	}
	if (d->target.page != NULL) {
		source_status_close(d->target.page);
	}
	sync0_source_close(d->target.sync0);
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
		{ "interface", 0, args_text, &d->nic, "NIC",
		  "the EtherCAT port, if not as configured" },
		{ "strict", 0, args_flag, &d->is_strict, NULL, "a WARN fails, too" },
		{ "root", 0, args_text, &d->root, "DIR",
		  "check a copy of another machine's files in DIR" },
		{ "json", 0, args_flag, &d->is_json, NULL, "all of it as a JSON object" },
	};
	struct args args = { .options = options, .option_count = 4 };

	if (cli_parse(cli, &args, argc, argv, &result)) {
		result = run(d);
	}
	free(d);
	return result;
}
