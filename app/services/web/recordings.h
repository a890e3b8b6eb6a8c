/* SPDX-License-Identifier: MIT */
/*
 * The recorder's folder as a list for viewers. What the files say of themselves is read a few at a
 * time and kept; the bytes of a recording are read by nobody here. Context: one thread; blocking
 * for some small reads.
 */
#ifndef WEB_RECORDINGS_H
#define WEB_RECORDINGS_H

#include <stdint.h>

struct recordings;

enum { RECORDINGS_LISTED = 500 }; /* the newest; older ones are counted */

/** The list of @dir (kept). 0, -ENOMEM. Free with recordings_destroy(). */
int recordings_create(const char *dir, struct recordings **ret_recordings);
void recordings_destroy(struct recordings *r);

/** Read what is new, at most so often; @now_ns is CLOCK_MONOTONIC. */
void recordings_poll(struct recordings *r, int64_t now_ns);
/** The list as a text for pages (op "recordings"), kept until the next poll; NULL: none yet. */
const char *recordings_text(const struct recordings *r);
/** Counts up with each text that differs from the one before. */
uint64_t recordings_number(const struct recordings *r);

/**
 * Open the recording @name of @dir for reading: a regular file of that folder with a name of
 * store_is_name(), no link. The file descriptor; -ENOENT: there is none; or -errno.
 */
int recordings_open(const char *dir, const char *name, uint64_t *ret_bytes);

#endif
