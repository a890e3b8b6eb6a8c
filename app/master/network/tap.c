/* SPDX-License-Identifier: MIT */
#include "network/tap.h"

#include <errno.h>
#include <fcntl.h>
#include <linux/if_tun.h>
#include <net/if.h>
#include <stdio.h>
#include <string.h>
#include <sys/ioctl.h>
#include <unistd.h>

#define DEVICE "/dev/net/tun"

static const char *remedy(int r)
{
	switch (-r) {
	case ENOENT:
	case ENODEV:
	case ENXIO:
		return ": load the kernel module tun";
	case EPERM:
	case EACCES:
		return ": make the device with 'ip tuntap add', for the user or group of ecdaqd";
	case EBUSY:
		return ": another program has it open";
	case EINVAL:
		return ": there is an interface of this name that is no TAP device";
	default:
		return "";
	}
}

static int fail(const char *what, int r, char *error, size_t error_bytes)
{
	snprintf(error, error_bytes, "%s: %s%s", what, strerror(-r), remedy(r));
	return r;
}

int tap_open(const char *name, int *ret_fd, char *error, size_t error_bytes)
{
	struct ifreq request = { .ifr_flags = IFF_TAP | IFF_NO_PI };
	int fd;

	if (strlen(name) >= sizeof(request.ifr_name)) {
		snprintf(error, error_bytes, "%s: longer than %zu characters", name,
			 sizeof(request.ifr_name) - 1);
		return -ENAMETOOLONG;
	}
	fd = open(DEVICE, O_RDWR | O_NONBLOCK | O_CLOEXEC);
	if (fd < 0) {
		return fail(DEVICE, -errno, error, error_bytes);
	}
	memcpy(request.ifr_name, name, strlen(name));
	if (ioctl(fd, TUNSETIFF, &request) < 0) {
		int r = -errno;

		close(fd);
		return fail(name, r, error, error_bytes);
	}
	*ret_fd = fd;
	return 0;
}

int tap_read(int fd, uint8_t *frame, size_t capacity)
{
	ssize_t n = read(fd, frame, capacity);

	return n < 0 ? -errno : (int)n;
}

int tap_write(int fd, const uint8_t *frame, size_t len)
{
	return write(fd, frame, len) < 0 ? -errno : 0;
}
