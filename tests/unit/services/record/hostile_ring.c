/* SPDX-License-Identifier: MIT */
/* Rings that another member of the group truncates or overwrites while they are recorded. */
#include <string.h>
#include <unistd.h>

#include "base/clock.h"
#include "base/sync0.h"
#include "harness/made_ring.h"
#include "harness/test.h"
#include "unit/services/record/bench.h"

static void check_recorded(struct bench *b, uint64_t least)
{
	unsigned finished;
	unsigned parts;
	struct track t = bench_read(b, &finished, &parts);

	CHECK_EQ(t.gaps, 0);
	CHECK(t.cycles >= least);
	CHECK_EQ(finished, 1);
	CHECK_EQ(parts, 0);
}

TEST(recorder, a_sample_ring_truncated_while_it_is_recorded_ends_the_session)
{
	struct bench b = { .calls = 0 };

	bench_init(&b, 100, 8192);
	bench_push(&b, 0, 1000);
	CHECK_EQ(bench_start(&b), 0);
	bench_run(&b);
	made_truncate(b.ring_path, 64); /* its header is cut, too */
	bench_wait(&b, NS_PER_S);
	CHECK(strstr(b.said, "ended: ring damaged") != NULL);
	CHECK(strstr(b.said, "truncated or overwritten while it was read") != NULL);
	made_truncate(b.ring_path, 1 << 21); /* the master's pages */
	CHECK_EQ(bench_stop(&b), 0);
	check_recorded(&b, 1000);
	bench_done(&b);
}

static struct ring *make_results(const char *path)
{
	const struct ring_spec spec = { .path = path,
					.kind = "sync0",
					.payload_bytes = sizeof(struct sync0_result),
					.slot_count = 256,
					.file_mode = 0600 };
	struct ring *ring = NULL;

	CHECK_EQ(ring_create(&spec, &ring), 0);
	for (int i = 0; i < 200; i++) {
		struct sync0_result result = { .mono_ns = i, .session = 100 };

		ring_push(ring, &result, sizeof(result), NULL, 0);
	}
	return ring;
}

/* @is_truncated: the ring of results is truncated, else the size of its records is raised. */
static void record_beside(int is_truncated)
{
	struct bench b = { .calls = 0 };
	uint32_t large = 8000;
	char path[BENCH_PATH_BYTES + 16];
	struct ring *results;

	bench_init(&b, 100, 8192);
	snprintf(path, sizeof(path), "%s/sync0", b.root);
	results = make_results(path);
	b.options.sync0_path = path;
	bench_push(&b, 0, 500);
	CHECK_EQ(bench_start(&b), 0);
	bench_run(&b);
	if (is_truncated) {
		made_truncate(path, 4096);
	} else {
		made_overwrite(path, MADE_PAYLOAD_BYTES, &large, sizeof(large));
	}
	bench_push(&b, 500, 500);
	bench_wait(&b, NS_PER_S);
	if (is_truncated) {
		made_truncate(path, 1 << 20);
	}
	CHECK_EQ(bench_stop(&b), 0);
	ring_destroy(results);
	unlink(path);
	check_recorded(&b, 1000);
	bench_done(&b);
}

TEST(recorder, a_truncated_ring_of_results_does_not_disturb_the_samples)
{
	record_beside(1);
}

TEST(recorder, a_ring_of_results_whose_records_grow_does_not_disturb_the_samples)
{
	record_beside(0);
}
