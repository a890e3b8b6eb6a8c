/* SPDX-License-Identifier: MIT */
#include "loop.h"

#include <inttypes.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <time.h>

static int64_t read_number(const char *name, const char *text)
{
	char *end;
	long long number = strtoll(text, &end, 10);

	if (end == text || *end != '\0' || number < 0 || number > 1000 * LOOP_NS_PER_S) {
		fprintf(stderr, "%s: '%s' is not a number\n", name, text);
		exit(2);
	}
	return number;
}

struct loop_options loop_read_options(int argc, char **argv)
{
	if (argc != 8) {
		fprintf(stderr, "usage: %s " LOOP_ARGUMENTS "\n", argv[0]);
		exit(2);
	}
	return (struct loop_options){ .nic = argv[1],
				      .period_ns = read_number("PERIOD_NS", argv[2]),
				      .settle = read_number("SETTLE", argv[3]),
				      .cycles = read_number("CYCLES", argv[4]),
				      .limit_ns = read_number("LIMIT_NS", argv[5]),
				      .free_ms = read_number("FREE_MS", argv[6]),
				      .file = argv[7] };
}

int64_t loop_now_ns(void)
{
	struct timespec ts;

	clock_gettime(CLOCK_MONOTONIC, &ts);
	return ts.tv_sec * LOOP_NS_PER_S + ts.tv_nsec;
}

void loop_sleep_until(int64_t deadline_ns)
{
	struct timespec ts = { .tv_sec = deadline_ns / LOOP_NS_PER_S,
			       .tv_nsec = deadline_ns % LOOP_NS_PER_S };

	while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &ts, NULL) != 0) {
	}
}

void loop_print_op(int64_t at_ns)
{
	printf("op %" PRId64 "\n", at_ns);
	fflush(stdout);
}

void loop_print_free(uint64_t answers, int64_t ns)
{
	printf("free %" PRIu64 " %" PRId64 "\n", answers, ns);
	fflush(stdout);
}

void loop_write(const char *file, const struct loop_record *records, size_t count)
{
	FILE *f = fopen(file, "w");

	if (f == NULL || fwrite(records, sizeof(*records), count, f) != count || fclose(f) != 0) {
		perror(file);
		exit(1);
	}
}

/* A function of its own: callgrind counts what runs inside it (--toggle-collect). */
__attribute__((noinline)) int loop_counted(const struct loop *loop);

int loop_counted(const struct loop *loop)
{
	int has_answered = loop->exchange(loop->ctx);

	__asm__ volatile("" ::: "memory"); /* no jump: callgrind would not see it return */
	return has_answered;
}

/* A late cycle does not move the deadlines of the next ones. */
static int64_t run_cycle(const struct loop *loop, int64_t deadline_ns, struct loop_record *ret)
{
	loop_sleep_until(deadline_ns);
	ret->wake_ns = loop_now_ns();
	ret->late_ns = ret->wake_ns - deadline_ns;
	ret->moved_ns = 0;
	ret->has_answered = loop_counted(loop);
	ret->round_ns = loop_now_ns() - ret->wake_ns;
	return loop->correction_ns == NULL ? 0 : loop->correction_ns(loop->ctx);
}

static void run_free(const struct loop *loop, int64_t free_ms)
{
	int64_t start_ns = loop_now_ns();
	int64_t now_ns = start_ns;
	uint64_t answers = 0;

	while (now_ns - start_ns < free_ms * 1000000) {
		answers += loop->exchange(loop->ctx) ? 1 : 0;
		now_ns = loop_now_ns();
	}
	loop_print_free(answers, now_ns - start_ns);
}

void loop_run(const struct loop_options *opt, const struct loop *loop)
{
	struct loop_record *records = calloc((size_t)opt->cycles + 1, sizeof(*records));
	int64_t deadline_ns;

	if (records == NULL) {
		perror("records");
		exit(1);
	}
	if (mlockall(MCL_CURRENT | MCL_FUTURE) != 0) {
		perror("mlockall"); /* as a user without the limit: the cycle may fault */
	}
	loop_print_op(loop_now_ns());
	deadline_ns = loop_now_ns() + opt->period_ns;
	for (int64_t i = -opt->settle; i < opt->cycles; i++) {
		struct loop_record record;

		deadline_ns += opt->period_ns + run_cycle(loop, deadline_ns, &record);
		if (i >= 0) {
			records[i] = record;
		}
	}
	loop_write(opt->file, records, (size_t)opt->cycles);
	if (opt->free_ms > 0) {
		run_free(loop, opt->free_ms);
	}
	free(records);
}
