/* SPDX-License-Identifier: MIT */
#include "program/trouble.h"

#include <stdio.h>
#include <string.h>

#include "base/host_clock.h"
#include "harness/test.h"

static unsigned lines;
static char newest[TROUBLE_LINE_BYTES];

static void report(const char *line)
{
	lines++;
	snprintf(newest, sizeof(newest), "%s", line);
}

TEST(trouble, a_problem_is_one_line_until_it_is_another_one_or_over)
{
	struct trouble t;
	char text[2 * TROUBLE_LINE_BYTES];

	lines = 0;
	trouble_init(&t, report, 1, 8);
	CHECK(!trouble_is_over(&t));
	trouble_found(&t, "no answer");
	trouble_found(&t, "no answer");
	CHECK(lines == 1);
	CHECK(strcmp(newest, "no answer") == 0);
	trouble_found(&t, "rejected");
	CHECK(lines == 2);
	CHECK(trouble_is_over(&t));
	CHECK(!trouble_is_over(&t));
	trouble_found(&t, "rejected");
	CHECK(lines == 3);
	/* One that is cut is the same one, too. */
	memset(text, 'x', sizeof(text) - 1);
	text[sizeof(text) - 1] = '\0';
	trouble_found(&t, text);
	trouble_found(&t, text);
	CHECK(lines == 4);
}

TEST(trouble, attempts_are_further_apart_up_to_a_bound_and_start_over)
{
	struct trouble t;
	const int64_t first_ns = 60 * NS_PER_S;
	int64_t wanted_ns = first_ns;

	trouble_init(&t, report, first_ns, 4 * first_ns);
	CHECK(trouble_is_due(&t));
	for (int i = 0; i < 6; i++) {
		int64_t before_ns = host_clock_ns(CLOCK_MONOTONIC);

		trouble_found(&t, "no answer");
		CHECK(!trouble_is_due(&t));
		CHECK(t.due_ns - before_ns >= wanted_ns / 2);
		CHECK(t.due_ns - before_ns <= wanted_ns + NS_PER_S);
		wanted_ns = 2 * wanted_ns > 4 * first_ns ? 4 * first_ns : 2 * wanted_ns;
	}
	CHECK(trouble_is_over(&t));
	CHECK(t.backoff_ns == first_ns);
}
