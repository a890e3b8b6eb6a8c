/* SPDX-License-Identifier: MIT */
#include "sync0/calibration.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

#include "harness/test.h"
#include "unit/services/sync0/bench.h"

enum { EDGES = 20000 };

static int64_t first[EDGES];
static int64_t second[EDGES];
static char why[CALIBRATION_WHY_BYTES];

static void same_signal(int64_t second_behind_ns)
{
	struct prng prng = { .state = 11 };

	for (int i = 0; i < EDGES; i++) {
		int64_t at_ns = BENCH_MONO0_NS + i * BENCH_PERIOD_NS;

		first[i] = at_ns + bench_pi_noise_ns(&prng);
		second[i] = at_ns + second_behind_ns + bench_pi_noise_ns(&prng);
	}
}

TEST(sync0, calibration_finds_the_noise_and_the_order_of_service)
{
	struct calibration c;

	same_signal(1800);
	CHECK_EQ(calibration_compute(first, EDGES, second, EDGES, &c, why), 0);
	CHECK_EQ(c.pairs, EDGES);
	CHECK(c.noise.is_known);
	CHECK(c.noise.sd_ns > 850 && c.noise.sd_ns < 1010);
	CHECK(c.noise.p99_ns > 4800 && c.noise.p99_ns < 5800);
	CHECK(c.noise.max_ns > 5600 && c.noise.max_ns < 14000);
	CHECK(llabs(c.noise.bias_ns - 1800) <= c.noise.bias_error_ns);
	CHECK(c.noise.bias_error_ns < 10);
}

TEST(sync0, calibration_without_the_same_signal_is_refused)
{
	struct calibration c = { .pairs = 77 };

	same_signal(BENCH_PERIOD_NS / 2);
	CHECK_EQ(calibration_compute(first, EDGES, second, EDGES, &c, why), -ENODATA);
	CHECK(strstr(why, "same signal") != NULL);
	CHECK_EQ(calibration_compute(first, EDGES, second, 10, &c, why), -ENODATA);
	CHECK(strstr(why, "too few") != NULL);
	CHECK_EQ(c.pairs, 77);
}

TEST(sync0, calibration_is_read_back_and_a_damaged_file_is_none)
{
	const struct calibration c = { .noise = { .is_known = 1,
						  .sd_ns = 930,
						  .p99_ns = 5180,
						  .max_ns = 12900,
						  .bias_ns = -40,
						  .bias_error_ns = 7 },
				       .pairs = 10000,
				       .first = "GPIO17",
				       .second = "GPIO27" };
	struct calibration back = { .pairs = 1 };
	char path[128];
	FILE *f;

	snprintf(path, sizeof(path), "/tmp/ecdaq-unit-%d-calibration", (int)getpid());
	CHECK_EQ(calibration_save(path, &c, why), 0);
	CHECK_EQ(calibration_load(path, &back), 0);
	CHECK_EQ(back.noise.p99_ns, 5180);
	CHECK_EQ(back.noise.bias_ns, -40);
	CHECK_STR(back.first, "GPIO17");
	CHECK_STR(back.second, "GPIO27");
	f = fopen(path, "we");
	CHECK(f != NULL);
	fputs("sd: 5\np99: many\n", f);
	fclose(f);
	CHECK_EQ(calibration_load(path, &back), -EBADMSG);
	CHECK_EQ(back.noise.p99_ns, 5180);
	unlink(path);
	CHECK_EQ(calibration_load(path, &back), -ENOENT);
	CHECK(calibration_save("/proc/none/here", &c, why) < 0);
}
