/* SPDX-License-Identifier: MIT */
/*
 * A test is a sentence about behaviour. TEST(module, sentence) registers itself; the program runs
 * every test, or those named on its command line. A failed CHECK prints both values and ends the
 * test program with 1. SKIP(reason) ends the test; the program exits with 77, which ctest counts as
 * skipped, if no test ran to its end.
 */
#ifndef TESTS_HARNESS_TEST_H
#define TESTS_HARNESS_TEST_H

#include <inttypes.h>
#include <setjmp.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct test {
	const char *name;
	void (*run)(void);
	struct test *next;
};

void test_register(struct test *t);
const struct test *test_first(void);
void test_fail(const char *file, int line, const char *format, ...)
	__attribute__((noreturn, format(printf, 3, 4)));
void test_skip(const char *reason) __attribute__((noreturn));

/* Where test_skip() continues; NULL: it ends the program. */
extern jmp_buf *test_after_skip;

#define TEST(module, sentence)                                                                     \
	static void test_##module##_##sentence(void);                                              \
	__attribute__((constructor)) static void test_register_##module##_##sentence(void)         \
	{                                                                                          \
		static struct test t = { #module "." #sentence, test_##module##_##sentence,        \
					 NULL };                                                   \
		test_register(&t);                                                                 \
	}                                                                                          \
	static void test_##module##_##sentence(void)

#define CHECK(condition)                                                                           \
	do {                                                                                       \
		if (!(condition)) {                                                                \
			test_fail(__FILE__, __LINE__, "%s", #condition);                           \
		}                                                                                  \
	} while (0)

#define CHECK_EQ(got, wanted)                                                                      \
	do {                                                                                       \
		long long got_ = (long long)(got);                                                 \
		long long wanted_ = (long long)(wanted);                                           \
		if (got_ != wanted_) {                                                             \
			test_fail(__FILE__, __LINE__, "%s is %lld (0x%llx), wanted %s = %lld",     \
				  #got, got_, (unsigned long long)got_, #wanted, wanted_);         \
		}                                                                                  \
	} while (0)

#define CHECK_STR(got, wanted)                                                                     \
	do {                                                                                       \
		const char *got_ = (got);                                                          \
		const char *wanted_ = (wanted);                                                    \
		if (strcmp(got_, wanted_) != 0) {                                                  \
			test_fail(__FILE__, __LINE__, "%s is \"%s\", wanted \"%s\"", #got, got_,   \
				  wanted_);                                                        \
		}                                                                                  \
	} while (0)

#define CHECK_MEM(got, wanted, len)                                                                \
	do {                                                                                       \
		if (memcmp((got), (wanted), (len)) != 0) {                                         \
			test_fail(__FILE__, __LINE__, "%s differs from %s", #got, #wanted);        \
		}                                                                                  \
	} while (0)

#define SKIP(reason) test_skip(reason)

#endif
