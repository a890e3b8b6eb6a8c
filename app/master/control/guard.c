/* SPDX-License-Identifier: MIT */
#include "control/guard.h"

#include <errno.h>
#include <fenv.h>
#include <stdatomic.h>
#include <stddef.h>
#include <unistd.h>

static const int numbers[] = { SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGTRAP, SIGABRT };

enum { NUMBERS = sizeof(numbers) / sizeof(numbers[0]) };

static struct sigaction old_actions[NUMBERS];
static unsigned installed; /* [service] */
/* The guard that is active in this thread. */
static _Thread_local struct guard *_Atomic armed;

static void fill_set(sigset_t *set)
{
	sigemptyset(set);
	for (size_t i = 0; i < NUMBERS; i++) {
		sigaddset(set, numbers[i]);
	}
}

/* From the processor, or by the thread itself (abort, raise); not sent by somebody else. */
static int is_own_fault(const siginfo_t *info)
{
	return info->si_code > 0 || (info->si_code == SI_TKILL && info->si_pid == getpid());
}

/* As if there were no guard: a fault repeats when the handler returns, the others are raised again.
 */
static void fall_through(int number, const siginfo_t *info)
{
	for (size_t i = 0; i < NUMBERS; i++) {
		if (numbers[i] == number) {
			sigaction(number, &old_actions[i], NULL);
		}
	}
	if (info->si_code <= 0) {
		raise(number);
	}
}

static void on_fault(int number, siginfo_t *info, void *context)
{
	struct guard *guard = atomic_load_explicit(&armed, memory_order_relaxed);

	(void)context;
	if (guard == NULL || !is_own_fault(info)) {
		fall_through(number, info);
		return;
	}
	atomic_store_explicit(&armed, NULL, memory_order_relaxed);
	guard->number = number;
	guard->address = (uintptr_t)info->si_addr;
	siglongjmp(guard->back, 1);
}

int guard_install(void)
{
	struct sigaction action = { .sa_sigaction = on_fault, .sa_flags = SA_SIGINFO | SA_ONSTACK };

	if (installed++ > 0) {
		return 0;
	}
	fill_set(&action.sa_mask);
	for (size_t i = 0; i < NUMBERS; i++) {
		if (sigaction(numbers[i], &action, &old_actions[i]) < 0) {
			int r = -errno;

			while (i-- > 0) {
				sigaction(numbers[i], &old_actions[i], NULL);
			}
			installed = 0;
			return r;
		}
	}
	return 0;
}

void guard_remove(void)
{
	if (--installed > 0) {
		return;
	}
	for (size_t i = 0; i < NUMBERS; i++) {
		sigaction(numbers[i], &old_actions[i], NULL);
	}
}

void guard_enter(struct guard *guard)
{
	stack_t stack = { .ss_sp = guard->stack, .ss_size = sizeof(guard->stack) };
	sigset_t set;

	/* A fault while its signal is blocked ends the process silently. */
	fill_set(&set);
	guard->is_entered = sigaltstack(&stack, &guard->old_stack) == 0 &&
			    pthread_sigmask(SIG_UNBLOCK, &set, &guard->old_mask) == 0;
}

void guard_leave(struct guard *guard)
{
	if (guard->is_entered) {
		pthread_sigmask(SIG_SETMASK, &guard->old_mask, NULL);
		sigaltstack(&guard->old_stack, NULL);
		guard->is_entered = 0;
	}
}

static int come_back(void)
{
	sigset_t set;

	/* The handler never returned: its mask and the function's FPU state are still set. */
	fill_set(&set);
	pthread_sigmask(SIG_UNBLOCK, &set, NULL);
	fesetenv(FE_DFL_ENV);
	return -EFAULT;
}

int guard_call(struct guard *guard, void (*fn)(void *ctx), void *ctx)
{
	if (sigsetjmp(guard->back, 0) != 0) {
		return come_back();
	}
	atomic_store_explicit(&armed, guard, memory_order_relaxed);
	atomic_signal_fence(memory_order_seq_cst);
	fn(ctx);
	atomic_signal_fence(memory_order_seq_cst);
	atomic_store_explicit(&armed, NULL, memory_order_relaxed);
	return 0;
}
