/* SPDX-License-Identifier: MIT */
#include "harness/test.h"

#include <stdarg.h>

jmp_buf *test_after_skip;

static struct test *tests;

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

void test_skip(const char *reason)
{
	printf("skipped: %s\n", reason);
	if (test_after_skip != NULL) {
		longjmp(*test_after_skip, 1);
	}
	exit(77);
}

const struct test *test_first(void)
{
	return tests;
}
