/* SPDX-License-Identifier: MIT */
/* A verb for several slaves: those that its words name, or all. */
#ifndef CLI_EACH_SLAVE_H
#define CLI_EACH_SLAVE_H

#include <stdint.h>

#include "cli/cli.h"
#include "cli/source.h"
#include "program/json.h"

/**
 * Call @run for each slave that @names name (name, position or @group), without any for all of
 * @page. A failure, which run() has reported, keeps no other slave from it, unless it is that of
 * ecdaqd. Returns the first one.
 */
enum exit_code each_slave(struct cli *cli, const struct status_page *page, char *const *names,
			  int name_count, enum exit_code (*run)(void *ctx, uint16_t pos),
			  void *ctx);

/** The same for the operands of @args. With @js, which run() adds to, as one array on a line of
 * standard output; NULL: run() prints text. */
enum exit_code each_slave_listed(struct cli *cli, const struct status_page *page,
				 const struct args *args, struct json *js,
				 enum exit_code (*run)(void *ctx, uint16_t pos), void *ctx);

#endif
