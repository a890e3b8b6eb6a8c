/* SPDX-License-Identifier: MIT */
/* A file of its own, so that a program with another main() can use the checks, too. */
#include "harness/test.h"

int main(int argc, char **argv)
{
	int ran = 0;

	for (const struct test *t = test_first(); t != NULL; t = t->next) {
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
