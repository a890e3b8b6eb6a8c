/* SPDX-License-Identifier: MIT */
#include "cli/each_slave.h"

enum exit_code each_slave(struct cli *cli, const struct status_page *page, char *const *names,
			  int name_count, enum exit_code (*run)(void *ctx, uint16_t pos), void *ctx)
{
	uint32_t count = name_count == 0 ? source_slave_count(page) : (uint32_t)name_count;
	enum exit_code first = EXIT_CODE_OK;

	for (uint32_t i = 0; i < count; i++) {
		uint16_t pos = (uint16_t)i;
		enum exit_code result = name_count == 0
						? EXIT_CODE_OK
						: source_find_slave(cli, page, names[i], &pos);

		if (result == EXIT_CODE_OK) {
			result = run(ctx, pos);
		}
		first = first == EXIT_CODE_OK ? result : first;
		if (result == EXIT_CODE_NO_DAEMON || result == EXIT_CODE_PERMISSION) {
			break; /* the same for all */
		}
	}
	return first;
}
