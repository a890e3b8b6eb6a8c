/* SPDX-License-Identifier: MIT */
/* ecdaq histogram */
#include "base/histogram.h"

#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "base/args.h"
#include "cli/bars.h"
#include "cli/cli.h"
#include "cli/screen.h"
#include "cli/source.h"
#include "cli/text.h"
#include "program/json.h"

#define GET(field) atomic_load_explicit(&(field), memory_order_relaxed)

/* So many rows of bars an octave: each holds a quarter of it. */
enum { ROWS_PER_OCTAVE = 4, BUCKETS_PER_ROW = (1 << HISTOGRAM_SUB_BITS) / ROWS_PER_OCTAVE };
/* Columns before a bar. */
enum { BAR_INDENT = 43 };
enum { ROWS = HISTOGRAM_BUCKETS / BUCKETS_PER_ROW };

static const struct histogram *find(const struct status_page *page, const char *name)
{
	const struct cycle_stats *st = &page->cycle;
	const struct {
		const char *name;
		const struct histogram *histogram;
	} known[] = { { "wake", &st->wake_latency },
		      { "round-trip", &st->round_trip },
		      { "phase", &st->phase },
		      { "work", &st->work },
		      { "control", &page->control.time } };

	for (size_t i = 0; i < sizeof(known) / sizeof(known[0]); i++) {
		if (strcmp(known[i].name, name) == 0) {
			return known[i].histogram;
		}
	}
	return NULL;
}

struct rows {
	uint64_t count[ROWS];
	uint64_t total;
	uint64_t largest;
	unsigned first; /* with anything in it */
	unsigned last;
};

static void gather(const struct histogram *h, struct rows *ret)
{
	struct rows rows = { .first = ROWS };

	for (unsigned row = 0; row < ROWS; row++) {
		for (unsigned b = 0; b < BUCKETS_PER_ROW; b++) {
			rows.count[row] += GET(h->bucket[row * BUCKETS_PER_ROW + b]);
		}
		rows.total += rows.count[row];
		rows.largest = rows.count[row] > rows.largest ? rows.count[row] : rows.largest;
		if (rows.count[row] > 0) {
			rows.first = rows.first == ROWS ? row : rows.first;
			rows.last = row;
		}
	}
	*ret = rows;
}

void bars_print(const struct histogram *h)
{
	int width = screen_size().columns - BAR_INDENT;
	uint64_t below = 0;
	struct rows rows;
	char from[TEXT_BYTES];
	char to[TEXT_BYTES];

	gather(h, &rows);
	if (rows.total == 0) {
		puts("no values yet");
		return;
	}
	width = width < 10 ? 10 : width;
	printf("%10s   %10s %10s %6s  bars: logarithmic\n", "from", "below", "count", "up to");
	for (unsigned row = rows.first; row <= rows.last; row++) {
		/* One value must be seen next to a million. */
		double share = log1p((double)rows.count[row]) / log1p((double)rows.largest);
		int bar = rows.count[row] == 0 ? 0 : (int)lround(share * width);

		below += rows.count[row];
		printf("%10s   %10s %10" PRIu64 " %5.1f%%  ",
		       text_ns(histogram_bucket_floor(row * BUCKETS_PER_ROW), from),
		       text_ns(histogram_bucket_floor((row + 1) * BUCKETS_PER_ROW), to),
		       rows.count[row], 100.0 * (double)below / (double)rows.total);
		for (int i = 0; i < (bar == 0 && rows.count[row] > 0 ? 1 : bar); i++) {
			putchar('#');
		}
		putchar('\n');
	}
	printf("%" PRIu64 " values, p50 %s, ", rows.total,
	       text_ns(histogram_percentile(h, 500000), from));
	printf("p99.9 %s, largest %s\n", text_ns(histogram_percentile(h, 999000), from),
	       text_ns(histogram_max_magnitude(h), to));
}

static void print_json(const struct histogram *h, const char *name)
{
	struct json js;

	json_init(&js, stdout);
	json_object_begin(&js, NULL);
	json_text(&js, "histogram", name);
	json_u64(&js, "count", GET(h->count));
	json_i64(&js, "min_ns", GET(h->min_ns));
	json_i64(&js, "max_ns", GET(h->max_ns));
	json_i64(&js, "sum_ns", GET(h->sum_ns));
	json_i64(&js, "p50_ns", histogram_percentile(h, 500000));
	json_i64(&js, "p99_ns", histogram_percentile(h, 990000));
	json_i64(&js, "p999_ns", histogram_percentile(h, 999000));
	json_array_begin(&js, "bucket");
	for (unsigned b = 0; b < HISTOGRAM_BUCKETS; b++) {
		if (GET(h->bucket[b]) == 0) {
			continue;
		}
		json_object_begin(&js, NULL);
		json_i64(&js, "from_ns", histogram_bucket_floor(b));
		json_i64(&js, "below_ns", histogram_bucket_floor(b + 1));
		json_u64(&js, "count", GET(h->bucket[b]));
		json_object_end(&js);
	}
	json_array_end(&js);
	json_object_end(&js);
	json_end_line(&js);
}

enum exit_code verb_histogram(struct cli *cli, int argc, char **argv)
{
	int is_json = 0;
	const struct args_option options[] = {
		{ "json", 0, args_flag, &is_json, NULL, "all buckets as one JSON object" },
	};
	struct args args = {
		.options = options, .option_count = 1, .operands_min = 1, .operands_max = 1
	};
	const struct status_page *page;
	const struct histogram *h;
	enum exit_code result;

	if (!cli_parse(cli, &args, argc, argv, &result)) {
		return result;
	}
	result = source_status(cli, &page);
	if (result != EXIT_CODE_OK) {
		return result;
	}
	h = find(page, args.operands[0]);
	if (h == NULL) {
		result = cli_fail(cli, EXIT_CODE_USAGE,
				  "%s: expected wake, round-trip, phase, work or control",
				  args.operands[0]);
	} else if (is_json) {
		print_json(h, args.operands[0]);
	} else {
		bars_print(h);
	}
	source_status_close(page);
	return result;
}
