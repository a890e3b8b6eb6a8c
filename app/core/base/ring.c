/* SPDX-License-Identifier: MIT */
#include "ring.h"

#include <assert.h>
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include "pages.h"

#define RING_MAGIC UINT64_C(0x31676e6972716463) /* "cdqring1" */
#define PAGE_BYTES 4096u
#define WORD_BYTES sizeof(uint64_t)

enum ring_state { RING_STATE_OPEN = 1, RING_STATE_CLOSED = 2 };

struct ring_header {
	uint64_t magic;
	uint32_t version;
	uint32_t payload_bytes;
	uint64_t slot_bytes; /* sequence word and payload, a multiple of 8 */
	uint64_t slot_count; /* a power of two */
	uint64_t meta_offset;
	uint64_t meta_bytes;
	uint64_t slots_offset;
	uint64_t total_bytes;
	uint64_t period_ns;
	char kind[8];
	int64_t producer_pid;
	uint64_t reserved[4];
	_Alignas(64) _Atomic uint64_t head; /* [producer] sequence of the next slot to fill */
	_Atomic uint32_t state;             /* [producer] enum ring_state */
};

static_assert(sizeof(struct ring_header) <= PAGE_BYTES, "the meta area starts on the second page");

struct ring {
	struct ring_header *header;
	_Atomic uint64_t *slots;
	uint64_t slot_words;
	uint64_t mask;
	uint64_t head;
	size_t map_bytes;
};

struct ring_reader {
	const struct ring_header *header;
	const _Atomic uint64_t *slots;
	uint64_t slot_words;
	uint64_t slot_count;
	uint64_t cursor;
	size_t map_bytes;
	char *path;
	dev_t dev;
	ino_t ino;
};

static uint64_t round_up(uint64_t n, uint64_t unit)
{
	return (n + unit - 1) / unit * unit;
}

static uint64_t power_of_two(uint64_t n)
{
	uint64_t p = 1;

	while (p < n) {
		p *= 2;
	}
	return p;
}

static void fill_header(struct ring_header *h, const struct ring_spec *spec)
{
	h->magic = RING_MAGIC;
	h->version = RING_VERSION;
	h->payload_bytes = spec->payload_bytes;
	h->slot_bytes = WORD_BYTES + round_up(spec->payload_bytes, WORD_BYTES);
	h->slot_count = power_of_two(spec->slot_count < 2 ? 2 : spec->slot_count);
	h->meta_offset = PAGE_BYTES;
	h->meta_bytes = spec->meta_bytes;
	h->slots_offset = h->meta_offset + round_up(spec->meta_bytes, PAGE_BYTES);
	h->total_bytes = round_up(h->slots_offset + h->slot_bytes * h->slot_count, PAGE_BYTES);
	h->period_ns = spec->period_ns;
	h->producer_pid = getpid();
	snprintf(h->kind, sizeof(h->kind), "%s", spec->kind);
}

static int map_new_file(const char *path, unsigned mode, uint64_t bytes, void **ret_map)
{
	int fd = open(path, O_RDWR | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
	void *map;
	int r;

	if (fd < 0) {
		return -errno;
	}
	/* Not ftruncate: a full tmpfs must fail here and not by SIGBUS in the cycle. */
	r = fchmod(fd, mode) < 0 ? errno : posix_fallocate(fd, 0, (off_t)bytes);
	if (r != 0) {
		close(fd);
		unlink(path);
		return -r;
	}
	map = mmap(NULL, bytes, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_POPULATE, fd, 0);
	r = errno;
	close(fd);
	if (map == MAP_FAILED) {
		unlink(path);
		return -r;
	}
	*ret_map = map;
	return 0;
}

int ring_create(const struct ring_spec *spec, struct ring **ret_ring)
{
	struct ring_header header = { .magic = 0 };
	struct ring *ring;
	char temporary[4096];
	void *map = NULL;
	int r;

	if (snprintf(temporary, sizeof(temporary), "%s.new", spec->path) >=
	    (int)sizeof(temporary)) {
		return -ENAMETOOLONG;
	}
	fill_header(&header, spec);
	ring = calloc(1, sizeof(*ring));
	if (ring == NULL) {
		return -ENOMEM;
	}
	r = map_new_file(temporary, spec->file_mode, header.total_bytes, &map);
	if (r < 0) {
		free(ring);
		return r;
	}
	assert(map != NULL);
	pages_touch(map, header.total_bytes);
	memcpy(map, &header, sizeof(header));
	if (spec->meta_bytes > 0) {
		memcpy((char *)map + header.meta_offset, spec->meta, spec->meta_bytes);
	}
	ring->header = map;
	ring->slots = (_Atomic uint64_t *)(void *)((char *)map + header.slots_offset);
	ring->slot_words = header.slot_bytes / WORD_BYTES;
	ring->mask = header.slot_count - 1;
	ring->map_bytes = header.total_bytes;
	atomic_store_explicit(&ring->header->state, RING_STATE_OPEN, memory_order_release);
	if (rename(temporary, spec->path) < 0) {
		r = -errno;
		unlink(temporary);
		ring_destroy(ring);
		return r;
	}
	*ret_ring = ring;
	return 0;
}

void ring_close(struct ring *ring)
{
	atomic_store_explicit(&ring->header->state, RING_STATE_CLOSED, memory_order_release);
}

void ring_destroy(struct ring *ring)
{
	if (ring == NULL) {
		return;
	}
	ring_close(ring);
	munmap(ring->header, ring->map_bytes);
	free(ring);
}

/* Bytes to words: the last word of @bytes may be part of the next piece: a cursor in bytes. */
struct word_writer {
	_Atomic uint64_t *word;
	uint64_t pending;
	unsigned pending_bytes;
};

static void write_bytes(struct word_writer *w, const uint8_t *p, size_t n)
{
	if (w->pending_bytes == 0) {
		for (; n >= WORD_BYTES; n -= WORD_BYTES, p += WORD_BYTES) {
			uint64_t v;

			memcpy(&v, p, sizeof(v));
			atomic_store_explicit(w->word++, v, memory_order_relaxed);
		}
	}
	for (; n > 0; n--, p++) {
		w->pending |= (uint64_t)*p << (8 * w->pending_bytes);
		if (++w->pending_bytes == WORD_BYTES) {
			atomic_store_explicit(w->word++, w->pending, memory_order_relaxed);
			w->pending = 0;
			w->pending_bytes = 0;
		}
	}
}

void ring_push(struct ring *ring, const void *head, size_t head_bytes, const void *body,
	       size_t body_bytes)
{
	uint64_t sequence = ring->head;
	_Atomic uint64_t *slot = ring->slots + (sequence & ring->mask) * ring->slot_words;
	struct word_writer w = { .word = slot + 1, .pending = 0, .pending_bytes = 0 };
	const _Atomic uint64_t *end = slot + ring->slot_words;

	assert(head_bytes + body_bytes <= ring->header->payload_bytes);
	/* Odd: being written. Even, 2 * sequence + 2: holds that sequence. */
	atomic_store_explicit(slot, 2 * sequence + 1, memory_order_relaxed);
	atomic_thread_fence(memory_order_release);
	write_bytes(&w, head, head_bytes);
	write_bytes(&w, body, body_bytes);
	if (w.pending_bytes > 0) {
		atomic_store_explicit(w.word++, w.pending, memory_order_relaxed);
	}
	while (w.word < end) {
		atomic_store_explicit(w.word++, 0, memory_order_relaxed);
	}
	atomic_store_explicit(slot, 2 * sequence + 2, memory_order_release);
	ring->head = sequence + 1;
	atomic_store_explicit(&ring->header->head, ring->head, memory_order_release);
}

uint64_t ring_pushed(const struct ring *ring)
{
	return ring->head;
}

static int header_is_sane(const struct ring_header *h, uint64_t file_bytes)
{
	return h->magic == RING_MAGIC && h->version == RING_VERSION &&
	       h->total_bytes == file_bytes && h->slot_count >= 2 &&
	       (h->slot_count & (h->slot_count - 1)) == 0 &&
	       h->slot_bytes >= WORD_BYTES + h->payload_bytes && h->slot_bytes % WORD_BYTES == 0 &&
	       h->meta_offset == PAGE_BYTES && h->slots_offset <= file_bytes &&
	       h->meta_bytes <= h->slots_offset - h->meta_offset &&
	       h->slots_offset % PAGE_BYTES == 0 && h->slot_bytes <= file_bytes &&
	       h->slot_count <= file_bytes &&
	       h->slot_count <= (file_bytes - h->slots_offset) / h->slot_bytes &&
	       memchr(h->kind, 0, sizeof(h->kind)) != NULL;
}

static int map_for_reading(int fd, struct ring_reader *reader)
{
	struct stat st;
	void *map;

	if (fstat(fd, &st) < 0) {
		return -errno;
	}
	if (st.st_size < (off_t)PAGE_BYTES) {
		return -EPROTO;
	}
	map = mmap(NULL, (size_t)st.st_size, PROT_READ, MAP_SHARED, fd, 0);
	if (map == MAP_FAILED) {
		return -errno;
	}
	if (!header_is_sane(map, (uint64_t)st.st_size)) {
		munmap(map, (size_t)st.st_size);
		return -EPROTO;
	}
	reader->header = map;
	reader->map_bytes = (size_t)st.st_size;
	reader->slots = (const _Atomic uint64_t *)(const void *)((const char *)map +
								 reader->header->slots_offset);
	reader->slot_words = reader->header->slot_bytes / WORD_BYTES;
	reader->slot_count = reader->header->slot_count;
	reader->dev = st.st_dev;
	reader->ino = st.st_ino;
	return 0;
}

int ring_reader_open(const char *path, struct ring_reader **ret_reader)
{
	struct ring_reader *reader = calloc(1, sizeof(*reader));
	int fd;
	int r;

	if (reader == NULL) {
		return -ENOMEM;
	}
	reader->path = strdup(path);
	fd = reader->path == NULL ? -1 : open(path, O_RDONLY | O_CLOEXEC);
	if (fd < 0) {
		r = -errno;
		ring_reader_destroy(reader);
		return r;
	}
	r = map_for_reading(fd, reader);
	close(fd);
	if (r < 0) {
		ring_reader_destroy(reader);
		return r;
	}
	reader->cursor = ring_newest(reader);
	*ret_reader = reader;
	return 0;
}

void ring_reader_destroy(struct ring_reader *reader)
{
	if (reader == NULL) {
		return;
	}
	if (reader->header != NULL) {
		/* munmap takes a plain pointer; nothing is written through it. */
		munmap((void *)(uintptr_t)reader->header, reader->map_bytes);
	}
	free(reader->path);
	free(reader);
}

static int copy_slot(const struct ring_reader *reader, uint64_t sequence, void *payload)
{
	const _Atomic uint64_t *slot =
		reader->slots + (sequence & (reader->slot_count - 1)) * reader->slot_words;
	uint8_t *out = payload;
	size_t left = reader->header->payload_bytes;

	if (atomic_load_explicit(slot, memory_order_acquire) != 2 * sequence + 2) {
		return 0;
	}
	for (uint64_t i = 1; left > 0; i++) {
		uint64_t v = atomic_load_explicit(slot + i, memory_order_relaxed);
		size_t n = left < WORD_BYTES ? left : WORD_BYTES;

		memcpy(out, &v, n);
		out += n;
		left -= n;
	}
	atomic_thread_fence(memory_order_acquire);
	return atomic_load_explicit(slot, memory_order_relaxed) == 2 * sequence + 2;
}

enum ring_result ring_read(struct ring_reader *reader, void *payload, uint64_t *ret_lost)
{
	uint64_t oldest;

	/* The state is read before the head: what was pushed before the close is never missed. */
	uint32_t state = atomic_load_explicit(&reader->header->state, memory_order_acquire);

	if (reader->cursor >= ring_newest(reader)) {
		return state == RING_STATE_CLOSED ? RING_CLOSED : RING_EMPTY;
	}
	if (copy_slot(reader, reader->cursor, payload)) {
		reader->cursor++;
		return RING_OK;
	}
	oldest = ring_oldest(reader);
	*ret_lost = oldest > reader->cursor ? oldest - reader->cursor : 1;
	reader->cursor += *ret_lost;
	return RING_LOST;
}

enum ring_result ring_peek_newest(struct ring_reader *reader, void *payload)
{
	for (;;) {
		uint64_t newest = ring_newest(reader);

		if (newest == 0) {
			return RING_EMPTY;
		}
		if (copy_slot(reader, newest - 1, payload)) {
			return RING_OK;
		}
	}
}

uint64_t ring_cursor(const struct ring_reader *reader)
{
	return reader->cursor;
}

void ring_seek(struct ring_reader *reader, uint64_t sequence)
{
	reader->cursor = sequence;
}

uint64_t ring_oldest(const struct ring_reader *reader)
{
	uint64_t newest = ring_newest(reader);
	/* The producer is about to overwrite the oldest slots: keep clear of them by a 16th. */
	uint64_t safe = reader->slot_count - reader->slot_count / 16 - 1;

	return newest > safe ? newest - safe : 0;
}

uint64_t ring_newest(const struct ring_reader *reader)
{
	return atomic_load_explicit(&reader->header->head, memory_order_acquire);
}

int ring_is_replaced(const struct ring_reader *reader)
{
	struct stat st;

	return stat(reader->path, &st) < 0 || st.st_dev != reader->dev || st.st_ino != reader->ino;
}

int ring_is_orphaned(const struct ring_reader *reader)
{
	return atomic_load_explicit(&reader->header->state, memory_order_acquire) ==
		       RING_STATE_OPEN &&
	       kill((pid_t)reader->header->producer_pid, 0) < 0 && errno == ESRCH;
}

const void *ring_meta(const struct ring_reader *reader, size_t *ret_bytes)
{
	*ret_bytes = reader->header->meta_bytes;
	return (const char *)reader->header + reader->header->meta_offset;
}

const char *ring_kind(const struct ring_reader *reader)
{
	return reader->header->kind;
}

uint32_t ring_payload_bytes(const struct ring_reader *reader)
{
	return reader->header->payload_bytes;
}

uint64_t ring_slot_count(const struct ring_reader *reader)
{
	return reader->slot_count;
}

uint64_t ring_period_ns(const struct ring_reader *reader)
{
	return reader->header->period_ns;
}
