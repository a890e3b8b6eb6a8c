/* SPDX-License-Identifier: MIT */
/* Inside of the sink: what its two halves share (sink.c: states and time; sink_file.c: the file).
 */
#ifndef RECORD_SINK_INTERNAL_H
#define RECORD_SINK_INTERNAL_H

#include "base/clock.h"
#include "record/sink.h"

#define SINK_RETRY_NS NS_PER_S

struct sink {
	struct recorder_options opt;
	struct store *store;
	struct store_state resume; /* where to resume if recording stopped now */
	enum sink_state state;
	int has_rewind;
	struct record_file *file;    /* NULL between files */
	const struct layout *layout; /* NULL between sessions */
	struct timemap_state timemap;
	int64_t now_ns; /* of the newest tick */
	int64_t file_opened_ns;
	int64_t chunk_opened_ns; /* 0: the chunk is empty */
	int64_t synced_ns;
	int64_t checked_ns; /* last check of free space and errors */
	int is_dirty;       /* written since the last sync */
	uint64_t synced_cycle;
	uint64_t events_lost; /* in this session, by this process */
	uint64_t files;
	uint64_t bytes_done; /* in finished files */
	uint64_t bytes_free;
	int64_t last_utc_ns;     /* of the newest sample */
	struct event full_event; /* the disk was full: written to the next file */
	int64_t full_utc_ns;
	char path[512]; /* of the newest file */
	char message[256];
};

/** A line for people, also kept as the newest message. */
__attribute__((format(printf, 2, 3))) void sink_say(struct sink *s, const char *format, ...);
/** Something failed with @error: leave the ready state. Returns @error. */
int sink_trouble(struct sink *s, int error, const char *what);
int sink_ask_free_bytes(struct sink *s);
/** The newest cycle recorded; 0 before the first. */
uint64_t sink_last_cycle(const struct sink *s);

/** Close, sync, finish the open file. 0, or -errno after sink_trouble(). */
int sink_close_chunk(struct sink *s);
int sink_sync_file(struct sink *s);
int sink_finish_file(struct sink *s, const char *reason);
int sink_is_rotation_due(const struct sink *s);

#endif
