/* SPDX-License-Identifier: MIT */
/* Whole files in memory. Failures are reported (cli_fail). Context: blocking. */
#ifndef CLI_FILE_H
#define CLI_FILE_H

#include <stddef.h>
#include <stdint.h>

#include "cli/cli.h"

/** Read @path, 1 to @limit bytes. @ret_data is freed by the caller. */
enum exit_code file_read(const struct cli *cli, const char *path, size_t limit, uint8_t **ret_data,
			 size_t *ret_len);
/** Write @path, replacing what it has. */
enum exit_code file_write(const struct cli *cli, const char *path, const uint8_t *data, size_t len);
/** Write @path, which must not exist. */
enum exit_code file_write_new(const struct cli *cli, const char *path, const uint8_t *data,
			      size_t len);

#endif
