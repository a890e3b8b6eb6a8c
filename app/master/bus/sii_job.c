/* SPDX-License-Identifier: MIT */
/* Reads and writes the EEPROM of one slave, a frame a step. The order of writing is in
 * esc_access.h. */
#include <errno.h>
#include <stdio.h>
#include <string.h>

#include "base/bytes.h"
#include "bus/bus_internal.h"
#include "bus/esc_access.h"
#include "bus/registers.h"

enum phase {
	PHASE_STATE,    /* may it be written now? */
	PHASE_HEADER,   /* words 0 to 11: header, vendor, product */
	PHASE_READ,     /* reading the image */
	PHASE_COMPARE,  /* read the word that is next in the order */
	PHASE_MARK,     /* word 7 becomes wrong, before the first word is written */
	PHASE_WRITE,    /* write the word */
	PHASE_READBACK, /* and read it again */
	PHASE_END,
};

enum {
	CHECKSUM_WORD = 7,
	ALIAS_WORD = 4,
	IDENTITY_WORDS = 12,
	VENDOR_WORD = 8,
	TRIES = 3,
};

#define READ_NS NS_PER_S
#define WRITE_NS (3 * NS_PER_S) /* an emulated EEPROM erases a page of flash */

static int fail(struct sii_job *job, int code, const char *what)
{
	job->bus->error = job->error;
	bus_fail_slave(job->bus, job->pos, code, "%s", what);
	job->bus->error = NULL; /* the job may be freed before the next call */
	return code;
}

static void ask(struct sii_job *job, enum eeprom_operation operation, uint32_t word)
{
	int64_t limit_ns = operation == EEPROM_OP_WRITE ? WRITE_NS : READ_NS;

	eeprom_begin(&job->command, operation, job->bus->slave[job->pos].info.station_addr, word,
		     mono_add(bus_now(job->bus), (span_t){ limit_ns }));
}

static void header_bytes(const uint16_t *words, uint8_t *ret)
{
	for (unsigned i = 0; i < SII_HEADER_WORDS; i++) {
		put_le16(ret + (size_t)2 * i, words[i]);
	}
}

static uint8_t checksum_of(const uint16_t *words)
{
	uint8_t bytes[2 * SII_HEADER_WORDS];

	header_bytes(words, bytes);
	return sii_checksum(bytes);
}

/* A value of word 7 that fits neither the old nor the new words 0 to 6, nor a mixture on the way.
 */
static uint16_t marker_of(const struct sii_job *job)
{
	uint16_t words[SII_HEADER_WORDS];
	uint8_t used[32] = { 0 };
	unsigned value = 0;

	memcpy(words, job->header, sizeof(words));
	for (unsigned i = 0; i <= CHECKSUM_WORD; i++) {
		uint8_t crc = checksum_of(words);

		used[crc / 8] |= (uint8_t)(1u << crc % 8);
		words[i] = job->wanted_header[i];
	}
	while ((used[value / 8] >> value % 8 & 1) != 0) {
		value++;
	}
	return (uint16_t)value;
}

/* --- the order of writing --- */

/* The word that is written as the @n-th. */
static uint32_t word_at(const struct sii_job *job, size_t n)
{
	size_t body = job->total_words - SII_HEADER_WORDS;

	return (uint32_t)(n < body ? n + SII_HEADER_WORDS : n - body);
}

static uint16_t wanted_word(const struct sii_job *job, uint32_t word)
{
	return word < SII_HEADER_WORDS ? job->wanted_header[word]
				       : get_le16(job->contents + (size_t)2 * word);
}

static int next_word(struct sii_job *job)
{
	if (job->done_words == job->total_words) {
		job->phase = PHASE_END;
		return 1;
	}
	job->word = word_at(job, job->done_words);
	job->tries = 0;
	job->phase = PHASE_COMPARE;
	ask(job, EEPROM_OP_READ, job->word);
	return 1;
}

static int write_word(struct sii_job *job, enum phase phase, uint32_t word, uint16_t value)
{
	job->phase = (int)phase;
	job->word = word;
	job->pending = value;
	put_le16(job->command.data, value);
	ask(job, EEPROM_OP_WRITE, word);
	return 1;
}

/* --- what a command that is done means --- */

static int on_read(struct sii_job *job)
{
	size_t at = (size_t)2 * job->word;
	size_t len = (size_t)2 * job->command.words;

	if (len > job->len_bytes - at) {
		len = job->len_bytes - at;
	}
	memcpy(job->image + at, job->command.data, len);
	job->word += (uint32_t)(len / 2);
	job->done_words = job->word;
	if (job->word == SII_CATEGORIES_BYTE / 2 && job->len_bytes == SII_CATEGORIES_BYTE) {
		job->len_bytes = sii_stated_bytes(job->image);
		job->total_words = job->len_bytes / 2;
		if (job->len_bytes > job->capacity) {
			return fail(job, -ENOSPC, "its EEPROM is larger than the buffer");
		}
	}
	if (job->word == job->total_words) {
		job->phase = PHASE_END;
	} else {
		ask(job, EEPROM_OP_READ, job->word);
	}
	return 1;
}

static int is_other_device(const struct sii_job *job)
{
	for (unsigned i = VENDOR_WORD; i < IDENTITY_WORDS; i++) {
		if (job->words[i] != get_le16(job->contents + (size_t)2 * i)) {
			return 1;
		}
	}
	return 0;
}

static int plan_write(struct sii_job *job)
{
	uint8_t old[2 * SII_HEADER_WORDS];

	header_bytes(job->header, old);
	if (job->kind == SII_JOB_ALIAS) {
		if (!sii_is_checksum_right(old)) {
			return fail(job, -EINVAL,
				    "the checksum of its EEPROM is wrong: write its whole SII");
		}
		memcpy(job->wanted_header, job->header, sizeof(job->header));
		job->wanted_header[ALIAS_WORD] = job->alias;
		job->wanted_header[CHECKSUM_WORD] = checksum_of(job->wanted_header);
	} else {
		for (unsigned i = 0; i < SII_HEADER_WORDS; i++) {
			job->wanted_header[i] = get_le16(job->contents + (size_t)2 * i);
		}
		/* Of a blank or damaged EEPROM the identity says nothing. */
		if (job->guard == ESC_GUARDED && sii_is_checksum_right(old) &&
		    is_other_device(job)) {
			return fail(job, -EINVAL,
				    "the image is for another vendor or product; write it with "
				    "force if that is meant");
		}
	}
	job->done_words = 0;
	return next_word(job);
}

static int on_header(struct sii_job *job)
{
	uint16_t *to = job->words;

	for (unsigned i = 0; i < job->command.words && job->word < IDENTITY_WORDS; i++) {
		to[job->word++] = get_le16(job->command.data + (size_t)2 * i);
	}
	if (job->word < IDENTITY_WORDS) {
		ask(job, EEPROM_OP_READ, job->word);
		return 1;
	}
	memcpy(job->header, to, sizeof(job->header));
	return plan_write(job);
}

static int on_compare(struct sii_job *job)
{
	uint16_t wanted = wanted_word(job, job->word);

	if (get_le16(job->command.data) == wanted) {
		job->done_words++;
		return next_word(job);
	}
	if (!job->is_changed) {
		job->is_changed = 1;
		return write_word(job, PHASE_MARK, CHECKSUM_WORD, marker_of(job));
	}
	return write_word(job, PHASE_WRITE, job->word, wanted);
}

/* The marker is verified as any word is: compared with what was written. */
static int on_written(struct sii_job *job)
{
	job->phase = PHASE_READBACK;
	ask(job, EEPROM_OP_READ, job->word);
	return 1;
}

static int on_readback(struct sii_job *job)
{
	char what[96];

	if (get_le16(job->command.data) == job->pending) {
		job->written_words++;
		return next_word(job); /* of the same place in the order: now it is equal */
	}
	if (++job->tries < TRIES) {
		return write_word(job, PHASE_WRITE, job->word, job->pending);
	}
	snprintf(what, sizeof(what),
		 "word 0x%04x of its EEPROM reads 0x%04x after 0x%04x was written", job->word,
		 get_le16(job->command.data), job->pending);
	return fail(job, -EIO, what);
}

static int on_done(struct sii_job *job)
{
	switch ((enum phase)job->phase) {
	case PHASE_HEADER:
		return on_header(job);
	case PHASE_READ:
		return on_read(job);
	case PHASE_COMPARE:
		return on_compare(job);
	case PHASE_MARK:
	case PHASE_WRITE:
		return on_written(job);
	case PHASE_READBACK:
		return on_readback(job);
	case PHASE_STATE:
	case PHASE_END:
		break;
	}
	return -EINVAL;
}

/* --- steps --- */

static int check_state(struct sii_job *job)
{
	uint8_t status[2] = { 0 };
	unsigned state;
	int r = register_read(job->bus, job->pos, ESC_REG_AL_STATUS, status, sizeof(status));

	if (r < 0) {
		return fail(job, r, "it does not answer");
	}
	state = get_le16(status) & AL_STATE_MASK;
	if (job->guard == ESC_GUARDED && (state == AL_SAFEOP || state == AL_OP)) {
		return fail(job, -EPERM,
			    "it is in SAFE-OP or OP: its EEPROM is not written, unless forced");
	}
	job->phase = PHASE_HEADER;
	job->word = 0;
	ask(job, EEPROM_OP_READ, 0);
	return 1;
}

/* Its controller may need the EEPROM again. */
static int give_back(struct sii_job *job)
{
	uint8_t to_pdi = 1;
	int r = register_write(job->bus, job->pos, ESC_REG_EEPROM_CONFIG, &to_pdi, 1);

	return r < 0 ? fail(job, r, "its EEPROM cannot be given back to its controller") : 0;
}

int sii_job_step(struct sii_job *job)
{
	struct access access[EEPROM_ACCESSES];
	size_t count;
	int r;

	if (job->phase == PHASE_STATE) {
		return check_state(job);
	}
	if (job->phase == PHASE_END) {
		return give_back(job);
	}
	count = eeprom_prepare(&job->command, access);
	r = registers_run(job->bus, access, count);
	if (r == 0) {
		r = eeprom_take(&job->command, access, bus_now(job->bus));
	} else if (r == -ETIMEDOUT) {
		r = eeprom_lost(&job->command, bus_now(job->bus));
	}
	if (r < 0) {
		return fail(job, r, eeprom_error_text(r));
	}
	return r > 0 ? 1 : on_done(job);
}

static int begin(struct sii_job *job, struct bus *bus, size_t pos, enum sii_job_kind kind)
{
	*job = (struct sii_job){ .kind = kind, .pos = pos, .bus = bus };
	if (pos < bus->slave_count) {
		return 0;
	}
	snprintf(job->error, sizeof(job->error), "no slave at position %zu: there are %zu", pos,
		 bus->slave_count);
	return -ENODEV;
}

int sii_job_read(struct sii_job *job, struct bus *bus, size_t pos, uint8_t *image, size_t capacity)
{
	int r = begin(job, bus, pos, SII_JOB_READ);

	if (r < 0) {
		return r;
	}
	if (capacity < SII_CATEGORIES_BYTE) {
		return fail(job, -ENOSPC, "the buffer is too small for an SII");
	}
	job->image = image;
	job->capacity = capacity;
	job->len_bytes = SII_CATEGORIES_BYTE;
	job->total_words = SII_CATEGORIES_BYTE / 2;
	job->phase = PHASE_READ;
	ask(job, EEPROM_OP_READ, 0);
	return 0;
}

int sii_job_write(struct sii_job *job, struct bus *bus, size_t pos, const uint8_t *image,
		  size_t len_bytes, enum esc_guard guard)
{
	char why[160];
	int r = begin(job, bus, pos, SII_JOB_WRITE);

	if (r < 0) {
		return r;
	}
	if (sii_image_check(image, len_bytes, why, sizeof(why)) < 0) {
		return fail(job, -EINVAL, why);
	}
	job->contents = image;
	job->len_bytes = len_bytes;
	job->total_words = len_bytes / 2;
	job->guard = guard;
	return 0;
}

int sii_job_alias(struct sii_job *job, struct bus *bus, size_t pos, uint16_t alias,
		  enum esc_guard guard)
{
	int r = begin(job, bus, pos, SII_JOB_ALIAS);

	job->alias = alias;
	job->total_words = SII_HEADER_WORDS;
	job->guard = guard;
	return r;
}

int sii_image_check(const uint8_t *image, size_t len_bytes, char *error, size_t error_bytes)
{
	static struct sii sii;

	if (len_bytes % 2 != 0 || len_bytes > SII_LIMIT_BYTES) {
		snprintf(error, error_bytes,
			 "SII image: %zu bytes: expected an even number up to %d", len_bytes,
			 SII_LIMIT_BYTES);
		return -EINVAL;
	}
	if (sii_parse(image, len_bytes, &sii, error, error_bytes) < 0) {
		return -EINVAL;
	}
	if (image[SII_CHECKSUM_BYTE] != sii_checksum(image)) {
		snprintf(error, error_bytes,
			 "SII image: checksum of words 0 to 7 is 0x%02x, expected 0x%02x",
			 image[SII_CHECKSUM_BYTE], sii_checksum(image));
		return -EINVAL;
	}
	if (len_bytes > sii_stated_bytes(image)) {
		snprintf(error, error_bytes,
			 "SII image: %zu bytes, more than its size word 0x3e says (%zu)", len_bytes,
			 sii_stated_bytes(image));
		return -EINVAL;
	}
	return 0;
}
