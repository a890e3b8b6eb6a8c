/* SPDX-License-Identifier: MIT */
#include "simulator/wire_socket.h"

#include <errno.h>
#include <net/if.h>
#include <netinet/in.h>
#include <poll.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <time.h>
#include <unistd.h>

#include <linux/if_packet.h>

#include "wire/datagram.h"

static int fail(int fd, char *error, size_t error_bytes, const char *interface, const char *why)
{
	int r = -errno;

	snprintf(error, error_bytes, "interface %s: %s", interface, why);
	if (fd >= 0) {
		close(fd);
	}
	return r;
}

int wire_socket_open(const char *interface, char *error, size_t error_bytes)
{
	unsigned index = if_nametoindex(interface);
	struct sockaddr_ll address = { .sll_family = AF_PACKET,
				       .sll_protocol = htons(ECAT_ETHERTYPE),
				       .sll_ifindex = (int)index };
	struct packet_mreq promiscuous = { .mr_ifindex = (int)index, .mr_type = PACKET_MR_PROMISC };
	int one = 1;
	int fd;

	if (index == 0) {
		return fail(-1, error, error_bytes, interface, "no such interface");
	}
	fd = socket(AF_PACKET, SOCK_RAW | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
	if (fd < 0) {
		return fail(-1, error, error_bytes, interface,
			    errno == EPERM ? "no permission for a packet socket (needs CAP_NET_RAW)"
					   : strerror(errno));
	}
	if (setsockopt(fd, SOL_PACKET, PACKET_IGNORE_OUTGOING, &one, sizeof(one)) < 0 ||
	    setsockopt(fd, SOL_PACKET, PACKET_QDISC_BYPASS, &one, sizeof(one)) < 0 ||
	    setsockopt(fd, SOL_PACKET, PACKET_ADD_MEMBERSHIP, &promiscuous, sizeof(promiscuous)) <
		    0 ||
	    bind(fd, (struct sockaddr *)&address, sizeof(address)) < 0) {
		return fail(fd, error, error_bytes, interface, strerror(errno));
	}
	return fd;
}

/* An abstract name: it lives in the network namespace, as the interface does, and goes with us. */
int wire_socket_claim(const char *interface, char *error, size_t error_bytes)
{
	struct sockaddr_un name = { .sun_family = AF_UNIX };
	struct ifreq ifr = { 0 };
	size_t len;
	int fd = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);

	if (fd < 0) {
		return fail(-1, error, error_bytes, interface, strerror(errno));
	}
	snprintf(ifr.ifr_name, sizeof(ifr.ifr_name), "%s", interface);
	if (ioctl(fd, SIOCGIFFLAGS, &ifr) < 0 || (ifr.ifr_flags & IFF_LOOPBACK) != 0) {
		return fd; /* opening it says what is wrong; no master can be at a loopback's end */
	}
	len = (size_t)snprintf(name.sun_path + 1, sizeof(name.sun_path) - 1, "ecdaq-sim/%s",
			       interface);
	if (bind(fd, (struct sockaddr *)&name,
		 (socklen_t)(offsetof(struct sockaddr_un, sun_path) + 1 + len)) < 0) {
		return fail(fd, error, error_bytes, interface,
			    errno == EADDRINUSE ? "another ecdaq-sim already uses it"
						: strerror(errno));
	}
	return fd;
}

int64_t wire_socket_now_ns(void)
{
	struct timespec ts;

	clock_gettime(CLOCK_MONOTONIC, &ts);
	return ts.tv_sec * INT64_C(1000000000) + ts.tv_nsec;
}

int wire_socket_receive(int fd, uint8_t *frame, size_t capacity, int64_t timeout_ns,
			int64_t *ret_t_ns)
{
	struct pollfd p = { .fd = fd, .events = POLLIN };
	struct timespec wait = { .tv_sec = timeout_ns / 1000000000,
				 .tv_nsec = timeout_ns % 1000000000 };
	ssize_t n = recv(fd, frame, capacity, 0);

	if (n < 0 && (errno == EAGAIN || errno == EWOULDBLOCK)) {
		if (timeout_ns <= 0) {
			return 0;
		}
		if (ppoll(&p, 1, &wait, NULL) < 0) {
			return errno == EINTR ? 0 : -errno;
		}
		n = recv(fd, frame, capacity, 0);
	}
	if (n < 0) {
		return errno == EAGAIN || errno == EINTR ? 0 : -errno;
	}
	*ret_t_ns = wire_socket_now_ns();
	return (int)n;
}
