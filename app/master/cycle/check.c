/* SPDX-License-Identifier: MIT */
#include "cycle/check.h"

#include <assert.h>

#include "base/bytes.h"
#include "base/slave_set.h"
#include "image/field.h"

void check_init(struct check *check, const struct config *cfg, const struct slave_info *slaves,
		size_t slave_count, const struct channel *channels)
{
	assert(slave_count <= LIMIT_SLAVES);
	check->counted = slave_set_empty();
	check->oneshot = slave_set_empty();
	check->known = slave_set_empty();
	check->words = slave_set_words(slave_count);
	check->are_words = 1;
	for (size_t i = 0; i < slave_count; i++) {
		int is_oneshot = i < cfg->slave_count && cfg->slave[i].mode == CONFIG_MODE_ONESHOT;
		const struct channel *counter;
		struct image_field field;

		if (slaves[i].counter_channel < 0) {
			continue;
		}
		counter = &channels[slaves[i].counter_channel];
		field = image_field_of(counter);
		check->are_words &= field.whole == 2;
		check->slave[i] = (struct check_slave){
			.counter = field,
			.mask = UINT64_MAX >> (64 - counter->bit_len),
		};
		slave_set_add(&check->counted, (unsigned)i);
		if (is_oneshot) {
			slave_set_add(&check->oneshot, (unsigned)i);
		}
	}
}

void check_restart_word(struct check *check, unsigned w, uint64_t word)
{
	check->known.word[w] &= ~word;
}

void check_restart(struct check *check)
{
	check->known = slave_set_empty();
}

/* @result->first is that of the lowest position, in whatever order they come. */
static void add_wrong(struct check_result *result, unsigned pos, uint64_t seen, uint64_t expected)
{
	if (!result->has_wrong || pos < result->first.slave_pos) {
		result->first = (struct check_fault){ .slave_pos = (uint16_t)pos,
						      .seen = seen,
						      .expected = expected };
	}
	result->has_wrong = 1;
	slave_set_add(&result->wrong, pos);
}

/*
 * The first slave from @pos on, and before @end, whose counter is not as expected; @end: none.
 * Counters of one word of 16 bits, as FB1111-Piccolos have them, are compared in the fewest steps;
 * others are left to the caller.
 */
static unsigned skip_good(const struct check *check, unsigned pos, unsigned end,
			  const uint8_t *image, uint64_t cycle)
{
	if (!check->are_words) {
		return pos;
	}
	while (pos < end && (uint16_t)(get_le16(image + check->slave[pos].counter.byte) - cycle) ==
				    (uint16_t)check->slave[pos].base) {
		pos++;
	}
	return pos;
}

static void check_periodic(struct check *check, unsigned w, uint64_t word, const uint8_t *image,
			   uint64_t cycle, struct check_result *result)
{
	struct slave_run run;

	while (slave_set_take_run(&word, w, &run)) {
		for (unsigned pos = skip_good(check, run.first, run.end, image, cycle);
		     pos < run.end; pos = skip_good(check, pos + 1, run.end, image, cycle)) {
			struct check_slave *s = &check->slave[pos];
			uint64_t seen = image_field_get(image, s->counter);
			uint64_t base = (seen - cycle) & s->mask;

			if (base != s->base) {
				add_wrong(result, pos, seen, (s->base + cycle) & s->mask);
				s->base = base;
			}
		}
	}
}

static void check_oneshot(struct check *check, unsigned w, uint64_t word, const uint8_t *image,
			  struct check_result *result)
{
	struct slave_run run;

	while (slave_set_take_run(&word, w, &run)) {
		for (unsigned pos = run.first; pos < run.end; pos++) {
			struct check_slave *s = &check->slave[pos];
			uint64_t seen = image_field_get(image, s->counter);
			uint64_t expected = (s->base + 1) & s->mask;

			if (seen != expected && seen != s->base) {
				add_wrong(result, pos, seen, expected);
			}
			s->base = seen;
		}
	}
}

static void take_first(struct check *check, unsigned w, uint64_t word, const uint8_t *image,
		       uint64_t cycle)
{
	struct slave_run run;

	while (slave_set_take_run(&word, w, &run)) {
		for (unsigned pos = run.first; pos < run.end; pos++) {
			struct check_slave *s = &check->slave[pos];
			uint64_t seen = image_field_get(image, s->counter);

			s->base = slave_set_has(&check->oneshot, pos) ? seen
								      : (seen - cycle) & s->mask;
		}
	}
}

void check_image(struct check *check, const uint8_t *image, uint64_t cycle,
		 const struct slave_set *stale, struct check_result *ret)
{
	ret->has_wrong = 0;
	ret->has_unknown = 0;
	for (unsigned w = 0; w < check->words; w++) {
		uint64_t oneshot = check->oneshot.word[w];
		uint64_t fresh = check->counted.word[w] & ~stale->word[w];
		uint64_t known = fresh & check->known.word[w];

		ret->wrong.word[w] = 0;
		check_periodic(check, w, known & ~oneshot, image, cycle, ret);
		check_oneshot(check, w, known & oneshot, image, ret);
		take_first(check, w, fresh & ~known, image, cycle);
		ret->unknown.word[w] = fresh & ~known;
		ret->has_unknown |= (fresh & ~known) != 0;
		check->known.word[w] |= fresh;
	}
}
