/* SPDX-License-Identifier: MIT */
/* ecdaq state, ecdaq rescan */
#include <stdio.h>
#include <string.h>
#include <strings.h>

#include "base/args.h"
#include "base/clock.h"
#include "cli/admin_client.h"
#include "cli/cli.h"
#include "cli/hints.h"
#include "cli/report.h"
#include "cli/screen.h"
#include "cli/source.h"
#include "program/args_duration.h"
#include "program/json.h"
#include "reader/page.h"
#include "wire/al.h"

#define GET(field) atomic_load_explicit(&(field), memory_order_relaxed)

struct wish {
	struct cli *cli;
	const struct status_page *page;
	int is_json;
	int64_t wait_ns; /* for the bus to reach its target; 0: show it as it is */
	int state;       /* enum al_state; 0: only show */
};

static int state_of(const char *word)
{
	static const struct {
		const char *word;
		int state;
	} words[] = { { "INIT", AL_INIT }, { "PREOP", AL_PREOP },   { "PRE-OP", AL_PREOP },
		      { "BOOT", AL_BOOT }, { "SAFEOP", AL_SAFEOP }, { "SAFE-OP", AL_SAFEOP },
		      { "OP", AL_OP } };

	for (size_t i = 0; i < sizeof(words) / sizeof(words[0]); i++) {
		if (strcasecmp(word, words[i].word) == 0) {
			return words[i].state;
		}
	}
	return 0;
}

static void slave_state(const struct status_page *page, uint32_t index, char *buf, size_t buf_len)
{
	if (GET(page->slave[index].is_lost)) {
		snprintf(buf, buf_len, "LOST");
	} else {
		al_status_format(GET(page->slave[index].al_state), buf, buf_len);
	}
}

static void show_text(const struct status_page *page)
{
	char state[24];

	printf("bus %s, target %s%s\n", bus_state_to_str(GET(page->bus_state)),
	       bus_state_to_str(GET(page->bus_target)), GET(page->is_waiting) ? ", waiting" : "");
	if (page->message[0] != '\0') {
		printf("message    %s\n", page->message);
	}
	for (uint32_t i = 0; i < source_slave_count(page); i++) {
		uint32_t code = GET(page->slave[i].al_status_code);

		slave_state(page, i, state, sizeof(state));
		printf("%3u %-16s %s\n", i, source_slave(page, i).name, state);
		if (code != 0) {
			printf("    AL status code 0x%04x: %s\n", code,
			       al_status_code_to_str((uint16_t)code));
		}
	}
	hints_write(page, screen_columns(), stdout);
}

static void show_json(const struct status_page *page)
{
	struct json js;
	char state[24];

	json_init(&js, stdout);
	json_object_begin(&js, NULL);
	json_text(&js, "state", bus_state_to_str(GET(page->bus_state)));
	json_text(&js, "target", bus_state_to_str(GET(page->bus_target)));
	json_truth(&js, "waiting", GET(page->is_waiting) != 0);
	json_text(&js, "message", page->message);
	json_array_begin(&js, "slave");
	for (uint32_t i = 0; i < source_slave_count(page); i++) {
		uint32_t code = GET(page->slave[i].al_status_code);

		slave_state(page, i, state, sizeof(state));
		json_object_begin(&js, NULL);
		json_u64(&js, "position", i);
		json_text(&js, "name", source_slave(page, i).name);
		json_text(&js, "state", state);
		json_u64(&js, "al_status_code", code);
		json_text(&js, "al_status", al_status_code_to_str((uint16_t)code));
		json_object_end(&js);
	}
	json_array_end(&js);
	json_object_end(&js);
	json_end_line(&js);
}

/* Down is no target: ecdaqd has not begun. */
static int is_at_target(struct cli *cli)
{
	const struct status_page *page;
	int is_there;

	if (source_try_status(cli, &page) < 0) {
		return 0;
	}
	is_there = page_is_alive(page->pid) && GET(page->bus_target) != BUS_DOWN &&
		   GET(page->bus_state) == GET(page->bus_target);
	source_status_close(page);
	return is_there;
}

/* ecdaqd may be starting, or be in its next try. */
static int wait_for_target(const struct wish *wish)
{
	const int64_t step_ns = 50 * NS_PER_MS;
	int64_t waited_ns = 0;

	screen_catch_signals();
	while (!is_at_target(wish->cli)) {
		if (waited_ns >= wish->wait_ns || screen_is_over()) {
			return 0;
		}
		screen_wait(step_ns);
		waited_ns += step_ns;
	}
	return 1;
}

static enum exit_code show(const struct wish *wish)
{
	const struct status_page *page;
	enum exit_code result = source_status(wish->cli, &page); /* as it is by now */

	if (result != EXIT_CODE_OK) {
		return result;
	}
	if (wish->is_json) {
		show_json(page);
	} else {
		show_text(page);
	}
	source_status_close(page);
	return EXIT_CODE_OK;
}

static enum exit_code request(const struct wish *wish, uint16_t slave_pos)
{
	struct admin_request rq = { .verb = ADMIN_STATE,
				    .slave_pos = slave_pos,
				    .argument = { (uint32_t)wish->state } };
	struct admin_reply reply;

	return admin_do(wish->cli, &rq, &reply);
}

static enum exit_code request_one(const struct wish *wish, const char *name)
{
	uint16_t pos[LIMIT_SLAVES] = { ADMIN_ALL_SLAVES };
	enum exit_code result = EXIT_CODE_OK;
	unsigned count = 1;

	if (strcmp(name, "all") != 0) {
		result = source_find_slaves(wish->cli, wish->page, name, pos, &count);
	}
	for (unsigned i = 0; i < count && result == EXIT_CODE_OK; i++) {
		result = request(wish, pos[i]);
	}
	return result;
}

/* In the order given, a group in that of the bus; the first refusal ends it. */
static enum exit_code request_each(const struct wish *wish, char **names, int count)
{
	enum exit_code result = EXIT_CODE_OK;

	for (int i = 0; i < count && result == EXIT_CODE_OK; i++) {
		result = request_one(wish, names[i]);
	}
	return result;
}

static enum exit_code run(struct wish *wish, const struct args *args)
{
	enum exit_code result;

	if (args->operand_count == 0) {
		int is_late = wish->wait_ns > 0 && !wait_for_target(wish);

		result = show(wish);
		return is_late && result == EXIT_CODE_OK ? EXIT_CODE_STATE : result;
	}
	if (wish->wait_ns > 0) {
		return cli_fail(wish->cli, EXIT_CODE_USAGE,
				"--wait is for showing; a request of a state waits by itself");
	}
	wish->state = state_of(args->operands[0]);
	if (wish->state == 0) {
		return cli_fail(wish->cli, EXIT_CODE_USAGE,
				"%s: expected INIT, PREOP, BOOT, SAFEOP or OP", args->operands[0]);
	}
	if (args->operand_count == 1) {
		result = request(wish, ADMIN_ALL_SLAVES);
	} else {
		result = source_status(wish->cli, &wish->page);
		if (result != EXIT_CODE_OK) {
			return result;
		}
		result = request_each(wish, args->operands + 1, args->operand_count - 1);
		source_status_close(wish->page);
	}
	return result == EXIT_CODE_OK && wish->is_json ? show(wish) : result;
}

enum exit_code verb_state(struct cli *cli, int argc, char **argv)
{
	struct wish wish = { .cli = cli };
	const struct args_option options[] = {
		{ "wait", 0, args_duration, &wish.wait_ns, "T",
		  "first wait up to T until the bus is in its target state" },
		{ "json", 0, args_flag, &wish.is_json, NULL, "the states as a JSON object" },
	};
	struct args args = { .options = options, .option_count = 2, .operands_max = 4096 };
	enum exit_code result;

	if (!cli_parse(cli, &args, argc, argv, &result)) {
		return result;
	}
	return run(&wish, &args);
}

enum exit_code verb_rescan(struct cli *cli, int argc, char **argv)
{
	struct wish wish = { .cli = cli };
	int is_forced = 0;
	const struct args_option options[] = {
		{ "force", 0, args_flag, &is_forced, NULL,
		  "also while the bus is in operation: it is stopped" },
		{ "json", 0, args_flag, &wish.is_json, NULL, "the states as a JSON object" },
	};
	struct args args = { .options = options, .option_count = 2 };
	struct admin_request rq = { .verb = ADMIN_RESCAN };
	struct admin_reply reply;
	enum exit_code result;

	if (!cli_parse(cli, &args, argc, argv, &result)) {
		return result;
	}
	rq.argument[1] = (uint32_t)is_forced;
	result = admin_do(cli, &rq, &reply);
	return result == EXIT_CODE_OK && wish.is_json ? show(&wish) : result;
}
