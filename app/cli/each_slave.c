/* SPDX-License-Identifier: MIT */
#include "cli/each_slave.h"

static int is_same_for_all(enum exit_code result)
{
	return result == EXIT_CODE_NO_DAEMON || result == EXIT_CODE_PERMISSION;
}

/* The first failure is kept. */
static enum exit_code run_each(const uint16_t *pos, unsigned count,
			       enum exit_code (*run)(void *ctx, uint16_t pos), void *ctx)
{
	enum exit_code first = EXIT_CODE_OK;

	for (unsigned i = 0; i < count && !is_same_for_all(first); i++) {
		enum exit_code result = run(ctx, pos[i]);

		first = first == EXIT_CODE_OK || is_same_for_all(result) ? result : first;
	}
	return first;
}

enum exit_code each_slave(struct cli *cli, const struct status_page *page, char *const *names,
			  int name_count, enum exit_code (*run)(void *ctx, uint16_t pos), void *ctx)
{
	uint16_t pos[LIMIT_SLAVES];
	enum exit_code first = EXIT_CODE_OK;

	if (name_count == 0) {
		unsigned count = source_slave_count(page);

		for (unsigned i = 0; i < count; i++) {
			pos[i] = (uint16_t)i;
		}
		return run_each(pos, count, run, ctx);
	}
	for (int i = 0; i < name_count; i++) {
		unsigned count = 0;
		enum exit_code result = source_find_slaves(cli, page, names[i], pos, &count);

		if (result == EXIT_CODE_OK) {
			result = run_each(pos, count, run, ctx);
		}
		first = first == EXIT_CODE_OK ? result : first;
		if (is_same_for_all(result)) {
			break;
		}
	}
	return first;
}

enum exit_code each_slave_listed(struct cli *cli, const struct status_page *page,
				 const struct args *args, struct json *js,
				 enum exit_code (*run)(void *ctx, uint16_t pos), void *ctx)
{
	enum exit_code result;

	if (js == NULL) {
		return each_slave(cli, page, args->operands, args->operand_count, run, ctx);
	}
	json_init(js, stdout);
	json_array_begin(js, NULL);
	result = each_slave(cli, page, args->operands, args->operand_count, run, ctx);
	json_array_end(js);
	json_end_line(js);
	return result;
}
