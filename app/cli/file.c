/* SPDX-License-Identifier: MIT */
#include "cli/file.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static enum exit_code fail(const struct cli *cli, const char *path, int err)
{
	if (err == EEXIST) {
		return cli_fail(cli, EXIT_CODE_FAILED, "%s: exists: --force replaces it", path);
	}
	return cli_fail(cli,
			err == EACCES || err == EPERM ? EXIT_CODE_PERMISSION : EXIT_CODE_FAILED,
			"%s: %s", path, strerror(err));
}

enum exit_code file_read(const struct cli *cli, const char *path, size_t limit, uint8_t **ret_data,
			 size_t *ret_len)
{
	FILE *in = fopen(path, "re");
	uint8_t *data = in != NULL ? malloc(limit + 1) : NULL;
	size_t len = data != NULL ? fread(data, 1, limit + 1, in) : 0;
	int err = data == NULL || ferror(in) ? errno : 0;

	if (in != NULL) {
		fclose(in);
	}
	if (err == 0 && len > 0 && len <= limit) {
		*ret_data = data;
		*ret_len = len;
		return EXIT_CODE_OK;
	}
	free(data);
	return err != 0 ? fail(cli, path, err)
			: cli_fail(cli, EXIT_CODE_FAILED, "%s: expected 1 to %zu bytes", path,
				   limit);
}

static enum exit_code write_whole(const struct cli *cli, const char *path, const char *mode,
				  const uint8_t *data, size_t len)
{
	FILE *out = fopen(path, mode);
	int is_whole = out != NULL && fwrite(data, 1, len, out) == len;
	int err = is_whole ? 0 : errno;

	if (out != NULL && fclose(out) != 0 && err == 0) {
		err = errno;
	}
	return err == 0 ? EXIT_CODE_OK : fail(cli, path, err);
}

enum exit_code file_write(const struct cli *cli, const char *path, const uint8_t *data, size_t len)
{
	return write_whole(cli, path, "we", data, len);
}

enum exit_code file_write_new(const struct cli *cli, const char *path, const uint8_t *data,
			      size_t len)
{
	return write_whole(cli, path, "wxe", data, len);
}
