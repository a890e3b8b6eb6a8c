/* SPDX-License-Identifier: MIT */
/*
 * A set of slaves: one bit for each position on the bus, in words of 64. In formats (ring, MCAP,
 * DDS, control program) only the words that the slaves of the bus need are stored:
 * slave_set_words(slave_count).
 *
 * Positions are 0-based and below LIMIT_SLAVES. To ask for a higher one is no error: it is in no
 * set, and adding or removing it does nothing, so that a position of foreign origin is harmless.
 *
 * Context: RT-safe, all of it.
 */
#ifndef BASE_SLAVE_SET_H
#define BASE_SLAVE_SET_H

#include <assert.h>
#include <stddef.h>
#include <stdint.h>

#include "base/limits.h"

enum { SLAVE_SET_WORD_BITS = 64, SLAVE_SET_WORDS = LIMIT_SLAVES / SLAVE_SET_WORD_BITS };

static_assert(LIMIT_SLAVES % SLAVE_SET_WORD_BITS == 0, "whole words");

struct slave_set {
	uint64_t word[SLAVE_SET_WORDS]; /* bit pos % 64 of word pos / 64 */
};

/* Words that the positions below @slave_count take: 0 to SLAVE_SET_WORDS. */
static inline unsigned slave_set_words(size_t slave_count)
{
	return slave_count >= (size_t)SLAVE_SET_WORDS * SLAVE_SET_WORD_BITS
		       ? SLAVE_SET_WORDS
		       : (unsigned)((slave_count + SLAVE_SET_WORD_BITS - 1) / SLAVE_SET_WORD_BITS);
}

/* 1 if @pos is in the @word_count words at @word, as formats store them. */
static inline int slave_set_words_have(const uint64_t *word, unsigned word_count, unsigned pos)
{
	return pos / SLAVE_SET_WORD_BITS < word_count &&
	       (word[pos / SLAVE_SET_WORD_BITS] >> pos % SLAVE_SET_WORD_BITS & 1) != 0;
}

static inline struct slave_set slave_set_empty(void)
{
	return (struct slave_set){ .word = { 0 } };
}

/* The positions 0 to @slave_count - 1. */
static inline struct slave_set slave_set_all(size_t slave_count)
{
	struct slave_set set = slave_set_empty();

	for (unsigned i = 0; i < slave_set_words(slave_count); i++) {
		size_t left = slave_count - (size_t)i * SLAVE_SET_WORD_BITS;

		set.word[i] = left >= SLAVE_SET_WORD_BITS ? UINT64_MAX : (UINT64_C(1) << left) - 1;
	}
	return set;
}

static inline void slave_set_add(struct slave_set *set, unsigned pos)
{
	if (pos / SLAVE_SET_WORD_BITS < SLAVE_SET_WORDS) {
		set->word[pos / SLAVE_SET_WORD_BITS] |= UINT64_C(1) << pos % SLAVE_SET_WORD_BITS;
	}
}

static inline void slave_set_remove(struct slave_set *set, unsigned pos)
{
	if (pos / SLAVE_SET_WORD_BITS < SLAVE_SET_WORDS) {
		set->word[pos / SLAVE_SET_WORD_BITS] &= ~(UINT64_C(1) << pos % SLAVE_SET_WORD_BITS);
	}
}

static inline int slave_set_has(const struct slave_set *set, unsigned pos)
{
	return slave_set_words_have(set->word, SLAVE_SET_WORDS, pos);
}

/* Adds what is in @other. */
static inline void slave_set_or(struct slave_set *set, const struct slave_set *other)
{
	for (unsigned i = 0; i < SLAVE_SET_WORDS; i++) {
		set->word[i] |= other->word[i];
	}
}

/* Keeps only what is in @other, too. */
static inline void slave_set_and(struct slave_set *set, const struct slave_set *other)
{
	for (unsigned i = 0; i < SLAVE_SET_WORDS; i++) {
		set->word[i] &= other->word[i];
	}
}

/* Removes what is in @other. */
static inline void slave_set_and_not(struct slave_set *set, const struct slave_set *other)
{
	for (unsigned i = 0; i < SLAVE_SET_WORDS; i++) {
		set->word[i] &= ~other->word[i];
	}
}

static inline unsigned slave_set_count(const struct slave_set *set)
{
	unsigned count = 0;

	for (unsigned i = 0; i < SLAVE_SET_WORDS; i++) {
		count += (unsigned)__builtin_popcountll(set->word[i]);
	}
	return count;
}

static inline int slave_set_is_empty(const struct slave_set *set)
{
	uint64_t any = 0;

	for (unsigned i = 0; i < SLAVE_SET_WORDS; i++) {
		any |= set->word[i];
	}
	return any == 0;
}

static inline int slave_set_is_equal(const struct slave_set *a, const struct slave_set *b)
{
	uint64_t differs = 0;

	for (unsigned i = 0; i < SLAVE_SET_WORDS; i++) {
		differs |= a->word[i] ^ b->word[i];
	}
	return differs == 0;
}

/* 1 if @a and @b differ in one of their first @words words. */
static inline int slave_set_differs(const struct slave_set *a, const struct slave_set *b,
				    unsigned words)
{
	uint64_t differs = 0;

	for (unsigned i = 0; i < words; i++) {
		differs |= a->word[i] ^ b->word[i];
	}
	return differs != 0;
}

/* Consecutive positions. */
struct slave_run {
	unsigned first;
	unsigned end; /* behind the last */
};

/* Takes the lowest run of bits out of *@rest, what is left of word @word of a set. 0: none is left.
 * Most sets are one run: a loop over it costs less than one over its bits. */
static inline int slave_set_take_run(uint64_t *rest, unsigned word, struct slave_run *ret_run)
{
	unsigned first;
	uint64_t above;

	if (*rest == 0) {
		return 0;
	}
	first = (unsigned)__builtin_ctzll(*rest);
	above = *rest + (UINT64_C(1) << first); /* carries through the run; 0: to the end */
	ret_run->first = word * SLAVE_SET_WORD_BITS + first;
	ret_run->end = word * SLAVE_SET_WORD_BITS +
		       (above == 0 ? SLAVE_SET_WORD_BITS : (unsigned)__builtin_ctzll(above));
	*rest &= above;
	return 1;
}

/* The first position in @set that is not below @from; LIMIT_SLAVES: none. */
static inline unsigned slave_set_next(const struct slave_set *set, unsigned from)
{
	for (unsigned pos = from; pos / SLAVE_SET_WORD_BITS < SLAVE_SET_WORDS;
	     pos = (pos / SLAVE_SET_WORD_BITS + 1) * SLAVE_SET_WORD_BITS) {
		uint64_t rest = set->word[pos / SLAVE_SET_WORD_BITS] >> pos % SLAVE_SET_WORD_BITS;

		if (rest != 0) {
			return pos + (unsigned)__builtin_ctzll(rest);
		}
	}
	return SLAVE_SET_WORDS * SLAVE_SET_WORD_BITS;
}

#endif
