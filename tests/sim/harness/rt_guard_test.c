/* SPDX-License-Identifier: MIT */
/* The guard itself: a check that cannot fail is none. */
#include "sim/harness/rt_guard.h"

#include <fcntl.h>
#include <pthread.h>
#include <signal.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include "harness/test.h"

static uint64_t count;
static const char *last = "";
static void *volatile memory;

static void begin(void)
{
	count = 0;
	last = "";
	rt_guard_count_to(&count, &last);
	rt_guard_arm();
}

static void end(void)
{
	rt_guard_disarm();
	rt_guard_count_to(NULL, NULL);
}

TEST(rt_guard, allocation_is_caught)
{
	begin();
	memory = malloc(10);
	end();
	CHECK_EQ(count, 1);
	CHECK_STR(last, "malloc");
	begin();
	free(memory);
	end();
	CHECK_STR(last, "free");
	begin();
	memory = calloc(1, 10);
	memory = realloc(memory, 20);
	end();
	CHECK_EQ(count, 2);
	free(memory);
}

TEST(rt_guard, locks_are_caught)
{
	static pthread_mutex_t mutex = PTHREAD_MUTEX_INITIALIZER;

	begin();
	pthread_mutex_lock(&mutex);
	end();
	pthread_mutex_unlock(&mutex);
	CHECK_EQ(count, 1);
	CHECK_STR(last, "pthread_mutex_lock");
}

TEST(rt_guard, file_calls_are_caught)
{
	char byte;
	int fd;

	begin();
	fd = open("/dev/null", O_RDWR);
	CHECK_STR(last, "open");
	CHECK_EQ(read(fd, &byte, 1), 0);
	CHECK_STR(last, "read");
	CHECK_EQ(write(fd, "x", 1), 1);
	CHECK_STR(last, "write");
	close(fd);
	end();
	CHECK_EQ(count, 4);
}

TEST(rt_guard, text_and_sleep_are_caught)
{
	static const struct timespec none;
	char text[8];
	volatile int number = 7;

	begin();
	snprintf(text, sizeof(text), "%d", number);
	CHECK_STR(last, "snprintf");
	fputs(text + 1, stderr); /* an empty one */
	CHECK_STR(last, "fputs");
	nanosleep(&none, NULL);
	end();
	CHECK_STR(last, "nanosleep");
}

TEST(rt_guard, nothing_is_caught_while_it_is_disarmed_or_on_another_thread)
{
	begin();
	rt_guard_disarm();
	memory = malloc(10);
	free(memory);
	CHECK_EQ(count, 0);
	CHECK_EQ(rt_guard_is_armed(), 0);
	rt_guard_arm();
	CHECK_EQ(rt_guard_is_armed(), 1);
	end();
}

TEST(rt_guard, a_breach_ends_the_program)
{
	pid_t child = fork();
	int status = 0;

	CHECK(child >= 0);
	if (child == 0) {
		int quiet = open("/dev/null", O_WRONLY);

		dup2(quiet, STDERR_FILENO);
		rt_guard_arm();
		memory = malloc(10);
		_exit(0);
	}
	CHECK_EQ(waitpid(child, &status, 0), child);
	CHECK(WIFSIGNALED(status) && WTERMSIG(status) == SIGABRT);
}
