/* SPDX-License-Identifier: MIT */
/* A file of its own, so that a program with another main() can use the checks, too. */
#include "harness/test.h"

enum { ALL_SKIPPED = 77 };

static jmp_buf after_skip;

/* 1 if it ran to its end, 0 if it was skipped. A failure does not return. */
static int run(const struct test *t)
{
	test_after_skip = &after_skip;
	if (setjmp(after_skip) != 0) {
		return 0;
	}
	t->run();
	printf("passed: %s\n", t->name);
	return 1;
}

int main(int argc, char **argv)
{
	int found = 0;
	int passed = 0;

	for (const struct test *t = test_first(); t != NULL; t = t->next) {
		int wanted = argc < 2;

		for (int i = 1; i < argc; i++) {
			wanted |= strcmp(argv[i], t->name) == 0;
		}
		if (wanted) {
			found++;
			passed += run(t);
		}
	}
	if (found == 0) {
		fprintf(stderr, "no such test\n");
		return 1;
	}
	return passed > 0 ? 0 : ALL_SKIPPED;
}
