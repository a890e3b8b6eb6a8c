/* SPDX-License-Identifier: MIT */
/* An ENI file as a configuration of ecdaq. Failures are reported (cli_fail). Context: blocking. */
#ifndef CLI_ENI_IMPORT_H
#define CLI_ENI_IMPORT_H

#include <stddef.h>

#include "cli/cli.h"
#include "eni/eni.h"

/**
 * YAML of @eni, read from @path; free() it. What it cannot carry over is a comment in it and a line
 * "FILE:LINE: ..." on standard error.
 */
enum exit_code eni_import(struct cli *cli, const char *path, const struct eni *eni, char **ret_text,
			  size_t *ret_len);

#endif
