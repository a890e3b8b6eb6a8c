/* SPDX-License-Identifier: MIT */
#include "cycle/check.h"

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

void check_restart_some(struct check *check, uint64_t slaves)
{
	for (size_t i = 0; i < check->slave_count; i++) {
		if (slaves >> i & 1) {
			check->slave[i].has_last = 0;
		}
	}
}

void check_restart(struct check *check)
{
	check_restart_some(check, UINT64_MAX);
}

static int counter_is_right(const struct check_slave *s, uint64_t seen, uint64_t cycle,
			    uint64_t *ret_expected)
{
	uint64_t mask =
		s->counter->bit_len >= 64 ? UINT64_MAX : (UINT64_C(1) << s->counter->bit_len) - 1;
	uint64_t edges = s->is_oneshot ? 1 : cycle - s->last_cycle;

	*ret_expected = (s->last + edges) & mask;
	return !s->has_last || seen == *ret_expected || (s->is_oneshot && seen == s->last);
}

uint64_t check_image(struct check *check, const uint8_t *image, uint64_t cycle, uint64_t stale,
		     struct check_fault *ret_fault)
{
	uint64_t bad = 0;

	for (size_t i = 0; i < check->slave_count; i++) {
		struct check_slave *s = &check->slave[i];
		uint64_t expected;
		uint64_t seen;

		if (s->counter == NULL || (stale >> i & 1) != 0) {
			continue;
		}
		seen = image_get_raw(image, s->counter);
		if (!counter_is_right(s, seen, cycle, &expected)) {
			if (bad == 0) {
				*ret_fault = (struct check_fault){ .slave_pos = (uint16_t)i,
								   .seen = seen,
								   .expected = expected };
			}
			bad |= UINT64_C(1) << i;
		}
		s->has_last = 1;
		s->last = seen;
		s->last_cycle = cycle;
	}
	return bad;
}
