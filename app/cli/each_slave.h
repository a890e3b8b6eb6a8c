/* SPDX-License-Identifier: MIT */
/* A verb for several slaves: those that its words name, or all. */
#ifndef CLI_EACH_SLAVE_H
#define CLI_EACH_SLAVE_H

#include <stdint.h>

#include "cli/cli.h"
#include "cli/source.h"

/**
 * Call @run for each slave that @names name (name or position), without any for all of @page. A
 * failure, which run() has reported, keeps no other slave from it, unless it is that of ecdaqd.
 * Returns the first one.
 */
enum exit_code each_slave(struct cli *cli, const struct status_page *page, char *const *names,
			  int name_count, enum exit_code (*run)(void *ctx, uint16_t pos),
			  void *ctx);

#endif
