/* SPDX-License-Identifier: MIT */
#include "web/outbox.h"

#include <errno.h>
#include <string.h>

#include "base/prng.h"
#include "harness/test.h"
#include "web/subscriptions.h"

enum { LARGEST = 64, BYTES = 1000 };

static struct outbox *made(void)
{
	struct outbox *box = NULL;

	CHECK_EQ(outbox_create(BYTES, LARGEST, &box), 0);
	return box;
}

/* A message whose data are its number. */
static void put(struct outbox *box, uint32_t channel, uint64_t number, size_t len)
{
	memset(outbox_reserve(box), (int)(number & 0xff), len);
	outbox_put(box, &(struct outbox_message){ .channel = channel,
						  .number = number,
						  .time_ns = -(int64_t)number,
						  .len = len });
}

static void check(const struct outbox_message *m, uint64_t number)
{
	CHECK_EQ(m->number, number);
	CHECK_EQ(m->time_ns, -(int64_t)number);
	for (size_t i = 0; i < m->len; i++) {
		CHECK_EQ(m->data[i], number & 0xff);
	}
}

TEST(web, an_outbox_that_cannot_hold_four_of_the_largest_messages_is_not_made)
{
	struct outbox *box = NULL;

	CHECK_EQ(outbox_create(4 * LARGEST, LARGEST, &box), -EINVAL);
	CHECK(box == NULL);
}

TEST(web, each_client_reads_every_message_once_and_in_order)
{
	struct outbox *box = made();
	uint64_t slow = outbox_head(box);
	uint64_t fast = slow;
	struct outbox_message m;

	for (uint64_t n = 0; n < 5; n++) {
		put(box, 1, n, 10);
		CHECK_EQ(outbox_read(box, &fast, &m), 1);
		check(&m, n);
		CHECK_EQ(outbox_read(box, &fast, &m), 0);
	}
	for (uint64_t n = 0; n < 5; n++) {
		CHECK_EQ(outbox_read(box, &slow, &m), 1);
		check(&m, n);
	}
	CHECK_EQ(outbox_read(box, &slow, &m), 0);
	outbox_destroy(box);
}

TEST(web, a_client_that_was_overtaken_goes_on_with_the_oldest_message_there_is)
{
	struct outbox *box = made();
	struct prng prng = { .state = 7 };
	uint64_t cursor = outbox_head(box);
	uint64_t next = 0;
	uint64_t lost = 0;
	uint64_t read = 0;
	struct outbox_message m;

	for (uint64_t n = 0; n < 20000; n++) {
		put(box, 1, n, prng_below(&prng, LARGEST + 1));
		for (uint64_t k = prng_below(&prng, 40) == 0 ? 60 : 0; k > 0; k--) {
			if (!outbox_read(box, &cursor, &m)) {
				break;
			}
			CHECK(m.number >= next);
			check(&m, m.number);
			lost += m.number - next;
			next = m.number + 1;
			read++;
		}
	}
	CHECK(read > 1000);
	CHECK(lost > 1000);
	CHECK_EQ(read + lost, next);
	outbox_destroy(box);
}

TEST(web, a_subscription_counts_what_was_dropped_and_nothing_before_it_began)
{
	static struct subscriptions subs;
	uint64_t lost = 99;
	const struct subscription *sub;

	subs = (struct subscriptions){ .count = 0 };
	CHECK_EQ(subscriptions_add(&subs, 7, 1, 10), 0);
	CHECK(subscriptions_take(&subs, &(struct outbox_message){ .channel = 1, .number = 9 },
				 &lost) == NULL);
	CHECK(subscriptions_take(&subs, &(struct outbox_message){ .channel = 2, .number = 10 },
				 &lost) == NULL);
	sub = subscriptions_take(&subs, &(struct outbox_message){ .channel = 1, .number = 10 },
				 &lost);
	CHECK(sub != NULL && sub->id == 7);
	CHECK_EQ(lost, 0);
	sub = subscriptions_take(&subs, &(struct outbox_message){ .channel = 1, .number = 14 },
				 &lost);
	CHECK(sub != NULL);
	CHECK_EQ(lost, 3);
}

TEST(web, an_id_and_a_channel_have_one_subscription_at_a_time)
{
	static struct subscriptions subs;

	subs = (struct subscriptions){ .count = 0 };
	CHECK_EQ(subscriptions_add(&subs, 7, 1, 0), 0);
	CHECK_EQ(subscriptions_add(&subs, 7, 2, 0), -EEXIST);
	CHECK_EQ(subscriptions_add(&subs, 8, 1, 0), -EEXIST);
	CHECK_EQ(subscriptions_add(&subs, 9, 0, 0), -EINVAL);
	CHECK_EQ(subscriptions_add(&subs, 9, SOURCE_IDS - 1, 0), -EINVAL);
	CHECK_EQ(subs.count, 1);
	CHECK_EQ(subscriptions_remove(&subs, 8), -ENOENT);
	CHECK_EQ(subscriptions_remove(&subs, 7), 1);
	CHECK_EQ(subscriptions_remove(&subs, 7), -ENOENT);
	CHECK_EQ(subs.count, 0);
}

TEST(web, a_message_of_an_earlier_session_is_not_for_a_subscription_of_this_one)
{
	static struct subscriptions subs;
	uint32_t now = source_slave_channel(2, 0);
	uint64_t lost = 0;

	subs = (struct subscriptions){ .count = 0 };
	CHECK_EQ(subscriptions_add(&subs, 7, now, 0), 0);
	CHECK(subscriptions_take(&subs,
				 &(struct outbox_message){ .channel = source_slave_channel(1, 0) },
				 &lost) == NULL);
	CHECK(subscriptions_take(&subs, &(struct outbox_message){ .channel = now }, &lost) != NULL);
}
