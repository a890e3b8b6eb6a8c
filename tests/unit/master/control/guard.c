/* SPDX-License-Identifier: MIT */
#include "control/guard.h"

#include <errno.h>
#include <pthread.h>
#include <stdatomic.h>

#include "harness/test.h"

enum { THREADS = 2, FAULTS = 200 };

struct faulty {
	struct guard guard;
	int number;
	unsigned caught;
	unsigned passed;
};

static void raise_signal(void *ctx)
{
	struct faulty *f = ctx;

	raise(f->number);
}

static void do_nothing(void *ctx)
{
	(void)ctx;
}

static void *fault_again_and_again(void *arg)
{
	struct faulty *f = arg;

	guard_enter(&f->guard);
	for (int i = 0; i < FAULTS; i++) {
		f->guard.number = 0;
		if (guard_call(&f->guard, raise_signal, f) == -EFAULT &&
		    f->guard.number == f->number) {
			f->caught++;
		}
		if (guard_call(&f->guard, do_nothing, f) == 0) {
			f->passed++;
		}
	}
	guard_leave(&f->guard);
	return NULL;
}

TEST(control_guard, a_fault_is_returned_to_the_thread_that_made_it)
{
	static struct faulty faulty[THREADS] = { { .number = SIGFPE }, { .number = SIGILL } };
	pthread_t thread[THREADS];

	CHECK_EQ(guard_install(), 0);
	for (int i = 0; i < THREADS; i++) {
		CHECK_EQ(pthread_create(&thread[i], NULL, fault_again_and_again, &faulty[i]), 0);
	}
	for (int i = 0; i < THREADS; i++) {
		pthread_join(thread[i], NULL);
		CHECK_EQ(faulty[i].caught, FAULTS);
		CHECK_EQ(faulty[i].passed, FAULTS);
	}
	guard_remove();
}

TEST(control_guard, leaving_restores_the_signal_stack_and_the_mask_of_the_thread)
{
	static struct guard guard;
	stack_t before;
	stack_t after;
	sigset_t set;
	sigset_t old;

	sigemptyset(&set);
	sigaddset(&set, SIGFPE);
	CHECK_EQ(pthread_sigmask(SIG_BLOCK, &set, NULL), 0);
	CHECK_EQ(sigaltstack(NULL, &before), 0);
	guard_enter(&guard);
	CHECK_EQ(sigaltstack(NULL, &after), 0);
	CHECK(after.ss_sp == guard.stack);
	guard_leave(&guard);
	CHECK_EQ(sigaltstack(NULL, &after), 0);
	CHECK(after.ss_sp == before.ss_sp);
	CHECK_EQ(pthread_sigmask(SIG_UNBLOCK, &set, &old), 0);
	CHECK(sigismember(&old, SIGFPE));
}
