/* SPDX-License-Identifier: MIT */
#include "bus/error_counters.h"

#include <stdatomic.h>
#include <stddef.h>
#include <string.h>

#define SET(field, v) atomic_store_explicit(&(field), (v), memory_order_relaxed)

int error_counters_take(struct error_counters *ec, unsigned first, const uint8_t *raw,
			unsigned count)
{
	int wants_clear = 0;

	for (unsigned i = 0; i < count; i++) {
		uint8_t *seen = &ec->seen[first + i];

		ec->sum[first + i] += raw[i] >= *seen ? (uint32_t)(raw[i] - *seen) : raw[i];
		ec->is_short |= raw[i] == UINT8_MAX && *seen != UINT8_MAX;
		wants_clear |= raw[i] >= ERROR_CLEAR_AT;
		*seen = raw[i];
	}
	return wants_clear;
}

void error_counters_restart(struct error_counters *ec)
{
	memset(ec->seen, 0, sizeof(ec->seen));
}

void error_counters_show(const struct error_counters *ec, struct slave_status *page)
{
	for (size_t i = 0; i < ESC_PORTS; i++) {
		SET(page->rx_errors[i], ec->sum[2 * i] + ec->sum[2 * i + 1]);
		SET(page->forwarded_errors[i], ec->sum[ERROR_FORWARDED + i]);
		SET(page->lost_links[i], ec->sum[ERROR_LINKS + i]);
	}
	SET(page->processing_errors, ec->sum[ERROR_PROCESSING]);
	SET(page->pdi_errors, ec->sum[ERROR_PDI]);
	SET(page->are_errors_short, (uint32_t)ec->is_short);
}
