/* SPDX-License-Identifier: MIT */
/* Which counters are wrong, against a reference that keeps the last value and its cycle. */
#include "cycle/check.h"

#include <stdlib.h>

#include "base/prng.h"
#include "harness/test.h"
#include "image/image.h"

enum { SLAVES = 130, CYCLES = 4000, BITS_A_SLAVE = 80 };

struct reference {
	int has_last;
	uint64_t last;
	uint64_t last_cycle;
};

struct bus {
	struct config cfg;
	struct slave_info slaves[SLAVES];
	struct channel channels[SLAVES];
	uint8_t image[SLAVES * BITS_A_SLAVE / 8];
	struct check check;
	struct reference reference[SLAVES];
	struct prng prng;
};

/* @kind 0: 16 bits in whole octets; 1: of any length, at any bit. Some slaves have no counter. */
static struct bus *make_bus(unsigned kind, uint64_t seed)
{
	struct bus *b = calloc(1, sizeof(*b));

	CHECK(b != NULL);
	b->prng.state = seed;
	b->cfg.slave_count = SLAVES;
	for (unsigned i = 0; i < SLAVES; i++) {
		unsigned bit_len = kind == 0 ? 16 : 1 + (unsigned)prng_below(&b->prng, 64);
		unsigned shift = kind == 0 ? 0 : (unsigned)prng_below(&b->prng, 8);

		b->channels[i] = (struct channel){ .type = CHANNEL_UINT,
						   .bit_len = (uint8_t)bit_len,
						   .bit_offset = i * BITS_A_SLAVE + shift };
		b->slaves[i].counter_channel = prng_below(&b->prng, 10) == 0 ? -1 : (int32_t)i;
		b->cfg.slave[i].mode =
			prng_below(&b->prng, 10) == 0 ? CONFIG_MODE_ONESHOT : CONFIG_MODE_PERIODIC;
	}
	check_init(&b->check, &b->cfg, b->slaves, SLAVES, b->channels);
	return b;
}

/* Counters go on; now and then one does not, or jumps. */
static void move_counters(struct bus *b, uint64_t edges)
{
	for (unsigned i = 0; i < SLAVES; i++) {
		uint64_t seen = image_get_raw(b->image, &b->channels[i]);
		uint64_t by = edges;

		if (b->cfg.slave[i].mode == CONFIG_MODE_ONESHOT) {
			by = prng_below(&b->prng, 2);
		}
		if (prng_below(&b->prng, 200) == 0) {
			by += 1 + prng_below(&b->prng, 3);
		}
		image_set_raw(b->image, &b->channels[i], seen + by);
	}
}

/* -1: no counter, or stale; 0: good; 1: wrong; 2: unknown. */
static int judge(struct bus *b, unsigned i, uint64_t cycle, uint64_t *ret_expected)
{
	struct reference *r = &b->reference[i];
	unsigned bit_len = b->channels[i].bit_len;
	uint64_t mask = bit_len == 64 ? UINT64_MAX : (UINT64_C(1) << bit_len) - 1;
	int is_oneshot = b->cfg.slave[i].mode == CONFIG_MODE_ONESHOT;
	uint64_t seen = image_get_raw(b->image, &b->channels[i]);
	struct reference before = *r;

	*r = (struct reference){ .has_last = 1, .last = seen, .last_cycle = cycle };
	if (!before.has_last) {
		return 2;
	}
	*ret_expected = (before.last + (is_oneshot ? 1 : cycle - before.last_cycle)) & mask;
	return !(seen == *ret_expected || (is_oneshot && seen == before.last));
}

static unsigned check_cycle(struct bus *b, uint64_t cycle, const struct slave_set *stale)
{
	struct check_result result;
	unsigned wrong = 0;
	unsigned unknown = 0;

	check_image(&b->check, b->image, cycle, stale, &result);
	for (unsigned i = 0; i < SLAVES; i++) {
		uint64_t expected = 0;
		int is = b->slaves[i].counter_channel < 0 || slave_set_has(stale, i)
				 ? -1
				 : judge(b, i, cycle, &expected);

		CHECK_EQ(slave_set_has(&result.wrong, i), is == 1);
		CHECK_EQ(slave_set_has(&result.unknown, i), is == 2);
		if (is == 1 && wrong++ == 0) {
			CHECK_EQ(result.first.slave_pos, i);
			CHECK(result.first.expected == expected);
			CHECK(result.first.seen == image_get_raw(b->image, &b->channels[i]));
		}
		unknown += is == 2;
	}
	CHECK_EQ(result.has_wrong, wrong > 0);
	CHECK_EQ(result.has_unknown, unknown > 0);
	return wrong;
}

static void restart_some(struct bus *b)
{
	unsigned w = (unsigned)prng_below(&b->prng, slave_set_words(SLAVES));
	uint64_t word = prng_next(&b->prng) & prng_next(&b->prng);

	check_restart_word(&b->check, w, word);
	for (unsigned i = w * 64; i < SLAVES && i < w * 64 + 64; i++) {
		b->reference[i].has_last &= (word >> i % 64 & 1) == 0;
	}
}

static void restart_all(struct bus *b)
{
	check_restart(&b->check);
	for (unsigned i = 0; i < SLAVES; i++) {
		b->reference[i].has_last = 0;
	}
}

static void run(unsigned kind, uint64_t seed)
{
	struct bus *b = make_bus(kind, seed);
	uint64_t cycle = prng_next(&b->prng);
	unsigned wrong = 0;

	for (int n = 0; n < CYCLES; n++) {
		uint64_t edges = prng_below(&b->prng, 20) == 0 ? 1 + prng_below(&b->prng, 5) : 1;
		struct slave_set stale = slave_set_empty();

		cycle += edges;
		move_counters(b, edges);
		for (unsigned w = 0; w < SLAVE_SET_WORDS && prng_below(&b->prng, 4) == 0; w++) {
			stale.word[w] = prng_next(&b->prng) & prng_next(&b->prng);
		}
		if (prng_below(&b->prng, 50) == 0) {
			restart_some(b);
		}
		if (prng_below(&b->prng, 500) == 0) {
			restart_all(b);
		}
		wrong += check_cycle(b, cycle, &stale);
	}
	CHECK(wrong > CYCLES / 20);
	free(b);
}

TEST(check, counters_of_sixteen_bits_are_judged_as_the_reference_does)
{
	run(0, 11);
}

TEST(check, counters_of_any_length_and_place_are_judged_as_the_reference_does)
{
	run(1, 12);
}
