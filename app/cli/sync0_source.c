/* SPDX-License-Identifier: MIT */
#include "cli/sync0_source.h"

#include <errno.h>
#include <string.h>

#include "base/status.h"

static int are_texts_closed(const struct sync0_status *page)
{
	for (size_t i = 0; i < LIMIT_SLAVES; i++) {
		const struct sync0_line_status *ls = &page->line[i];

		if (memchr(ls->slave, 0, sizeof(ls->slave)) == NULL ||
		    memchr(ls->line, 0, sizeof(ls->line)) == NULL) {
			return 0;
		}
	}
	return 1;
}

static const struct sync0_status *open_page(const char *path)
{
	const struct sync0_status *page = status_open(path, SYNC0_STATUS_MAGIC, sizeof(*page));

	if (page != NULL && !are_texts_closed(page)) {
		sync0_source_close(page);
		errno = EPROTO;
		return NULL;
	}
	return page;
}

enum exit_code sync0_source_open(struct cli *cli, const struct sync0_status **ret_page)
{
	char path[CONFIG_PATH_BYTES];
	enum exit_code result = cli_path(cli, CONFIG_RUN_SYNC0_STATUS, path);

	if (result != EXIT_CODE_OK) {
		return result;
	}
	*ret_page = open_page(path);
	if (*ret_page != NULL) {
		return EXIT_CODE_OK;
	}
	if (errno == ENOENT || errno == ENOTDIR) {
		return cli_fail(cli, EXIT_CODE_NO_DAEMON,
				"%s is not there: is ecdaq-sync0 running?", path);
	}
	return cli_fail(cli, cli_exit_of(errno), "%s: %s", path,
			errno == EPROTO ? "is of another version of ecdaq, or damaged"
					: strerror(errno));
}

const struct sync0_status *sync0_source_try(struct cli *cli)
{
	char path[CONFIG_PATH_BYTES];

	return cli_path(cli, CONFIG_RUN_SYNC0_STATUS, path) == EXIT_CODE_OK ? open_page(path)
									    : NULL;
}

void sync0_source_close(const struct sync0_status *page)
{
	status_unmap(page, sizeof(*page));
}

uint32_t sync0_source_lines(const struct sync0_status *page)
{
	uint32_t count = atomic_load_explicit(&page->line_count, memory_order_relaxed);

	return count < LIMIT_SLAVES ? count : LIMIT_SLAVES;
}
