/* SPDX-License-Identifier: MIT */
/* Files of the store: written once, for the owner only. Context: blocking. */
#ifndef KEYSTORE_FILES_H
#define KEYSTORE_FILES_H

#include <stddef.h>

enum { FILES_PATH_BYTES = 512, FILES_TEXT_BYTES = 65536 };

/** @dir/@name. 0 or -ENAMETOOLONG with @error (KEYSTORE_ERROR_BYTES). */
int files_path(const char *dir, const char *name, char *ret_path, char *error);
/** A folder of mode 0700. 0 or -errno with @error; -EEXIST when it is there. */
int files_make_dir(const char *path, char *error);
/** A new file of mode 0600 with @bytes of @data, on the disk. 0 or -errno with @error. */
int files_write(const char *dir, const char *name, const void *data, size_t bytes, char *error);
/** The whole of a small file. 0 or -errno with @error. Free *@ret_data. */
int files_read(const char *dir, const char *name, char **ret_data, size_t *ret_bytes, char *error);

/** Put a line into @error; returns @code. */
int files_fail(char *error, int code, const char *format, ...)
	__attribute__((format(printf, 3, 4)));

#endif
