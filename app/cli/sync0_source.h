/* SPDX-License-Identifier: MIT */
/* A copy of the status page of ecdaq-sync0. */
#ifndef CLI_SYNC0_SOURCE_H
#define CLI_SYNC0_SOURCE_H

#include "base/sync0.h"
#include "cli/cli.h"

/** EXIT_CODE_OK, or the code of a failure that was reported. */
enum exit_code sync0_source_open(struct cli *cli, const struct sync0_status **ret_page);
/** The same without a word: NULL if there is none. */
const struct sync0_status *sync0_source_try(struct cli *cli);
void sync0_source_close(const struct sync0_status *page);
/** How many lines it has; never more than there is room for. */
uint32_t sync0_source_lines(const struct sync0_status *page);

#endif
