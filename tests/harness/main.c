/* SPDX-License-Identifier: MIT */
/* A file of its own, so that a program with another main() can use the checks, too. */
#include "harness/test.h"

#include <errno.h>
#include <signal.h>
#include <sys/time.h>
#include <unistd.h>

#define EXIT_ALL_SKIPPED 77
#define CPU_SECONDS_DEFAULT 120

static const char *running = "";

/* Only calls that a signal handler may make. */
static void write_text(const char *text)
{
	if (write(STDERR_FILENO, text, strlen(text)) < 0) {
		_exit(1);
	}
}

static void on_limit(int number)
{
	(void)number;
	write_text(running);
	write_text(": the limit of CPU time is reached (ECDAQ_TEST_CPU_SECONDS)\n");
	_exit(1);
}

/* CPU time of all threads, so that a test on a loaded machine has as long as on an idle one. */
static void limit_cpu_time(const struct test *t)
{
	const char *env = getenv("ECDAQ_TEST_CPU_SECONDS");
	long seconds = env == NULL ? CPU_SECONDS_DEFAULT : strtol(env, NULL, 10);
	struct itimerval limit = { .it_value.tv_sec = seconds };
	struct sigaction action = { .sa_handler = on_limit };

	running = t->name;
	sigaction(SIGPROF, &action, NULL);
	if (seconds <= 0 || setitimer(ITIMER_PROF, &limit, NULL) < 0) {
		test_fail(__FILE__, __LINE__,
			  "ECDAQ_TEST_CPU_SECONDS: '%s' is not a number of seconds",
			  env == NULL ? "" : env);
	}
}

static int is_chosen(const struct test *t, int argc, char **argv)
{
	for (int i = 1; i < argc; i++) {
		if (strcmp(argv[i], t->name) == 0) {
			return 1;
		}
	}
	return argc < 2;
}

int main(int argc, char **argv)
{
	unsigned passed = 0;
	unsigned skipped = 0;

	for (const struct test *t = test_first(); t != NULL; t = t->next) {
		if (!is_chosen(t, argc, argv)) {
			continue;
		}
		limit_cpu_time(t);
		if (test_run(t) == TEST_SKIPPED) {
			skipped++;
			continue;
		}
		printf("passed: %s\n", t->name);
		passed++;
	}
	if (passed + skipped == 0) {
		fprintf(stderr, "no such test\n");
		return 1;
	}
	if (argc < 2) {
		printf("%u passed, %u skipped\n", passed, skipped);
	}
	if (skipped > 0) {
		/* What a test held when it was skipped is not a leak. */
		fflush(NULL);
		_exit(passed == 0 ? EXIT_ALL_SKIPPED : 0);
	}
	return 0;
}
