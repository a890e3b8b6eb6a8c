/* SPDX-License-Identifier: MIT */
/*
 * The machine as the doctor sees it: files below a root ("" is this machine), and what only a
 * system call tells. Below another root a call is answered by a file, ROOT/calls/NAME, with a line
 * "KEY VALUE" a figure: so a copy of another machine, or one that a test made up, is judged by the
 * same checks. All of it returns 0 (or a length) or -errno: -ENOENT is "this kernel does not have
 * it", -EACCES "not for this user". Outputs are untouched on failure. Context: blocking.
 */
#ifndef CLI_DOCTOR_SIGHT_H
#define CLI_DOCTOR_SIGHT_H

#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

enum { SIGHT_TEXT_BYTES = 256, SIGHT_PATH_BYTES = 512 };

struct sight {
	const char *root; /* "": this machine */
};

/** The first SIGHT_TEXT_BYTES - 1 bytes of a file, without blanks at the end. The length. */
int sight_text(const struct sight *s, char ret_text[SIGHT_TEXT_BYTES], const char *format, ...)
	__attribute__((format(printf, 3, 4)));
/** A file that holds one number; -EBADMSG when it holds something else. */
int sight_number(const struct sight *s, int64_t *ret, const char *format, ...)
	__attribute__((format(printf, 3, 4)));
/** The last part of what a symbolic link points at. */
int sight_link(const struct sight *s, char ret_text[SIGHT_TEXT_BYTES], const char *format, ...)
	__attribute__((format(printf, 3, 4)));
int sight_exists(const struct sight *s, const char *format, ...)
	__attribute__((format(printf, 2, 3)));
/** For reading line by line or in binary; NULL with errno. */
FILE *sight_open(const struct sight *s, const char *format, ...)
	__attribute__((format(printf, 2, 3)));
/** The path itself. 0 or -ENAMETOOLONG. */
int sight_path(const struct sight *s, char ret_path[SIGHT_PATH_BYTES], const char *format, ...)
	__attribute__((format(printf, 3, 4)));

/** Calls @each for every entry of a directory but those with a leading dot. */
int sight_each(const struct sight *s, const char *dir, void (*each)(void *ctx, const char *name),
	       void *ctx);

/* --- what takes a call --- */

struct sight_eee {
	int64_t is_enabled;
	int64_t is_active; /* negotiated with the other end */
};

struct sight_coalesce {
	int64_t rx_us;
	int64_t rx_frames;
	int64_t is_adaptive; /* the driver moves rx_us as it likes */
};

struct sight_clock {
	int64_t is_synchronised;
	int64_t error_us; /* the kernel's bound of its error */
	int64_t tai_offset_s;
};

struct sight_disk {
	int64_t bytes_total;
	int64_t bytes_free; /* for who is not root */
	int64_t inodes_total;
	int64_t inodes_free;
	int64_t is_read_only;
	int64_t is_memory; /* tmpfs or ramfs */
};

/** File eee.NIC; -EOPNOTSUPP: the port cannot. */
int sight_eee(const struct sight *s, const char *nic, struct sight_eee *ret);
/** File coalesce.NIC; -EOPNOTSUPP: the port cannot. */
int sight_coalesce(const struct sight *s, const char *nic, struct sight_coalesce *ret);
/** IP addresses of @nic, "192.168.0.2 fe80::1"; file addresses.NIC. The number of them. */
int sight_addresses(const struct sight *s, const char *nic, char ret_text[SIGHT_TEXT_BYTES]);
/** File clock. */
int sight_clock(const struct sight *s, struct sight_clock *ret);
/** Of the file system that @dir is on; file disk. @dir itself is looked up on this machine only. */
int sight_disk(const struct sight *s, const char *dir, struct sight_disk *ret);
/** Throttling flags of a Raspberry Pi's firmware (mailbox tag 0x00030046); file throttled. */
int sight_throttled(const struct sight *s, int64_t *ret);

#endif
