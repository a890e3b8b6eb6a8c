/* SPDX-License-Identifier: MIT */
#include "harness/test.h"

#include <stdarg.h>

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

void test_skip(const char *why)
{
	printf("skipped: %s\n", why);
	exit(77);
}

int main(int argc, char **argv)
{
	int ran = 0;

	for (struct test *t = tests; t != NULL; t = t->next) {
		int wanted = argc < 2;

		for (int i = 1; i < argc; i++) {
			wanted |= strcmp(argv[i], t->name) == 0;
		}
		if (wanted) {
			t->run();
			printf("passed: %s\n", t->name);
			ran++;
		}
	}
	if (ran == 0) {
		fprintf(stderr, "no such test\n");
		return 1;
	}
	return 0;
}
