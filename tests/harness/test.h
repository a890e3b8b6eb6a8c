/* SPDX-License-Identifier: MIT */
/*
 * A test is a sentence about behaviour. TEST(module, sentence) registers itself; the program runs
 * every test, or those named on its command line. A failed CHECK prints both values and ends the
 * test program with 1, and so does a test that uses more CPU time than ECDAQ_TEST_CPU_SECONDS
 * (default: 120). SKIP(why) ends the test, from the thread that runs it; a program whose tests were
 * all skipped ends with 77, which ctest counts as skipped.
 */
#ifndef TESTS_HARNESS_TEST_H
#define TESTS_HARNESS_TEST_H

#include <inttypes.h>
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

enum test_result { TEST_PASSED, TEST_SKIPPED };

void test_register(struct test *t);
enum test_result test_run(const struct test *t);
const struct test *test_first(void);
void test_fail(const char *file, int line, const char *format, ...)
	__attribute__((noreturn, format(printf, 3, 4)));
void test_skip(const char *why) __attribute__((noreturn));

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

#define CHECK_EQ(got, expected)                                                                    \
	do {                                                                                       \
		long long got_ = (long long)(got);                                                 \
		long long expected_ = (long long)(expected);                                       \
		if (got_ != expected_) {                                                           \
			test_fail(__FILE__, __LINE__, "%s is %lld (0x%llx), expected %s = %lld",   \
				  #got, got_, (unsigned long long)got_, #expected, expected_);     \
		}                                                                                  \
	} while (0)

#define CHECK_STR(got, expected)                                                                   \
	do {                                                                                       \
		const char *got_ = (got);                                                          \
		const char *expected_ = (expected);                                                \
		if (strcmp(got_, expected_) != 0) {                                                \
			test_fail(__FILE__, __LINE__, "%s is \"%s\", expected \"%s\"", #got, got_, \
				  expected_);                                                      \
		}                                                                                  \
	} while (0)

#define CHECK_MEM(got, expected, len)                                                              \
	do {                                                                                       \
		if (memcmp((got), (expected), (len)) != 0) {                                       \
			test_fail(__FILE__, __LINE__, "%s differs from %s", #got, #expected);      \
		}                                                                                  \
	} while (0)

#define SKIP(why) test_skip(why)

#endif
