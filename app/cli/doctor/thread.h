/* SPDX-License-Identifier: MIT */
/* The threads of a machine, from /proc. Context: blocking. */
#ifndef CLI_DOCTOR_THREAD_H
#define CLI_DOCTOR_THREAD_H

#include <stdint.h>

#include "cli/doctor/check.h"

enum { THREAD_FIFO = 1, THREAD_RR = 2 }; /* SCHED_ of sched.h */

/** One line of /proc/PID/task/TID/stat. 0 or -EBADMSG. All but pid and cores is filled. */
int thread_parse_stat(const char *line, struct thread *ret);

/** The thread @tid of @pid; -ENOENT when it has ended. */
int thread_read(const struct probe *p, int64_t pid, int64_t tid, struct thread *ret);

/** Calls @each for all threads of process @pid, or of all processes with @pid 0. 0 or -errno. */
int thread_each(const struct probe *p, int64_t pid,
		void (*each)(void *ctx, const struct thread *thread), void *ctx);

/** "SCHED_FIFO 80", "SCHED_OTHER". */
const char *thread_policy(const struct thread *thread, char buf[32]);

#endif
