/* SPDX-License-Identifier: MIT */
#include "simulator/control.h"

#include <errno.h>
#include <stdio.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include "segment/io_line.h"

enum { ANSWER_BYTES = 1024 };

/* A socket that a run before left there goes; one that is served, and anything else, stays. */
static void remove_socket(int fd, const struct sockaddr_un *address)
{
	struct stat st;

	if (lstat(address->sun_path, &st) == 0 && S_ISSOCK(st.st_mode) &&
	    connect(fd, (const struct sockaddr *)address, sizeof(*address)) < 0 &&
	    errno == ECONNREFUSED) {
		unlink(address->sun_path);
	}
}

int control_open(const char *path, char *error, size_t error_bytes)
{
	struct sockaddr_un address = { .sun_family = AF_UNIX };
	int fd;
	int r;

	if (strlen(path) >= sizeof(address.sun_path)) {
		snprintf(error, error_bytes, "--control %s: path too long", path);
		return -ENAMETOOLONG;
	}
	snprintf(address.sun_path, sizeof(address.sun_path), "%s", path);
	fd = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
	if (fd >= 0) {
		remove_socket(fd, &address);
	}
	if (fd < 0 || bind(fd, (struct sockaddr *)&address, sizeof(address)) < 0) {
		r = -errno;
		snprintf(error, error_bytes, "--control %s: %s", path, strerror(errno));
		if (fd >= 0) {
			close(fd);
		}
		return r;
	}
	return fd;
}

static void do_line(struct fault_plan *plan, struct segment *segment, int64_t now_ns,
		    const char *line, char answer[ANSWER_BYTES])
{
	if (io_line(segment, line, answer, ANSWER_BYTES) != -ENOENT) {
		return;
	}
	fault_plan_restart(plan, now_ns);
	snprintf(answer, ANSWER_BYTES, "ok");
	fault_plan_add(plan, line, segment_slave_count(segment), answer, ANSWER_BYTES);
}

void control_serve(int fd, struct fault_plan *plan, struct segment *segment, int64_t now_ns)
{
	for (;;) {
		struct sockaddr_un from;
		socklen_t from_len = sizeof(from);
		char line[300];
		char answer[ANSWER_BYTES];
		ssize_t n = recvfrom(fd, line, sizeof(line) - 1, 0, (struct sockaddr *)&from,
				     &from_len);

		if (n < 0) {
			return;
		}
		line[n] = '\0';
		do_line(plan, segment, now_ns, line, answer);
		/* Who has no address does not want an answer. */
		if (from_len > sizeof(sa_family_t)) {
			(void)!sendto(fd, answer, strlen(answer), MSG_DONTWAIT,
				      (struct sockaddr *)&from, from_len);
		}
	}
}
