/* SPDX-License-Identifier: MIT */
/*
 * A ring in shared memory: one producer, any number of readers. Readers read its file and keep
 * their own cursor, so none of them, however slow, dead or hostile, can disturb the producer. The
 * producer never waits; a reader that falls a whole ring behind learns exactly how many slots it
 * missed. The producer maps the file, writes a slot word by word with relaxed atomics, the slot's
 * sequence last, and then moves the head; readers copy slots with pread() between two reads of the
 * head. They map nothing and copy the header once, so that a file that is truncated or overwritten
 * under them is an error (RING_DAMAGED) and no more (ADR 42). The file belongs on a tmpfs: a disk's
 * write-back would fault the producer's pages.
 *
 * The header carries the slot size, the depth, and a meta area that describes the payload
 * (for samples: base/sample.h), so that a reader needs nothing but the path.
 */
#ifndef BASE_RING_H
#define BASE_RING_H

#include <stddef.h>
#include <stdint.h>

#define RING_VERSION 1u

struct ring;        /* the producer's end */
struct ring_reader; /* one reader's end */

struct ring_spec {
	const char *path;       /* file on a tmpfs; replaced if it is there */
	const char *kind;       /* "sample", "event", "sync0": 7 characters at most */
	uint32_t payload_bytes; /* per slot */
	uint64_t slot_count;    /* rounded up to a power of two */
	const void *meta;
	size_t meta_bytes;
	uint64_t period_ns; /* time between two pushes; 0: none */
	unsigned file_mode; /* 0640 */
};

/**
 * Make the ring at a new file and rename it into place. 0, or -errno (ret_ring untouched).
 * All pages are touched. Free with ring_destroy(). Context: blocking.
 */
int ring_create(const struct ring_spec *spec, struct ring **ret_ring);

/** Mark the end of the ring: readers get nothing more. Context: any. */
void ring_close(struct ring *ring);

/** Close and unmap; the file stays for readers until the next ring_create(). NULL is fine. */
void ring_destroy(struct ring *ring);

/** Push @head then @body, together payload_bytes at most; the rest of the slot is zero. RT-safe. */
void ring_push(struct ring *ring, const void *head, size_t head_bytes, const void *body,
	       size_t body_bytes);

/** Number of slots pushed so far. RT-safe. */
uint64_t ring_pushed(const struct ring *ring);

enum ring_result {
	RING_OK,    /* a slot was copied, the cursor is one further */
	RING_EMPTY, /* nothing new yet */
	RING_LOST,  /* the cursor was overrun: *ret_lost slots are lost, the cursor is at the oldest
		       safe one */
	RING_CLOSED,  /* nothing new, and nothing will follow */
	RING_DAMAGED, /* truncated or overwritten by someone: nothing more can be read of it */
};

/**
 * Open the ring at @path for reading; the cursor is set after the newest slot. 0, or -errno:
 * -ENOENT no ring, -EPROTO not a ring, -EPROTONOSUPPORT one of another RING_VERSION. Free with
 * ring_reader_destroy().
 * Context of all below: one thread at a time for each reader; they never wait.
 */
int ring_reader_open(const char *path, struct ring_reader **ret_reader);
void ring_reader_destroy(struct ring_reader *reader);

/** Copy the slot at the cursor to @payload: @payload_bytes of it, or all if that is less. */
enum ring_result ring_read(struct ring_reader *reader, void *payload, size_t payload_bytes,
			   uint64_t *ret_lost);
/** Copy the newest slot without moving the cursor. RING_OK, RING_EMPTY (none), RING_DAMAGED. */
enum ring_result ring_peek_newest(struct ring_reader *reader, void *payload, size_t payload_bytes);

/** The sequence number of the slot that ring_read() takes next. */
uint64_t ring_cursor(const struct ring_reader *reader);
void ring_seek(struct ring_reader *reader, uint64_t sequence);
/** The oldest slot that can still be read with some margin, and one past the newest. */
uint64_t ring_oldest(struct ring_reader *reader);
uint64_t ring_newest(struct ring_reader *reader);

/** 1 if the ring is no longer the file at its path: removed, or another one took its place. */
int ring_is_replaced(const struct ring_reader *reader);
/** 1 if the producer's process ended without closing the ring. */
int ring_is_orphaned(struct ring_reader *reader);

/** The reader's own copy of what was checked when it opened the ring. */
const void *ring_meta(const struct ring_reader *reader, size_t *ret_bytes);
const char *ring_kind(const struct ring_reader *reader);
uint32_t ring_payload_bytes(const struct ring_reader *reader);
uint64_t ring_slot_count(const struct ring_reader *reader);

#endif
