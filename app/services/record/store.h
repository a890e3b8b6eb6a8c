/* SPDX-License-Identifier: MIT */
/*
 * The directory of recordings: ecdaq-<UTC>-<session>-<sequence>.mcap, .part while being written.
 * The sequence counts up over all sessions, so it orders the files even where the clock was wrong.
 * One recorder at a time (lock file). The state file says where recording resumes; an
 * unfinished file knows better. Context: blocking.
 */
#ifndef RECORD_STORE_H
#define RECORD_STORE_H

#include <stddef.h>
#include <stdint.h>

struct store;

enum { STORE_NAME_BYTES = 80 };

struct store_entry {
	char name[STORE_NAME_BYTES];
	uint64_t sequence;
	uint64_t bytes;
	int is_part;
	int is_pinned;    /* by store_list_all(): NAME.keep is beside it */
	int is_kept_back; /* record/space.c: not uploaded yet */
};

/* Where to resume, and what was recorded of that session. All zero: nothing was recorded yet. */
struct store_state {
	uint64_t session;
	uint64_t next_cycle;
	uint64_t first_cycle;
	uint64_t cycles; /* samples recorded */
	uint64_t gaps;
	uint64_t missing; /* cycles in the gaps */
	uint64_t event_next;
	int64_t event_mono_ns; /* of the event before that */
	uint64_t sequence;     /* of the newest file */
	uint64_t sync0_next;   /* the same of the rings of ecdaq-sync0: results and alarms */
	int64_t sync0_mono_ns;
	uint64_t sync0_event_next;
	int64_t sync0_event_mono_ns;
};

/**
 * Make @dir if it is not there, and lock it. 0; -EBUSY: another recorder has it (*@ret_pid, 0
 * unknown); -errno. Free with store_close().
 */
int store_open(const char *dir, struct store **ret_store, int64_t *ret_pid);
/** The same with one line in @error where it fails. */
int store_open_or_tell(const char *dir, struct store **ret_store, char *error, size_t error_bytes);
void store_close(struct store *s);
/** 1 if a recorder works in @dir now. */
int store_is_locked(const char *dir);
const char *store_dir(const struct store *s);

/** Recordings in @dir in order of their sequence; free() *@ret_entries. 0 or -errno. */
int store_list(const char *dir, struct store_entry **ret_entries, size_t *ret_count);
/** The same with damaged ones, and who is pinned. */
int store_list_all(const char *dir, struct store_entry **ret_entries, size_t *ret_count);

/** "DIR/NAME" into @buf. 0, -ENAMETOOLONG. */
int store_path(const char *dir, const char *name, char *buf, size_t buf_len);
/** A name without suffix. */
void store_make_name(char buf[STORE_NAME_BYTES], int64_t utc_ns, uint64_t session,
		     uint64_t sequence);
/** 1 if @name is one of ours, and then its sequence and whether it is a .part. */
int store_parse_name(const char *name, uint64_t *ret_sequence, int *ret_is_part);
/** 1 if @name is one that a file of store_list_all() can have; never a path. */
int store_is_name(const char *name);
/** 1 if a file with this name can be of @session. */
int store_name_is_of(const char *name, uint64_t session);
/** Unix time at which the file with this name was begun, s; 0: its name does not have it. */
int64_t store_name_utc_s(const char *name);

/** 0, -ENOENT, -EBADMSG (ret untouched on failure). */
int store_load_state(const struct store *s, struct store_state *ret_state);
int store_save_state(const struct store *s, const struct store_state *state);

#endif
