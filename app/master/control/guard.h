/* SPDX-License-Identifier: MIT */
/*
 * Calls a foreign function so that SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGTRAP or SIGABRT inside it
 * becomes a return value, once. The memory of this process may be corrupt by then: on a crash the
 * caller sets the outputs to fail-safe and ends the process. The same signals elsewhere end the
 * process, as usual.
 */
#ifndef CONTROL_GUARD_H
#define CONTROL_GUARD_H

#include <setjmp.h>
#include <signal.h>
#include <stdint.h>

enum { GUARD_STACK_BYTES = 64 * 1024 };

struct guard {
	sigjmp_buf back;
	int number; /* of the signal that came; 0: none */
	uintptr_t address;
	stack_t old_stack;
	sigset_t old_mask;
	int is_entered;
	_Alignas(16) uint8_t stack[GUARD_STACK_BYTES]; /* a stack that ran over cannot be used */
};

/** Take the signals' handlers for this process, and give them back. Context: blocking. */
int guard_install(void);
void guard_remove(void);

/** Signal stack and mask of the calling thread, and back. Context: the thread that will call. */
void guard_enter(struct guard *guard);
void guard_leave(struct guard *guard);

/** Call @fn(@ctx). 0, or -EFAULT with number and address in @guard. RT-safe if @fn is. */
int guard_call(struct guard *guard, void (*fn)(void *ctx), void *ctx);

#endif
