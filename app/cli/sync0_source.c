/* SPDX-License-Identifier: MIT */
#include "cli/sync0_source.h"

#include <errno.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "reader/page.h"

static int read_page(struct cli *cli, const struct sync0_status **ret_page)
{
	struct sync0_status *page = malloc(sizeof(*page));
	char path[CONFIG_PATH_BYTES];
	int r = page == NULL ? -ENOMEM
		: cli_path(cli, CONFIG_RUN_SYNC0_STATUS, path) != EXIT_CODE_OK
			? -ENAMETOOLONG
			: page_read_sync0(path, page);

	if (r < 0) {
		free(page);
		return r;
	}
	*ret_page = page;
	return 0;
}

enum exit_code sync0_source_open(struct cli *cli, const struct sync0_status **ret_page)
{
	char path[CONFIG_PATH_BYTES];
	enum exit_code result = cli_path(cli, CONFIG_RUN_SYNC0_STATUS, path);
	int r;

	if (result != EXIT_CODE_OK) {
		return result;
	}
	r = read_page(cli, ret_page);
	if (r == 0) {
		return EXIT_CODE_OK;
	}
	if (r == -ENOENT || r == -ENOTDIR) {
		return cli_fail(cli, EXIT_CODE_NO_DAEMON,
				"%s is not there: is ecdaq-sync0 running?", path);
	}
	return cli_fail(cli, cli_exit_of(-r), "%s: %s", path,
			r == -EPROTO ? "is of another version of ecdaq, or damaged" : strerror(-r));
}

const struct sync0_status *sync0_source_try(struct cli *cli)
{
	const struct sync0_status *page;

	return read_page(cli, &page) == 0 ? page : NULL;
}

void sync0_source_close(const struct sync0_status *page)
{
	free((void *)(uintptr_t)page);
}

uint32_t sync0_source_lines(const struct sync0_status *page)
{
	return atomic_load_explicit(&page->line_count, memory_order_relaxed);
}
