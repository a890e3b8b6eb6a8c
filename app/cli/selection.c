/* SPDX-License-Identifier: MIT */
#include "cli/selection.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/slave_set.h"
#include "cli/hex.h"
#include "cli/source.h"

enum { NUMBER_BYTES = 16 };

static const char all[] = "-";

/* From @low to @high, also downwards. An end that is left open is not checked against the bus. */
struct range {
	uint32_t low;
	uint32_t high;
	int is_open;
};

struct picker {
	const struct cli *cli;
	const struct status_page *page;
	uint32_t slave_count;
	uint16_t alias[LIMIT_SLAVES]; /* 0: none */
	struct selection *selection;
	struct slave_set seen; /* each slave once */
};

/* --- the grammar --- */

static int parse_number(const char *text, size_t len, uint32_t *ret)
{
	char number[NUMBER_BYTES];

	if (len == 0 || len >= sizeof(number)) {
		return -1;
	}
	memcpy(number, text, len);
	number[len] = '\0';
	return hex_number(number, UINT16_MAX, ret);
}

/* The range at @text, up to a comma or the end; @text goes behind it. 0 or -1. */
static int next_range(const char **text, struct range *ret)
{
	const char *comma = strchr(*text, ',');
	size_t len = comma != NULL ? (size_t)(comma - *text) : strlen(*text);
	const char *dash = memchr(*text, '-', len);
	struct range range = { .low = 0, .high = UINT16_MAX };

	if (dash == NULL) {
		if (parse_number(*text, len, &range.low) < 0) {
			return -1;
		}
		range.high = range.low;
	} else {
		size_t low_len = (size_t)(dash - *text);
		size_t high_len = len - low_len - 1;

		if ((low_len > 0 && parse_number(*text, low_len, &range.low) < 0) ||
		    (high_len > 0 && parse_number(dash + 1, high_len, &range.high) < 0)) {
			return -1;
		}
		range.is_open = high_len == 0;
	}
	if (comma != NULL && comma[1] == '\0') {
		return -1;
	}
	*text = comma != NULL ? comma + 1 : *text + len;
	*ret = range;
	return 0;
}

int selection_is_list(const char *text)
{
	struct range range;

	if (text[0] == '\0') {
		return 0;
	}
	while (*text != '\0') {
		if (next_range(&text, &range) < 0) {
			return 0;
		}
	}
	return 1;
}

static int is_all(const char *list)
{
	return list == NULL || strcmp(list, all) == 0;
}

/* --- the slaves --- */

static void pick(struct picker *p, uint32_t pos)
{
	if (!slave_set_has(&p->seen, pos)) {
		slave_set_add(&p->seen, pos);
		p->selection->pos[p->selection->count++] = (uint16_t)pos;
	}
}

static enum exit_code pick_position(struct picker *p, uint32_t pos)
{
	if (pos >= p->slave_count) {
		return cli_fail(p->cli, EXIT_CODE_FAILED,
				"--position: no slave at position %u, there are %u", pos,
				p->slave_count);
	}
	pick(p, pos);
	return EXIT_CODE_OK;
}

static enum exit_code pick_positions(struct picker *p, const char *list)
{
	enum exit_code result = EXIT_CODE_OK;
	struct range range;

	while (*list != '\0' && next_range(&list, &range) == 0 && result == EXIT_CODE_OK) {
		uint32_t last =
			range.is_open && p->slave_count > 0 ? p->slave_count - 1 : range.high;

		if (range.is_open && range.low > last) {
			return pick_position(p, range.low);
		}
		for (uint32_t n = range.low; result == EXIT_CODE_OK;) {
			result = pick_position(p, n);
			if (n == last) {
				break;
			}
			n = last > n ? n + 1 : n - 1;
		}
	}
	return result;
}

/* Those @behind the slave at @pos, which has the alias. */
static unsigned pick_behind(struct picker *p, uint32_t pos, const char *behind)
{
	unsigned found = 0;
	struct range range;

	while (*behind != '\0' && next_range(&behind, &range) == 0) {
		uint32_t low = range.low < range.high ? range.low : range.high;
		uint32_t high = range.low < range.high ? range.high : range.low;

		for (uint32_t n = low; n <= high && pos + n < p->slave_count; n++) {
			pick(p, pos + n);
			found++;
		}
	}
	return found;
}

/* Without positions all up to the next slave with another alias. */
static unsigned pick_alias(struct picker *p, uint32_t alias, const char *positions)
{
	uint32_t last = 0;
	unsigned found = 0;

	for (uint32_t i = 0; i < p->slave_count; i++) {
		uint32_t own = p->alias[i];

		last = own != 0 ? own : last;
		if (is_all(positions) && last == alias) {
			pick(p, i);
			found++;
		} else if (!is_all(positions) && own == alias) {
			found += pick_behind(p, i, positions);
		}
	}
	return found;
}

static enum exit_code pick_aliases(struct picker *p, const char *list, const char *positions)
{
	const char *start = list;
	struct range range;

	while (*list != '\0' && next_range(&list, &range) == 0) {
		uint32_t low = range.low < range.high ? range.low : range.high;
		uint32_t high = range.low < range.high ? range.high : range.low;
		unsigned found = 0;

		for (uint32_t alias = low > 0 ? low : 1; alias <= high; alias++) {
			found += pick_alias(p, alias, positions);
		}
		if (found == 0) {
			return cli_fail(p->cli, EXIT_CODE_FAILED,
					"--alias: %s: no such slave (see ecdaq slaves)", start);
		}
	}
	return EXIT_CODE_OK;
}

static enum exit_code make(struct cli *cli)
{
	struct picker p = { .cli = cli, .selection = cli->selection };
	enum exit_code result;

	if (cli->position != NULL && !selection_is_list(cli->position)) {
		return cli_fail(cli, EXIT_CODE_USAGE,
				"--position: %s: expected numbers and ranges such as 0,2-4",
				cli->position);
	}
	if (cli->alias != NULL && !selection_is_list(cli->alias)) {
		return cli_fail(cli, EXIT_CODE_USAGE,
				"--alias: %s: expected numbers and ranges such as 1001,2000-2009",
				cli->alias);
	}
	result = source_status(cli, &p.page);
	if (result != EXIT_CODE_OK) {
		return result;
	}
	p.slave_count = source_slave_count(p.page);
	for (uint32_t i = 0; i < p.slave_count; i++) {
		p.alias[i] = source_slave(p.page, i).alias;
	}
	result = !is_all(cli->alias)
			 ? pick_aliases(&p, cli->alias, cli->position)
			 : pick_positions(&p, cli->position != NULL ? cli->position : all);
	if (result == EXIT_CODE_OK && cli->selection->count == 0) {
		result = cli_fail(cli, EXIT_CODE_FAILED, "no slave is selected: there is none");
	}
	source_status_close(p.page);
	return result;
}

/* --- the words --- */

static const struct args_option *find_option(const struct args *args, const char *name)
{
	for (size_t i = 0; i < args->option_count; i++) {
		if (strcmp(args->options[i].name, name) == 0) {
			return &args->options[i];
		}
	}
	return NULL;
}

/* What one run of several would do to the others' results. */
static enum exit_code prepare_run(const struct cli *cli, const struct args *args)
{
	const struct selection *sel = cli->selection;
	const struct args_option *output = find_option(args, "output");
	const struct args_option *json = find_option(args, "json");

	if (sel->count < 2) {
		return EXIT_CODE_OK;
	}
	if (output != NULL && *(const char **)output->target != NULL) {
		return cli_fail(cli, EXIT_CODE_USAGE,
				"--output: one slave at a time, %u are selected", sel->count);
	}
	if (json == NULL || *(const int *)json->target == 0) {
		printf("slave %u\n", sel->pos[sel->next]);
	}
	return EXIT_CODE_OK;
}

enum exit_code selection_apply(struct cli *cli, struct args *args)
{
	struct selection *sel = cli->selection;
	int is_list = 0;
	int before = cli_slave_at(cli->verb, &is_list) - 1;
	enum exit_code result = sel->count > 0 ? EXIT_CODE_OK : make(cli);
	unsigned count;
	int used = 0;

	if (result == EXIT_CODE_OK && args->operand_count < before) {
		return cli_fail(cli, EXIT_CODE_USAGE, "missing %s", cli->verb->operands);
	}
	if (result == EXIT_CODE_OK && is_list && args->operand_count > before) {
		return cli_fail(cli, EXIT_CODE_USAGE, "%s: SLAVE excludes --position and --alias",
				args->operands[before]);
	}
	if (result == EXIT_CODE_OK && !is_list) {
		result = prepare_run(cli, args);
	}
	if (result != EXIT_CODE_OK) {
		return result;
	}
	count = is_list ? sel->count : 1;
	selection_done(sel);
	sel->words = calloc((size_t)args->operand_count + count + 1, sizeof(*sel->words));
	sel->name = calloc((size_t)count + 1, sizeof(*sel->name));
	if (sel->words == NULL || sel->name == NULL) {
		return cli_fail(cli, EXIT_CODE_FAILED, "out of memory");
	}
	for (; used < before; used++) {
		sel->words[used] = args->operands[used];
	}
	for (unsigned i = 0; i < count; i++) {
		snprintf(sel->name[i], sizeof(sel->name[i]), "%s%u", SOURCE_POSITION_PREFIX,
			 sel->pos[is_list ? i : sel->next]);
		sel->words[used++] = sel->name[i];
	}
	for (int i = before; i < args->operand_count; i++) {
		sel->words[used++] = args->operands[i];
	}
	sel->next += count;
	args->operands = sel->words;
	args->operand_count = used;
	return EXIT_CODE_OK;
}

int selection_has_more(const struct selection *selection)
{
	return selection->next < selection->count;
}

void selection_done(struct selection *selection)
{
	free(selection->words);
	free(selection->name);
	selection->words = NULL;
	selection->name = NULL;
}
