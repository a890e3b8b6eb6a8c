/* SPDX-License-Identifier: MIT */
/*
 * What other programs of ours print: recordings as CSV by `ecdaq-log export`, figures, settings
 * and checks by `ecdaq`. Each runs at low priority and is read from a pipe: whatever it reads, the
 * server and its other clients do not wait for it. Context: one thread; nothing blocks.
 */
#ifndef WEB_EXPORTS_H
#define WEB_EXPORTS_H

#include <stddef.h>
#include <sys/types.h>

enum { EXPORTS_AT_A_TIME = 2 };

/* All zero: none runs. */
struct exports {
	struct export_process {
		pid_t pid; /* 0: free */
		int is_stopped;
	} process[EXPORTS_AT_A_TIME];
};

/* Where standard error of a program goes. */
enum exports_errors { EXPORTS_ERRORS_TO_LOG, EXPORTS_ERRORS_TO_PIPE };

/**
 * Begin to run @words: one of our programs, its arguments, NULL; its environment is empty. The
 * number of the process, and in @ret_fd the pipe with what it prints, which the caller closes and
 * which does not block; -EBUSY: there are as many as there may be; or -errno.
 */
int exports_start(struct exports *e, char *const words[], enum exports_errors errors, int *ret_fd);
/** After the end of its pipe. 1: it is complete, with an exit code of at most @good_exit; 0: ask
 * again; -EIO: it failed, and said why on standard error. With 1 and -EIO @number is free. */
int exports_finish(struct exports *e, int number, int good_exit);
/** End it, what it prints is not needed. */
void exports_stop(struct exports *e, int number);
/** Those that were stopped are gone after a moment: call it now and then. */
void exports_reap(struct exports *e);
/** Stop all. */
void exports_done(struct exports *e);

#endif
