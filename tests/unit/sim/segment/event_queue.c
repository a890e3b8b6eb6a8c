/* SPDX-License-Identifier: MIT */
#include "segment/event_queue.h"

#include "base/prng.h"
#include "harness/test.h"

enum { SLAVES_MAX = 70, CHANGES = 2000, TIMES = 40 };

/* As it was before there was a queue: all are looked at. */
static size_t earliest(const int64_t *due_ns, size_t count)
{
	size_t best = 0;

	for (size_t i = 1; i < count; i++) {
		best = due_ns[i] < due_ns[best] ? i : best;
	}
	return best;
}

static void change_and_compare(size_t count, struct prng *prng)
{
	int64_t due_ns[SLAVES_MAX];
	struct event_queue q;

	CHECK_EQ(event_queue_init(&q, count), 0);
	for (size_t i = 0; i < count; i++) {
		due_ns[i] = INT64_MAX;
	}
	for (unsigned n = 0; n < CHANGES; n++) {
		size_t slave = (size_t)prng_below(prng, count);
		uint64_t time = prng_below(prng, TIMES);

		due_ns[slave] = time == 0 ? INT64_MAX : (int64_t)time;
		event_queue_set(&q, slave, due_ns[slave]);
		CHECK_EQ(event_queue_first(&q), earliest(due_ns, count));
	}
	event_queue_done(&q);
}

TEST(event_queue, the_first_is_the_earliest_and_of_equals_the_first_in_the_list)
{
	struct prng prng = { 5 };

	for (size_t count = 1; count <= SLAVES_MAX; count++) {
		change_and_compare(count, &prng);
	}
}

TEST(event_queue, without_an_event_the_first_slave_wins)
{
	struct event_queue q;

	CHECK_EQ(event_queue_init(&q, 3), 0);
	CHECK_EQ(event_queue_first(&q), 0);
	event_queue_set(&q, 2, 7);
	CHECK_EQ(event_queue_first(&q), 2);
	event_queue_set(&q, 2, INT64_MAX);
	CHECK_EQ(event_queue_first(&q), 0);
	event_queue_done(&q);
}
