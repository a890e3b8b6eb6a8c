/* SPDX-License-Identifier: MIT */
#include "daemon/notify.h"

#include <errno.h>
#include <stddef.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include "harness/test.h"

/* A service manager's end, at an abstract address. */
static int listen_at(const char *name)
{
	struct sockaddr_un address = { .sun_family = AF_UNIX };
	size_t len = strlen(name);
	int fd = socket(AF_UNIX, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);

	memcpy(address.sun_path, name, len);
	address.sun_path[0] = '\0';
	CHECK_EQ(bind(fd, (const struct sockaddr *)&address,
		      (socklen_t)(offsetof(struct sockaddr_un, sun_path) + len)),
		 0);
	return fd;
}

static void check_heard(int fd, const char *wanted)
{
	char got[600] = "";
	ssize_t len = recv(fd, got, sizeof(got) - 1, 0);

	if (wanted == NULL) {
		CHECK_EQ(len, -1);
		return;
	}
	CHECK_STR(got, wanted);
}

TEST(daemon_notify, without_a_manager_nothing_happens)
{
	struct notify notify;

	CHECK_EQ(unsetenv("NOTIFY_SOCKET"), 0);
	notify_open(&notify);
	CHECK_EQ(notify.fd, -1);
	notify_send(&notify, "READY=1");
	notify_alive(&notify, (mono_t){ 1 });
	notify_close(&notify);
}

TEST(daemon_notify, readiness_and_status_reach_the_manager)
{
	struct notify notify;
	char name[64];
	int fd;

	snprintf(name, sizeof(name), "@ecdaq-notify-%d", getpid());
	fd = listen_at(name);
	CHECK_EQ(setenv("NOTIFY_SOCKET", name, 1), 0);
	notify_open(&notify);
	CHECK(notify.fd >= 0);
	notify_send(&notify, "READY=1");
	check_heard(fd, "READY=1");
	notify_send(&notify, "STATUS=%u slaves in OP", 2u);
	check_heard(fd, "STATUS=2 slaves in OP");
	notify_alive(&notify, (mono_t){ 1 });
	check_heard(fd, NULL); /* no watchdog is configured */
	close(fd);
	notify_send(&notify, "STOPPING=1"); /* the receiver is closed */
	notify_close(&notify);
}

TEST(daemon_notify, the_watchdog_is_fed_twice_per_timeout)
{
	struct notify notify;
	char name[64];
	int fd;

	snprintf(name, sizeof(name), "@ecdaq-watchdog-%d", getpid());
	fd = listen_at(name);
	CHECK_EQ(setenv("NOTIFY_SOCKET", name, 1), 0);
	CHECK_EQ(setenv("WATCHDOG_USEC", "2000000", 1), 0);
	notify_open(&notify);
	CHECK_EQ(notify.watchdog_ns, NS_PER_S);
	notify_alive(&notify, (mono_t){ 5 * NS_PER_S });
	check_heard(fd, "WATCHDOG=1");
	notify_alive(&notify, (mono_t){ 6 * NS_PER_S - 1 });
	check_heard(fd, NULL);
	notify_alive(&notify, (mono_t){ 6 * NS_PER_S });
	check_heard(fd, "WATCHDOG=1");
	notify_close(&notify);
	CHECK_EQ(setenv("WATCHDOG_PID", "1", 1), 0);
	notify_open(&notify);
	CHECK_EQ(notify.watchdog_ns, 0); /* meant for another process */
	notify_close(&notify);
	close(fd);
}

TEST(daemon_notify, invalid_addresses_are_ignored)
{
	struct notify notify;
	char longest[200];

	memset(longest, 'a', sizeof(longest));
	longest[0] = '/';
	longest[sizeof(longest) - 1] = '\0';
	CHECK_EQ(setenv("NOTIFY_SOCKET", longest, 1), 0);
	notify_open(&notify);
	CHECK_EQ(notify.fd, -1);
	CHECK_EQ(setenv("NOTIFY_SOCKET", "relative", 1), 0);
	notify_open(&notify);
	CHECK_EQ(notify.fd, -1);
	CHECK_EQ(setenv("NOTIFY_SOCKET", "", 1), 0);
	notify_open(&notify);
	CHECK_EQ(notify.fd, -1);
}
