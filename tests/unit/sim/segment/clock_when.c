/* SPDX-License-Identifier: MIT */
/* When a clock of any rate shows a time, near and years ahead. */
#include "base/prng.h"
#include "harness/test.h"
#include "segment/esc.h"
#include "segment/esc_internal.h"

enum { TIMES = 20000, PPM_MAX = 2000, SHIFT_MAX = 60 };

TEST(clock_when, is_the_first_ns_at_which_the_time_is_there)
{
	static struct esc esc;
	static uint8_t sii[128];
	struct prng prng = { 11 };

	esc_init(&esc, &esc_et1100, sii, sizeof(sii), 0);
	for (unsigned i = 0; i < TIMES; i++) {
		int64_t start_ns = (int64_t)prng_below(&prng, 1000000000);
		int64_t now_ns = start_ns + (int64_t)prng_below(&prng, 5000000);
		double ppm = (prng_unit(&prng) - 0.5) * 2 * PPM_MAX;
		uint64_t ahead =
			prng_below(&prng, UINT64_C(1) << (1 + prng_below(&prng, SHIFT_MAX)));
		uint64_t wanted;
		int64_t at_ns;

		esc_clock_start(&esc, start_ns, prng_below(&prng, UINT64_C(1) << 52), ppm);
		wanted = esc_system_time(&esc, now_ns) + 1 + ahead;
		at_ns = esc_clock_when(&esc, now_ns, wanted);
		CHECK(at_ns > now_ns);
		CHECK(esc_system_time(&esc, at_ns) >= wanted);
		CHECK(esc_system_time(&esc, at_ns - 1) < wanted);
	}
}
