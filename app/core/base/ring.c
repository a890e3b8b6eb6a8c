/* SPDX-License-Identifier: MIT */
#include "ring.h"

#include <assert.h>
#include <errno.h>
#include <signal.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include "bytes.h"
#include "foreign.h"
#include "new_file.h"

#define RING_MAGIC UINT64_C(0x31676e6972716463) /* "cdqring1" */
#define PAGE_BYTES 4096u
#define WORD_BYTES sizeof(uint64_t)
/* Far above what any ring of ecdaq has; a reader allocates no more than these. */
#define PAYLOAD_LIMIT (UINT32_C(1) << 16)
#define META_LIMIT (UINT64_C(1) << 22)
/* 280 years at 1 GHz: a head beyond it was not counted but written by someone. */
#define HEAD_LIMIT (UINT64_C(1) << 62)
/* Slots that a reader copies at once, in bytes. */
#define BATCH_BYTES 65536u
#define PEEK_TRIES 16

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

/* Nothing of the file is mapped: it may be truncated or rewritten at any time (ADR 42). */
struct ring_reader {
	struct ring_header header; /* checked; head and state as they were read last */
	void *meta;
	int fd;
	int is_damaged; /* truncated or overwritten: nothing of it is read any more */
	uint64_t cursor;
	uint64_t head;      /* all slots before it were complete */
	uint64_t *batch;    /* slots copied and checked ahead of the cursor */
	uint64_t batch_max; /* slots that have room in it */
	uint64_t batch_first;
	uint64_t batch_count;
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

int ring_create(const struct ring_spec *spec, struct ring **ret_ring)
{
	struct ring_header header = { .magic = 0 };
	struct new_file file = { .map = NULL };
	struct ring *ring;
	int r;

	fill_header(&header, spec);
	ring = calloc(1, sizeof(*ring));
	if (ring == NULL) {
		return -ENOMEM;
	}
	r = new_file_create(spec->path, spec->file_mode, header.total_bytes, &file);
	if (r < 0) {
		free(ring);
		return r;
	}
	assert(file.map != NULL);
	memcpy(file.map, &header, sizeof(header));
	if (spec->meta_bytes > 0) {
		memcpy((char *)file.map + header.meta_offset, spec->meta, spec->meta_bytes);
	}
	ring->header = file.map;
	ring->slots = (_Atomic uint64_t *)(void *)((char *)file.map + header.slots_offset);
	ring->slot_words = header.slot_bytes / WORD_BYTES;
	ring->mask = header.slot_count - 1;
	ring->map_bytes = header.total_bytes;
	atomic_store_explicit(&ring->header->state, RING_STATE_OPEN, memory_order_release);
	r = new_file_publish(&file, spec->path);
	if (r < 0) {
		free(ring);
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

static uint64_t load_word(const uint8_t *p)
{
	uint64_t v;

	memcpy(&v, p, sizeof(v));
	return v;
}

/* @n words from @p; four at a time, which costs half of what one does. Returns the place behind
 * them. */
static _Atomic uint64_t *write_words(_Atomic uint64_t *word, const uint8_t *p, size_t n)
{
	for (; n >= 4; n -= 4, word += 4, p += 4 * WORD_BYTES) {
		atomic_store_explicit(word, load_word(p), memory_order_relaxed);
		atomic_store_explicit(word + 1, load_word(p + WORD_BYTES), memory_order_relaxed);
		atomic_store_explicit(word + 2, load_word(p + 2 * WORD_BYTES),
				      memory_order_relaxed);
		atomic_store_explicit(word + 3, load_word(p + 3 * WORD_BYTES),
				      memory_order_relaxed);
	}
	for (; n > 0; n--, word++, p += WORD_BYTES) {
		atomic_store_explicit(word, load_word(p), memory_order_relaxed);
	}
	return word;
}

static void write_bytes(struct word_writer *w, const uint8_t *p, size_t n)
{
	if (w->pending_bytes == 0) {
		w->word = write_words(w->word, p, n / WORD_BYTES);
		p += n - n % WORD_BYTES;
		n %= WORD_BYTES;
		if (n > 0) {
			w->pending = get_le(p, (unsigned)n);
			w->pending_bytes = (unsigned)n;
		}
		return;
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
	return h->magic == RING_MAGIC && h->total_bytes == file_bytes && h->slot_count >= 2 &&
	       (h->slot_count & (h->slot_count - 1)) == 0 && h->payload_bytes <= PAYLOAD_LIMIT &&
	       h->slot_bytes == WORD_BYTES + round_up(h->payload_bytes, WORD_BYTES) &&
	       h->meta_offset == PAGE_BYTES && h->meta_bytes <= META_LIMIT &&
	       h->slots_offset == h->meta_offset + round_up(h->meta_bytes, PAGE_BYTES) &&
	       h->slots_offset <= file_bytes &&
	       h->slot_count <= (file_bytes - h->slots_offset) / h->slot_bytes &&
	       memchr(h->kind, 0, sizeof(h->kind)) != NULL;
}

static int damaged(struct ring_reader *reader)
{
	reader->is_damaged = 1;
	reader->batch_count = 0;
	return -EIO;
}

/*
 * Look how far the producer is. An aligned word is read at once by pread on x86-64 and arm64; were
 * it not, the sequence in each slot would show it.
 */
static int look_at_head(struct ring_reader *reader)
{
	struct {
		uint64_t head;
		uint32_t state;
		uint32_t padding;
	} now;

	static_assert(offsetof(struct ring_header, state) ==
			      offsetof(struct ring_header, head) + sizeof(now.head),
		      "read together");
	if (reader->is_damaged ||
	    foreign_read(reader->fd, &now, sizeof(now), offsetof(struct ring_header, head)) < 0 ||
	    now.head < reader->head || now.head > HEAD_LIMIT) {
		return damaged(reader);
	}
	/* What the head covers was written before it. */
	atomic_thread_fence(memory_order_acquire);
	reader->head = now.head;
	reader->header.state = now.state;
	return 0;
}

static int open_file(struct ring_reader *reader)
{
	struct ring_header *h = &reader->header;
	struct stat st;

	reader->fd = foreign_open(reader->path, &st);
	if (reader->fd < 0) {
		return reader->fd;
	}
	if (foreign_read(reader->fd, h, sizeof(*h), 0) < 0) {
		return -EPROTO;
	}
	if (h->magic == RING_MAGIC && h->version != RING_VERSION) {
		return -EPROTONOSUPPORT;
	}
	if (!header_is_sane(h, (uint64_t)st.st_size)) {
		return -EPROTO;
	}
	reader->dev = st.st_dev;
	reader->ino = st.st_ino;
	reader->batch_max = BATCH_BYTES / h->slot_bytes;
	reader->batch_max = reader->batch_max < 1               ? 1
			    : reader->batch_max > h->slot_count ? h->slot_count
								: reader->batch_max;
	reader->batch = malloc(reader->batch_max * h->slot_bytes);
	reader->meta = malloc(h->meta_bytes + 1);
	if (reader->batch == NULL || reader->meta == NULL) {
		return -ENOMEM;
	}
	return foreign_read(reader->fd, reader->meta, h->meta_bytes, h->meta_offset) < 0 ||
			       look_at_head(reader) < 0
		       ? -EPROTO
		       : 0;
}

int ring_reader_open(const char *path, struct ring_reader **ret_reader)
{
	struct ring_reader *reader = calloc(1, sizeof(*reader));
	int r;

	if (reader == NULL) {
		return -ENOMEM;
	}
	reader->fd = -1;
	reader->path = strdup(path);
	r = reader->path == NULL ? -ENOMEM : open_file(reader);
	if (r < 0) {
		ring_reader_destroy(reader);
		return r;
	}
	reader->cursor = reader->head;
	*ret_reader = reader;
	return 0;
}

void ring_reader_destroy(struct ring_reader *reader)
{
	if (reader == NULL) {
		return;
	}
	if (reader->fd >= 0) {
		close(reader->fd);
	}
	free(reader->batch);
	free(reader->meta);
	free(reader->path);
	free(reader);
}

/*
 * Copy slots from @sequence on, which is before the head: 1; 0 if the producer has come round to
 * the first of them meanwhile; -EIO. It wrote them before it moved the head that we saw; if its
 * head, read after the copy, is less than a ring further, it had not begun to overwrite them.
 */
static int copy_slots(struct ring_reader *reader, uint64_t sequence)
{
	const struct ring_header *h = &reader->header;
	uint64_t place = sequence & (h->slot_count - 1);
	uint64_t count = reader->head - sequence;

	count = count < reader->batch_max ? count : reader->batch_max;
	count = count < h->slot_count - place ? count : h->slot_count - place;
	reader->batch_count = 0;
	if (foreign_read(reader->fd, reader->batch, count * h->slot_bytes,
			 h->slots_offset + place * h->slot_bytes) < 0) {
		return damaged(reader);
	}
	atomic_thread_fence(memory_order_acquire);
	if (look_at_head(reader) < 0) {
		return -EIO;
	}
	if (reader->head - sequence >= h->slot_count) {
		return 0;
	}
	for (uint64_t i = 0; i < count; i++) {
		if (reader->batch[i * (h->slot_bytes / WORD_BYTES)] != 2 * (sequence + i) + 2) {
			return damaged(reader);
		}
	}
	reader->batch_first = sequence;
	reader->batch_count = count;
	return 1;
}

static int batch_has(const struct ring_reader *reader, uint64_t sequence)
{
	return sequence >= reader->batch_first &&
	       sequence - reader->batch_first < reader->batch_count;
}

static void take_from_batch(const struct ring_reader *reader, uint64_t sequence, void *payload,
			    size_t payload_bytes)
{
	const struct ring_header *h = &reader->header;
	const uint64_t *slot =
		reader->batch + (sequence - reader->batch_first) * (h->slot_bytes / WORD_BYTES);

	memcpy(payload, slot + 1,
	       payload_bytes < h->payload_bytes ? payload_bytes : h->payload_bytes);
}

/* Nothing is left before the head that is known. Has it moved, or will it never? */
static enum ring_result look_for_more(struct ring_reader *reader)
{
	/* Twice if it is closed: what was pushed before the close is never missed. */
	if (look_at_head(reader) < 0 ||
	    (reader->header.state == RING_STATE_CLOSED && look_at_head(reader) < 0)) {
		return RING_DAMAGED;
	}
	if (reader->cursor < reader->head) {
		return RING_OK;
	}
	return reader->header.state == RING_STATE_CLOSED ? RING_CLOSED : RING_EMPTY;
}

static uint64_t oldest_before(const struct ring_reader *reader, uint64_t head)
{
	uint64_t slots = reader->header.slot_count;
	/* The producer is about to overwrite the oldest slots: keep clear of them by a 16th. */
	uint64_t safe = slots - slots / 16 - 1;

	return head > safe ? head - safe : 0;
}

enum ring_result ring_read(struct ring_reader *reader, void *payload, size_t payload_bytes,
			   uint64_t *ret_lost)
{
	enum ring_result result;
	uint64_t oldest;
	int r = 1;

	if (!batch_has(reader, reader->cursor)) {
		result = reader->cursor < reader->head ? RING_OK : look_for_more(reader);
		if (result != RING_OK) {
			return result;
		}
		r = copy_slots(reader, reader->cursor);
	}
	if (r < 0) {
		return RING_DAMAGED;
	}
	if (r > 0) {
		take_from_batch(reader, reader->cursor, payload, payload_bytes);
		reader->cursor++;
		return RING_OK;
	}
	oldest = oldest_before(reader, reader->head);
	*ret_lost = oldest - reader->cursor;
	reader->cursor = oldest;
	return RING_LOST;
}

enum ring_result ring_peek_newest(struct ring_reader *reader, void *payload, size_t payload_bytes)
{
	for (int tries = 0; tries < PEEK_TRIES; tries++) {
		uint64_t newest;
		int r = look_at_head(reader);

		if (r < 0) {
			return RING_DAMAGED;
		}
		if (reader->head == 0) {
			return RING_EMPTY;
		}
		newest = reader->head - 1;
		r = batch_has(reader, newest) ? 1 : copy_slots(reader, newest);
		if (r < 0) {
			return RING_DAMAGED;
		}
		if (r > 0) {
			take_from_batch(reader, newest, payload, payload_bytes);
			return RING_OK;
		}
	}
	return RING_EMPTY;
}

uint64_t ring_cursor(const struct ring_reader *reader)
{
	return reader->cursor;
}

void ring_seek(struct ring_reader *reader, uint64_t sequence)
{
	reader->cursor = sequence;
}

uint64_t ring_oldest(struct ring_reader *reader)
{
	return oldest_before(reader, ring_newest(reader));
}

uint64_t ring_newest(struct ring_reader *reader)
{
	(void)look_at_head(reader);
	return reader->head;
}

int ring_is_replaced(const struct ring_reader *reader)
{
	struct stat st;

	return stat(reader->path, &st) < 0 || st.st_dev != reader->dev || st.st_ino != reader->ino;
}

int ring_is_orphaned(struct ring_reader *reader)
{
	return look_at_head(reader) == 0 && reader->header.state == RING_STATE_OPEN &&
	       kill((pid_t)reader->header.producer_pid, 0) < 0 && errno == ESRCH;
}

const void *ring_meta(const struct ring_reader *reader, size_t *ret_bytes)
{
	*ret_bytes = reader->header.meta_bytes;
	return reader->meta;
}

const char *ring_kind(const struct ring_reader *reader)
{
	return reader->header.kind;
}

uint32_t ring_payload_bytes(const struct ring_reader *reader)
{
	return reader->header.payload_bytes;
}

uint64_t ring_slot_count(const struct ring_reader *reader)
{
	return reader->header.slot_count;
}
