/* SPDX-License-Identifier: MIT */
#include "harness/test.h"

#include <setjmp.h>
#include <stdarg.h>

static struct test *tests;
static jmp_buf skip_target;
static int can_skip;

void test_register(struct test *t)
{
	t->next = tests;
	tests = t;
}

void test_fail(const char *file, int line, const char *format, ...)
{
	va_list args;

	fprintf(stderr, "%s:%d: ", file, line);
	va_start(args, format);
	vfprintf(stderr, format, args);
	va_end(args);
	fputc('\n', stderr);
	exit(1);
}

void test_skip(const char *why)
{
	printf("skipped: %s\n", why);
	if (!can_skip) {
		exit(77);
	}
	longjmp(skip_target, 1);
}

enum test_result test_run(const struct test *t)
{
	can_skip = 1;
	if (setjmp(skip_target) != 0) {
		return TEST_SKIPPED;
	}
	t->run();
	return TEST_PASSED;
}

const struct test *test_first(void)
{
	return tests;
}
