/* SPDX-License-Identifier: MIT */
#include "cycle/check.h"

#include "base/slave_set.h"
#include "image/image.h"

void check_init(struct check *check, const struct config *cfg, const struct slave_info *slaves,
		size_t slave_count, const struct channel *channels)
{
	check->slave_count = slave_count;
	for (size_t i = 0; i < slave_count; i++) {
		int32_t channel = slaves[i].counter_channel;
		int is_oneshot = i < cfg->slave_count && cfg->slave[i].mode == CONFIG_MODE_ONESHOT;

		check->slave[i] = (struct check_slave){
			.counter = channel >= 0 ? &channels[channel] : NULL,
			.is_oneshot = is_oneshot,
		};
	}
}

void check_restart_some(struct check *check, const struct slave_set *slaves)
{
	for (unsigned i = slave_set_next(slaves, 0); i < LIMIT_SLAVES;
	     i = slave_set_next(slaves, i + 1)) {
		check->slave[i].has_last = 0;
	}
}

void check_restart(struct check *check)
{
	struct slave_set all = slave_set_all(check->slave_count);

	check_restart_some(check, &all);
}

static int counter_is_right(const struct check_slave *s, uint64_t seen, uint64_t cycle,
			    uint64_t *ret_expected)
{
	uint64_t mask =
		s->counter->bit_len >= 64 ? UINT64_MAX : (UINT64_C(1) << s->counter->bit_len) - 1;
	uint64_t edges = s->is_oneshot ? 1 : cycle - s->last_cycle;

	*ret_expected = (s->last + edges) & mask;
	return seen == *ret_expected || (s->is_oneshot && seen == s->last);
}

static void add_wrong(struct check_result *result, unsigned pos, uint64_t seen, uint64_t expected)
{
	if (slave_set_is_empty(&result->wrong)) {
		result->first = (struct check_fault){ .slave_pos = (uint16_t)pos,
						      .seen = seen,
						      .expected = expected };
	}
	slave_set_add(&result->wrong, pos);
}

struct check_result check_image(struct check *check, const uint8_t *image, uint64_t cycle,
				const struct slave_set *stale)
{
	struct check_result result = { .wrong = slave_set_empty(), .unknown = slave_set_empty() };

	for (size_t i = 0; i < check->slave_count; i++) {
		struct check_slave *s = &check->slave[i];
		uint64_t expected;
		uint64_t seen;

		if (s->counter == NULL || slave_set_has(stale, (unsigned)i)) {
			continue;
		}
		seen = image_get_raw(image, s->counter);
		if (!s->has_last) {
			slave_set_add(&result.unknown, (unsigned)i);
		} else if (!counter_is_right(s, seen, cycle, &expected)) {
			add_wrong(&result, (unsigned)i, seen, expected);
		}
		s->has_last = 1;
		s->last = seen;
		s->last_cycle = cycle;
	}
	return result;
}
