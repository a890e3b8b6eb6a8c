/* SPDX-License-Identifier: MIT */
/* SIGTERM and SIGINT, which stop a program in order. Once in a process. */
#ifndef BASE_STOP_H
#define BASE_STOP_H

#include <signal.h>
#include <stdint.h>

/* Another signal, however late, is ignored. */
#define STOP_REPEAT_IGNORED INT64_MAX

/**
 * Catch both from now on; the first calls @notify (NULL: none), in the signal handler. Another one
 * @grace_ns later or after that ends the process, in case the stop is stuck; before, it is ignored.
 * Context: main thread, before others are started.
 */
void stop_catch(int64_t grace_ns, void (*notify)(void));
/** Block them, but in stop_wait(): none is missed between the question and the wait. */
void stop_block(void);
/** 1 after one came. Context: any. */
int stop_requested(void);
/** The same, for calls that poll it. */
const volatile sig_atomic_t *stop_flag(void);
/** Wait for @wait_ns or a signal. Context: main thread. */
void stop_wait(int64_t wait_ns);

#endif
