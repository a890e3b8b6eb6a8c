/* SPDX-License-Identifier: MIT */
#include "daemon/notify.h"

#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

enum { MESSAGE_BYTES = 512 };

static int connect_to(const char *path)
{
	struct sockaddr_un address = { .sun_family = AF_UNIX };
	size_t len = strlen(path);
	int fd;

	if ((path[0] != '/' && path[0] != '@') || len < 2 || len >= sizeof(address.sun_path)) {
		return -1;
	}
	memcpy(address.sun_path, path, len);
	if (path[0] == '@') {
		address.sun_path[0] = '\0'; /* abstract */
	}
	fd = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
	if (fd >= 0 && connect(fd, (const struct sockaddr *)&address,
			       (socklen_t)(offsetof(struct sockaddr_un, sun_path) + len)) < 0) {
		close(fd);
		fd = -1;
	}
	return fd;
}

/* WATCHDOG_USEC counts only if WATCHDOG_PID is absent or this process. */
static int64_t watchdog_span_ns(void)
{
	const char *usec = getenv("WATCHDOG_USEC");
	const char *pid = getenv("WATCHDOG_PID");
	long long us = usec != NULL ? strtoll(usec, NULL, 10) : 0;

	if (us <= 0 || us > INT64_MAX / NS_PER_US ||
	    (pid != NULL && strtoll(pid, NULL, 10) != (long long)getpid())) {
		return 0;
	}
	return us * NS_PER_US / 2;
}

void notify_open(struct notify *notify)
{
	const char *path = getenv("NOTIFY_SOCKET");

	*notify = (struct notify){
		.fd = path != NULL ? connect_to(path) : -1,
		.watchdog_ns = watchdog_span_ns(),
	};
}

void notify_close(struct notify *notify)
{
	if (notify->fd >= 0) {
		close(notify->fd);
		notify->fd = -1;
	}
}

void notify_send(const struct notify *notify, const char *format, ...)
{
	char message[MESSAGE_BYTES];
	va_list args;
	int len;

	if (notify->fd < 0) {
		return;
	}
	va_start(args, format);
	len = vsnprintf(message, sizeof(message), format, args);
	va_end(args);
	if (len > 0) {
		size_t bytes = (size_t)len < sizeof(message) ? (size_t)len : sizeof(message) - 1;

		/* A missing service manager must not stop the measurement. */
		(void)!send(notify->fd, message, bytes, MSG_NOSIGNAL);
	}
}

void notify_alive(struct notify *notify, mono_t now)
{
	if (notify->watchdog_ns > 0 && now.ns >= notify->next_watchdog.ns) {
		notify->next_watchdog = mono_add(now, (span_t){ notify->watchdog_ns });
		notify_send(notify, "WATCHDOG=1");
	}
}
