/* SPDX-License-Identifier: MIT */
/* Files of the key store: created once, accessible to the owner only. Context: blocking. */
#ifndef KEYSTORE_FILES_H
#define KEYSTORE_FILES_H

#include <stddef.h>

enum { FILES_PATH_BYTES = 512, FILES_TEXT_BYTES = 65536 };

/** @dir/@name. 0 or -ENAMETOOLONG with @error (KEYSTORE_ERROR_BYTES). */
int files_path(const char *dir, const char *name, char *ret_path, char *error);
/** Create a directory of mode 0700. 0 or -errno with @error; -EEXIST if it exists. */
int files_make_dir(const char *path, char *error);
/** Create a file of mode 0600 with @bytes of @data and sync it. 0 or -errno with @error. */
int files_write(const char *dir, const char *name, const void *data, size_t bytes, char *error);
/** Read a whole small file. 0 or -errno with @error. Free *@ret_data. */
int files_read(const char *dir, const char *name, char **ret_data, size_t *ret_bytes, char *error);

/** Write a line to @error; returns @code. */
int files_fail(char *error, int code, const char *format, ...)
	__attribute__((format(printf, 3, 4)));

#endif
