/* SPDX-License-Identifier: MIT */
/*
 * The machine as the doctor sees it: files below a root ("" is this machine), and what needs a
 * system call. Below another root a call is answered by a file, ROOT/calls/NAME (NAME.PORT
 * for a call of a port): so a copy of another machine, or one that a test made up, is judged by the
 * same checks. All of it returns 0 (or a length) or -errno: -ENOENT is "this kernel does not have
 * it", -EACCES "not for this user". Outputs are untouched on failure. Context: blocking.
 */
#ifndef CLI_PROBE_H
#define CLI_PROBE_H

#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

enum { PROBE_TEXT_BYTES = 256, PROBE_PATH_BYTES = 512 };

struct probe {
	const char *root; /* "": this machine */
};

/** The first PROBE_TEXT_BYTES - 1 bytes of a file, without blanks at the end. The length. */
int probe_text(const struct probe *p, char ret_text[PROBE_TEXT_BYTES], const char *format, ...)
	__attribute__((format(printf, 3, 4)));
/** A file that holds one number; -EBADMSG when it holds something else. */
int probe_number(const struct probe *p, int64_t *ret, const char *format, ...)
	__attribute__((format(printf, 3, 4)));
/** The last part of what a symbolic link points at. */
int probe_link(const struct probe *p, char ret_text[PROBE_TEXT_BYTES], const char *format, ...)
	__attribute__((format(printf, 3, 4)));
int probe_exists(const struct probe *p, const char *format, ...)
	__attribute__((format(printf, 2, 3)));
/** For reading line by line or in binary; NULL with errno. */
FILE *probe_open(const struct probe *p, const char *format, ...)
	__attribute__((format(printf, 2, 3)));
/** The path itself. 0 or -ENAMETOOLONG. */
int probe_path(const struct probe *p, char ret_path[PROBE_PATH_BYTES], const char *format, ...)
	__attribute__((format(printf, 3, 4)));

/** Calls @each for every entry of a directory but those with a leading dot. */
int probe_each(const struct probe *p, const char *dir, void (*each)(void *ctx, const char *name),
	       void *ctx);

/**
 * What needs a system call, a line "KEY VALUE" a figure; -EOPNOTSUPP: the port cannot.
 *
 *   eee         enabled active                        energy-efficient Ethernet of port @object
 *   coalesce    rx_us rx_frames adaptive              of port @object; adaptive: the driver moves
 * rx_us addresses   (IP addresses of port @object, separated by blanks) clock       synchronised
 * error_us tai_offset_s utc_s    error_us: the kernel's bound of its error; utc_s: since 1970 disk
 * bytes_total bytes_free inodes_total inodes_free read_only memory of the file system that @object
 * is on; free: for who is not root; memory: tmpfs throttled   flags of a Raspberry Pi's firmware
 * (tag 0x00030046)
 *
 * The length of the text.
 */
int probe_call(const struct probe *p, const char *name, const char *object,
	       char ret_text[PROBE_TEXT_BYTES]);
/** The figure @key of such a text; -EBADMSG when it is missing or no number. */
int probe_figure(const char *text, const char *key, int64_t *ret);
/** A number, decimal or with 0x, and nothing else. 0 or -EBADMSG. */
int probe_parse(const char *text, int64_t *ret);

#endif
