/* SPDX-License-Identifier: MIT */
#include "base/slave_set.h"

#include "base/limits.h"
#include "base/prng.h"
#include "harness/test.h"

enum { ALL = SLAVE_SET_WORDS * SLAVE_SET_WORD_BITS };

TEST(slave_set, every_position_below_the_limit_is_its_own_bit)
{
	for (unsigned pos = 0; pos < LIMIT_SLAVES; pos++) {
		struct slave_set set = slave_set_empty();

		slave_set_add(&set, pos);
		for (unsigned other = 0; other < LIMIT_SLAVES; other++) {
			CHECK_EQ(slave_set_has(&set, other), other == pos);
		}
		CHECK_EQ(slave_set_count(&set), 1);
		CHECK_EQ(slave_set_next(&set, 0), pos);
		CHECK_EQ(slave_set_next(&set, pos), pos);
		CHECK_EQ(slave_set_next(&set, pos + 1), ALL);
		slave_set_remove(&set, pos);
		CHECK(slave_set_is_empty(&set));
	}
}

TEST(slave_set, all_of_a_count_are_exactly_the_positions_below_it)
{
	for (unsigned count = 0; count <= LIMIT_SLAVES; count++) {
		struct slave_set set = slave_set_all(count);

		CHECK_EQ(slave_set_count(&set), count);
		CHECK_EQ(slave_set_is_empty(&set), count == 0);
		CHECK_EQ(slave_set_has(&set, count), 0);
		CHECK(count == 0 || slave_set_has(&set, count - 1));
	}
}

TEST(slave_set, a_format_stores_the_words_that_the_slaves_need)
{
	CHECK_EQ(slave_set_words(0), 0);
	CHECK_EQ(slave_set_words(1), 1);
	CHECK_EQ(slave_set_words(2), 1);
	CHECK_EQ(slave_set_words(64), 1);
	CHECK_EQ(slave_set_words(65), 2);
	CHECK_EQ(slave_set_words(ALL), SLAVE_SET_WORDS);
	CHECK_EQ(slave_set_words(ALL + 1), SLAVE_SET_WORDS);
	CHECK_EQ(slave_set_words(SIZE_MAX), SLAVE_SET_WORDS);
}

TEST(slave_set, a_position_beyond_the_stored_words_is_in_no_set)
{
	struct slave_set set = slave_set_all(ALL);
	struct slave_set none = slave_set_empty();

	CHECK_EQ(slave_set_words_have(set.word, 1, 63), 1);
	CHECK_EQ(slave_set_words_have(set.word, 1, 64), 0);
	CHECK_EQ(slave_set_has(&set, ALL), 0);
	CHECK_EQ(slave_set_has(&set, UINT32_MAX), 0);
	slave_set_add(&none, ALL);
	slave_set_add(&none, UINT32_MAX);
	CHECK(slave_set_is_empty(&none));
	slave_set_remove(&set, ALL);
	slave_set_remove(&set, UINT32_MAX);
	CHECK_EQ(slave_set_count(&set), ALL);
	CHECK_EQ(slave_set_next(&set, ALL), ALL);
}

TEST(slave_set, union_intersection_and_difference_work_across_words)
{
	struct slave_set low = slave_set_all(100);
	struct slave_set some = slave_set_empty();
	struct slave_set set = low;

	slave_set_add(&some, 3);
	slave_set_add(&some, 99);
	slave_set_add(&some, 100);

	slave_set_or(&set, &some);
	CHECK_EQ(slave_set_count(&set), 101);
	slave_set_and_not(&set, &low);
	CHECK_EQ(slave_set_count(&set), 1);
	CHECK(slave_set_has(&set, 100));

	set = some;
	slave_set_and(&set, &low);
	CHECK_EQ(slave_set_count(&set), 2);
	CHECK_EQ(slave_set_next(&set, 4), 99);
	CHECK(!slave_set_is_equal(&set, &some));
	slave_set_add(&set, 100);
	CHECK(slave_set_is_equal(&set, &some));
}

TEST(slave_set, the_runs_of_a_word_are_its_bits_in_order)
{
	struct prng prng = { 3 };

	for (int round = 0; round < 20000; round++) {
		uint64_t word = round == 0 ? 0 : round == 1 ? UINT64_MAX : prng_next(&prng);
		uint64_t rest = word | (round % 3 == 0 ? prng_next(&prng) : 0);
		uint64_t seen = 0;
		unsigned end = 0;
		struct slave_run run;

		word = rest;
		while (slave_set_take_run(&rest, 3, &run)) {
			CHECK(run.first < run.end && run.first >= 3 * 64 && run.end <= 4 * 64);
			CHECK(end == 0 || run.first > end); /* two runs are not one */
			for (unsigned pos = run.first; pos < run.end; pos++) {
				seen |= UINT64_C(1) << pos % 64;
			}
			end = run.end;
		}
		CHECK(seen == word);
	}
}

TEST(slave_set, only_the_words_in_use_are_compared)
{
	struct slave_set a = { .word = { 1, 2, 3 } };
	struct slave_set b = { .word = { 1, 2, 4 } };

	CHECK_EQ(slave_set_differs(&a, &b, 2), 0);
	CHECK_EQ(slave_set_differs(&a, &b, 3), 1);
	CHECK_EQ(slave_set_differs(&a, &b, 0), 0);
}
