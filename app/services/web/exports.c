/* SPDX-License-Identifier: MIT */
#include "web/exports.h"

#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <signal.h>
#include <spawn.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "program/beside.h"

enum { PIPE_BYTES = 256 * 1024, NICE = 10 };

/* Standard output to @out, nothing else that is open here, and the signals as they are by default.
 */
static int spawn(const char *path, char *const words[], enum exports_errors errors, int out,
		 pid_t *ret_pid)
{
	char *environment[] = { NULL };
	posix_spawn_file_actions_t actions;
	posix_spawnattr_t attributes;
	sigset_t none;
	sigset_t all;
	int r;

	sigemptyset(&none);
	sigfillset(&all);
	r = posix_spawn_file_actions_init(&actions);
	if (r != 0) {
		return -r;
	}
	r = posix_spawnattr_init(&attributes);
	if (r != 0) {
		posix_spawn_file_actions_destroy(&actions);
		return -r;
	}
	posix_spawnattr_setsigmask(&attributes, &none);
	posix_spawnattr_setsigdefault(&attributes, &all);
	posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF);
	r = posix_spawn_file_actions_adddup2(&actions, out, STDOUT_FILENO);
	if (r == 0 && errors == EXPORTS_ERRORS_TO_PIPE) {
		r = posix_spawn_file_actions_adddup2(&actions, out, STDERR_FILENO);
	}
	r = r != 0 ? r
		   : posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY,
						      0);
	r = r != 0 ? r : posix_spawn_file_actions_addclosefrom_np(&actions, STDERR_FILENO + 1);
	r = r != 0 ? r : posix_spawn(ret_pid, path, &actions, &attributes, words, environment);
	posix_spawnattr_destroy(&attributes);
	posix_spawn_file_actions_destroy(&actions);
	return -r;
}

void exports_reap(struct exports *e)
{
	for (int i = 0; i < EXPORTS_AT_A_TIME; i++) {
		struct export_process *p = &e->process[i];

		if (p->is_stopped && waitpid(p->pid, NULL, WNOHANG) != 0) {
			*p = (struct export_process){ .pid = 0 };
		}
	}
}

int exports_start(struct exports *e, char *const words[], enum exports_errors errors, int *ret_fd)
{
	char program_path[PATH_MAX];
	int number = 0;
	int fds[2];
	pid_t pid = 0;
	int r;

	exports_reap(e);
	while (number < EXPORTS_AT_A_TIME && e->process[number].pid != 0) {
		number++;
	}
	if (number == EXPORTS_AT_A_TIME) {
		return -EBUSY;
	}
	r = program_beside(words[0], program_path);
	if (r < 0) {
		return r;
	}
	if (pipe2(fds, O_CLOEXEC) < 0) {
		return -errno;
	}
	(void)fcntl(fds[0], F_SETPIPE_SZ, PIPE_BYTES); /* a smaller one is slower, no more */
	r = fcntl(fds[0], F_SETFL, O_NONBLOCK) < 0
		    ? -errno
		    : spawn(program_path, words, errors, fds[1], &pid);
	close(fds[1]);
	if (r < 0) {
		close(fds[0]);
		return r;
	}
	(void)setpriority(PRIO_PROCESS, (id_t)pid, NICE);
	e->process[number].pid = pid;
	*ret_fd = fds[0];
	return number;
}

int exports_finish(struct exports *e, int number, int good_exit)
{
	struct export_process *p = &e->process[number];
	int status = 0;
	pid_t ended = waitpid(p->pid, &status, WNOHANG);

	if (ended == 0) {
		return 0;
	}
	*p = (struct export_process){ .pid = 0 };
	return ended > 0 && WIFEXITED(status) && WEXITSTATUS(status) <= good_exit ? 1 : -EIO;
}

void exports_stop(struct exports *e, int number)
{
	struct export_process *p = &e->process[number];

	(void)kill(p->pid, SIGKILL);
	p->is_stopped = 1;
	exports_reap(e);
}

void exports_done(struct exports *e)
{
	for (int i = 0; i < EXPORTS_AT_A_TIME; i++) {
		if (e->process[i].pid != 0) {
			(void)kill(e->process[i].pid, SIGKILL);
			(void)waitpid(e->process[i].pid, NULL, 0);
			e->process[i] = (struct export_process){ .pid = 0 };
		}
	}
}
