/* SPDX-License-Identifier: MIT */
#include "sim/harness/rt_guard.h"

#include <fcntl.h>
#include <poll.h>
#include <semaphore.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

static _Thread_local int armed;
static uint64_t *counted;
static const char **last_name;

void rt_guard_arm(void)
{
	armed = 1;
}

void rt_guard_disarm(void)
{
	armed = 0;
}

int rt_guard_is_armed(void)
{
	return armed;
}

void rt_guard_count_to(uint64_t *counter, const char **ret_last)
{
	counted = counter;
	last_name = ret_last;
}

static void violation(const char *name)
{
	if (!armed) {
		return;
	}
	if (counted != NULL) {
		(*counted)++;
		*last_name = name;
		return;
	}
	armed = 0;
	fprintf(stderr, "real-time rule broken: %s() called in the cycle\n", name);
	abort();
}

/* GUARD(type, name, (parameters), (arguments)): the wrapper of one call. */
#define GUARD(type, name, parameters, arguments)                                                   \
	type __real_##name parameters;                                                             \
	type __wrap_##name parameters;                                                             \
	type __wrap_##name parameters                                                              \
	{                                                                                          \
		violation(#name);                                                                  \
		return __real_##name arguments;                                                    \
	}

/* clang-format off */
GUARD(void *, malloc, (size_t size), (size))
GUARD(void *, calloc, (size_t count, size_t size), (count, size))
GUARD(void *, realloc, (void *old, size_t size), (old, size))
GUARD(void *, aligned_alloc, (size_t align, size_t size), (align, size))
GUARD(void, free, (void *memory), (memory))
GUARD(void *, mmap, (void *at, size_t len, int prot, int flags, int fd, off_t offset), (at, len, prot, flags, fd, offset))
GUARD(int, munmap, (void *at, size_t len), (at, len))
GUARD(int, pthread_mutex_lock, (pthread_mutex_t *mutex), (mutex))
GUARD(int, pthread_cond_wait, (pthread_cond_t *cond, pthread_mutex_t *mutex), (cond, mutex))
GUARD(int, pthread_rwlock_rdlock, (pthread_rwlock_t *lock), (lock))
GUARD(int, pthread_rwlock_wrlock, (pthread_rwlock_t *lock), (lock))
GUARD(int, sem_wait, (sem_t *sem), (sem))
GUARD(ssize_t, read, (int fd, void *buf, size_t len), (fd, buf, len))
GUARD(ssize_t, write, (int fd, const void *buf, size_t len), (fd, buf, len))
GUARD(ssize_t, pread, (int fd, void *buf, size_t len, off_t at), (fd, buf, len, at))
GUARD(ssize_t, pwrite, (int fd, const void *buf, size_t len, off_t at), (fd, buf, len, at))
GUARD(int, close, (int fd), (fd))
GUARD(int, fsync, (int fd), (fd))
GUARD(int, fdatasync, (int fd), (fd))
GUARD(FILE *, fopen, (const char *path, const char *mode), (path, mode))
GUARD(int, fclose, (FILE *file), (file))
GUARD(int, fflush, (FILE *file), (file))
GUARD(size_t, fwrite, (const void *data, size_t size, size_t count, FILE *file), (data, size, count, file))
GUARD(int, fputs, (const char *text, FILE *file), (text, file))
GUARD(int, fputc, (int c, FILE *file), (c, file))
GUARD(int, puts, (const char *text), (text))
GUARD(int, putchar, (int c), (c))
GUARD(int, poll, (struct pollfd *fds, nfds_t count, int timeout), (fds, count, timeout))
GUARD(int, ppoll, (struct pollfd *fds, nfds_t count, const struct timespec *timeout, const sigset_t *mask), (fds, count, timeout, mask))
GUARD(int, nanosleep, (const struct timespec *span, struct timespec *left), (span, left))
GUARD(int, clock_nanosleep, (clockid_t clock, int flags, const struct timespec *at, struct timespec *left), (clock, flags, at, left))
GUARD(ssize_t, send, (int fd, const void *buf, size_t len, int flags), (fd, buf, len, flags))
GUARD(ssize_t, recv, (int fd, void *buf, size_t len, int flags), (fd, buf, len, flags))
GUARD(int, vprintf, (const char *format, va_list args), (format, args))
GUARD(int, vfprintf, (FILE *file, const char *format, va_list args), (file, format, args))
GUARD(int, vsnprintf, (char *buf, size_t len, const char *format, va_list args), (buf, len, format, args))
/* clang-format on */

/* Those with an open end. */
int __wrap_printf(const char *format, ...) __attribute__((format(printf, 1, 2)));
int __wrap_fprintf(FILE *file, const char *format, ...) __attribute__((format(printf, 2, 3)));
int __wrap_snprintf(char *buf, size_t len, const char *format, ...)
	__attribute__((format(printf, 3, 4)));
int __real_open(const char *path, int flags, ...);
int __wrap_open(const char *path, int flags, ...);

int __wrap_printf(const char *format, ...)
{
	va_list args;
	int r;

	violation("printf");
	va_start(args, format);
	r = __real_vprintf(format, args);
	va_end(args);
	return r;
}

int __wrap_fprintf(FILE *file, const char *format, ...)
{
	va_list args;
	int r;

	violation("fprintf");
	va_start(args, format);
	r = __real_vfprintf(file, format, args);
	va_end(args);
	return r;
}

int __wrap_snprintf(char *buf, size_t len, const char *format, ...)
{
	va_list args;
	int r;

	violation("snprintf");
	va_start(args, format);
	r = __real_vsnprintf(buf, len, format, args);
	va_end(args);
	return r;
}

int __wrap_open(const char *path, int flags, ...)
{
	mode_t mode = 0;

	violation("open");
	if ((flags & O_CREAT) != 0) {
		va_list args;

		va_start(args, flags);
		mode = va_arg(args, mode_t);
		va_end(args);
	}
	return __real_open(path, flags, mode);
}
