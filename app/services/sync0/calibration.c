/* SPDX-License-Identifier: MIT */
#include "sync0/calibration.h"

#include <errno.h>
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "config/config.h"
#include "sync0/statistics.h"

enum { LINE_BYTES = 256 };

#define NEAR_SHARE 4 /* of the period: edges of the two lines within it are of one pulse */

static int64_t median_step(const int64_t *at_ns, size_t count, int64_t *scratch)
{
	for (size_t i = 1; i < count; i++) {
		scratch[i - 1] = at_ns[i] - at_ns[i - 1];
	}
	return statistics_median(scratch, count - 1);
}

/* Second minus first, of the pulses that both have. */
static size_t pair_up(const int64_t *first_ns, size_t first_count, const int64_t *second_ns,
		      size_t second_count, int64_t near_ns, int64_t *ret_off_ns)
{
	size_t n = 0;
	size_t j = 0;

	for (size_t i = 0; i < first_count; i++) {
		while (j < second_count && second_ns[j] < first_ns[i] - near_ns) {
			j++;
		}
		if (j < second_count && second_ns[j] <= first_ns[i] + near_ns) {
			ret_off_ns[n++] = second_ns[j++] - first_ns[i];
		}
	}
	return n;
}

/* Spread of one line's intervals; those across a missing pulse are left out. */
static void spread(const int64_t *at_ns, size_t count, int64_t period_ns, int64_t *scratch,
		   struct judge_noise *noise)
{
	double squares = 0;
	double mean;
	size_t n = 0;
	int64_t sum = 0;

	for (size_t i = 1; i < count; i++) {
		int64_t off_ns = at_ns[i] - at_ns[i - 1] - period_ns;

		if (llabs(off_ns) < period_ns / 2) {
			scratch[n++] = off_ns;
			sum += off_ns;
		}
	}
	if (n < 2) {
		return;
	}
	mean = (double)sum / (double)n;
	for (size_t i = 0; i < n; i++) {
		double off = (double)scratch[i] - mean;

		squares += off * off;
		scratch[i] = llabs(llround(off));
	}
	statistics_sort(scratch, n);
	noise->sd_ns = llround(fmax((double)noise->sd_ns, sqrt(squares / (double)(n - 1))));
	noise->p99_ns = llround(
		fmax((double)noise->p99_ns, (double)statistics_percentile(scratch, n, 990000)));
	noise->max_ns = llround(fmax((double)noise->max_ns, (double)scratch[n - 1]));
}

static void bias(int64_t *off_ns, size_t count, struct judge_noise *noise)
{
	noise->bias_ns = statistics_median(off_ns, count);
	for (size_t i = 0; i < count; i++) {
		off_ns[i] = llabs(off_ns[i] - noise->bias_ns);
	}
	noise->bias_error_ns =
		llround(4 * 1.2533 * 1.4826 * (double)statistics_median(off_ns, count) /
			sqrt((double)count)) +
		1;
}

int calibration_compute(int64_t *first_ns, size_t first_count, int64_t *second_ns,
			size_t second_count, struct calibration *ret, char *why)
{
	struct calibration c = { .noise = { .is_known = 1 } };
	size_t most = first_count > second_count ? first_count : second_count;
	int64_t *scratch;
	int64_t period_ns;

	if (first_count < CALIBRATION_EDGES_MIN || second_count < CALIBRATION_EDGES_MIN) {
		snprintf(why, CALIBRATION_WHY_BYTES,
			 "%zu and %zu edges are too few, %d of each are needed", first_count,
			 second_count, CALIBRATION_EDGES_MIN);
		return -ENODATA;
	}
	scratch = calloc(most, sizeof(scratch[0]));
	if (scratch == NULL) {
		snprintf(why, CALIBRATION_WHY_BYTES, "%s", strerror(ENOMEM));
		return -ENOMEM;
	}
	period_ns = median_step(first_ns, first_count, scratch);
	c.period_ns = (double)(first_ns[first_count - 1] - first_ns[0]) / (double)(first_count - 1);
	c.pairs = period_ns <= 0 ? 0
				 : pair_up(first_ns, first_count, second_ns, second_count,
					   period_ns / NEAR_SHARE, scratch);
	if (c.pairs < CALIBRATION_EDGES_MIN || c.pairs < most / 2) {
		snprintf(why, CALIBRATION_WHY_BYTES,
			 "%" PRIu64 " of %zu edges came on both lines: is it the same signal?",
			 c.pairs, most);
		free(scratch);
		return -ENODATA;
	}
	bias(scratch, c.pairs, &c.noise);
	spread(first_ns, first_count, period_ns, scratch, &c.noise);
	spread(second_ns, second_count, period_ns, scratch, &c.noise);
	free(scratch);
	*ret = c;
	return 0;
}

static int write_all(FILE *out, const struct calibration *c)
{
	fprintf(out,
		"# Noise of this board's GPIO path, ns. Written by ecdaq sync0 calibrate.\n"
		"first: %s\nsecond: %s\npairs: %" PRIu64 "\nperiod: %.3f\nsd: %" PRId64
		"\np99: %" PRId64 "\nmax: %" PRId64 "\nbias: %" PRId64 "\nbias_error: %" PRId64
		"\n",
		c->first, c->second, c->pairs, c->period_ns, c->noise.sd_ns, c->noise.p99_ns,
		c->noise.max_ns, c->noise.bias_ns, c->noise.bias_error_ns);
	return ferror(out) || fflush(out) != 0 || fsync(fileno(out)) < 0 ? -EIO : 0;
}

int calibration_save(const char *path, const struct calibration *c, char *why)
{
	char temporary[CONFIG_PATH_BYTES + 8];
	FILE *out;
	int r;

	snprintf(temporary, sizeof(temporary), "%s.new", path);
	out = fopen(temporary, "we");
	r = out == NULL ? -errno : write_all(out, c);
	if (out != NULL && fclose(out) != 0 && r == 0) {
		r = -errno;
	}
	if (r == 0 && rename(temporary, path) < 0) {
		r = -errno;
	}
	if (r < 0) {
		snprintf(why, CALIBRATION_WHY_BYTES, "%s", strerror(-r));
		if (out != NULL) {
			unlink(temporary);
		}
	}
	return r;
}

static void take_line(char *line, struct calibration *c, unsigned *seen)
{
	const struct {
		const char *key;
		int64_t *field;
	} number[] = {
		{ "sd: ", &c->noise.sd_ns },
		{ "p99: ", &c->noise.p99_ns },
		{ "max: ", &c->noise.max_ns },
		{ "bias: ", &c->noise.bias_ns },
		{ "bias_error: ", &c->noise.bias_error_ns },
	};
	char *newline = strchr(line, '\n');

	if (newline != NULL) {
		*newline = '\0';
	}
	if (strncmp(line, "first: ", 7) == 0) {
		snprintf(c->first, sizeof(c->first), "%.95s", line + 7);
	} else if (strncmp(line, "second: ", 8) == 0) {
		snprintf(c->second, sizeof(c->second), "%.95s", line + 8);
	}
	for (unsigned i = 0; i < sizeof(number) / sizeof(number[0]); i++) {
		size_t len = strlen(number[i].key);
		char *end;
		long long v;

		if (strncmp(line, number[i].key, len) != 0) {
			continue;
		}
		v = strtoll(line + len, &end, 10);
		if (end != line + len && *end == '\0' && llabs(v) < 1000000000) {
			*number[i].field = v;
			*seen |= 1u << i;
		}
	}
}

int calibration_load(const char *path, struct calibration *ret)
{
	struct calibration c = { .noise = { .is_known = 1 } };
	FILE *in = fopen(path, "re");
	char line[LINE_BYTES];
	unsigned seen = 0;

	if (in == NULL) {
		return -errno;
	}
	while (fgets(line, sizeof(line), in) != NULL) {
		take_line(line, &c, &seen);
	}
	fclose(in);
	if (seen != 0x1f || c.noise.sd_ns < 0 || c.noise.p99_ns < 0 || c.noise.max_ns < 0 ||
	    c.noise.bias_error_ns < 0) {
		return -EBADMSG;
	}
	*ret = c;
	return 0;
}
