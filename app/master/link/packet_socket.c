/* SPDX-License-Identifier: MIT */
#include "link/packet_socket.h"

#include <errno.h>
#include <linux/if_packet.h>
#include <net/if.h>
#include <netinet/in.h>
#include <poll.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

#include "link/packet_ring.h"
#include "wire/datagram.h"

#ifndef PACKET_IGNORE_OUTGOING
#define PACKET_IGNORE_OUTGOING 23
#endif

enum { SOCKET_BUFFER_BYTES = 1 << 20, BUSY_POLL_US = 50, SPIN_CPUS_MIN = 3 };

struct packet_socket {
	int fd;
	struct packet_ring ring;
	int is_spinning;
	int has_sent;                /* [owner of the transport] and not looked for a frame since */
	_Atomic int interface_index; /* [service] changes when the NIC was removed and came back */
	char interface[IF_NAMESIZE];
};

static int64_t now_ns(void)
{
	struct timespec ts;

	clock_gettime(CLOCK_MONOTONIC, &ts);
	return ts.tv_sec * NS_PER_S + ts.tv_nsec;
}

static int packet_send(void *ctx, const uint8_t *frame, size_t frame_len)
{
	struct packet_socket *ps = ctx;
	ssize_t r = send(ps->fd, frame, frame_len, MSG_DONTWAIT);

	ps->has_sent = 1;
	if (r < 0) {
		return -errno;
	}
	return (size_t)r == frame_len ? 0 : -EIO;
}

/* An error of the interface ends each wait at once until it is asked for. It is not reported: what
 * happened to the link is_up() tells, and it may be back before the deadline. */
static void sleep_for_frame(const struct packet_socket *ps, int64_t left_ns)
{
	struct pollfd pfd = { .fd = ps->fd, .events = POLLIN };
	struct timespec ts = { .tv_sec = left_ns / NS_PER_S, .tv_nsec = left_ns % NS_PER_S };
	int error;
	socklen_t error_len = sizeof(error);

	if (ppoll(&pfd, 1, &ts, NULL) > 0 && (pfd.revents & POLLERR) != 0) {
		getsockopt(ps->fd, SOL_SOCKET, SO_ERROR, &error, &error_len);
	}
}

/* Right behind a frame that was sent its answer is not there. */
static void wait_behind_send(struct packet_socket *ps, mono_t deadline)
{
	int64_t left_ns = ps->has_sent && !ps->is_spinning ? deadline.ns - now_ns() : 0;

	ps->has_sent = 0;
	if (left_ns > 0) {
		sleep_for_frame(ps, left_ns);
	}
}

static int packet_receive(void *ctx, uint8_t *frame, size_t capacity, mono_t deadline,
			  mono_t *ret_at)
{
	struct packet_socket *ps = ctx;

	wait_behind_send(ps, deadline);
	for (;;) {
		/* One frame a look, also of those passed over: the deadline is minded between them.
		 */
		int r = packet_ring_take(&ps->ring, frame, capacity);
		int64_t now = now_ns();

		if (r >= 0) {
			if (ret_at != NULL) {
				ret_at->ns = now;
			}
			return r;
		}
		if (now >= deadline.ns) {
			return -EAGAIN;
		}
		if (!ps->is_spinning) {
			sleep_for_frame(ps, deadline.ns - now);
		}
	}
}

static int bind_to(int fd, int interface_index)
{
	struct sockaddr_ll at = {
		.sll_family = AF_PACKET,
		.sll_protocol = htons(ECAT_ETHERTYPE),
		.sll_ifindex = interface_index,
	};
	struct packet_mreq promiscuous = { .mr_ifindex = interface_index,
					   .mr_type = PACKET_MR_PROMISC };

	if (bind(fd, (struct sockaddr *)&at, sizeof(at)) < 0) {
		return -errno;
	}
	/* Returned frames carry another source and no destination of ours: some NICs filter them.
	 */
	if (setsockopt(fd, SOL_PACKET, PACKET_ADD_MEMBERSHIP, &promiscuous, sizeof(promiscuous)) <
	    0) {
		return -errno;
	}
	return 0;
}

static int carrier(const struct packet_socket *ps)
{
	struct ifreq ifr = { 0 };

	memcpy(ifr.ifr_name, ps->interface, sizeof(ps->interface));
	if (ioctl(ps->fd, SIOCGIFFLAGS, &ifr) < 0) {
		return -errno;
	}
	return (ifr.ifr_flags & IFF_UP) != 0 && (ifr.ifr_flags & IFF_RUNNING) != 0;
}

/* As if_nametoindex(), which opens a socket of its own each time. 0: there is none. */
static int index_now(const struct packet_socket *ps)
{
	struct ifreq ifr = { 0 };

	memcpy(ifr.ifr_name, ps->interface, sizeof(ps->interface));
	return ioctl(ps->fd, SIOCGIFINDEX, &ifr) < 0 ? 0 : ifr.ifr_ifindex;
}

static int packet_is_up(void *ctx)
{
	struct packet_socket *ps = ctx;
	int index = index_now(ps);

	if (index == 0) {
		return 0;
	}
	if (index != atomic_load_explicit(&ps->interface_index, memory_order_relaxed)) {
		int r = bind_to(ps->fd, index);

		if (r < 0) {
			return r;
		}
		atomic_store_explicit(&ps->interface_index, index, memory_order_relaxed);
	}
	return carrier(ps);
}

static void packet_destroy(void *ctx)
{
	struct packet_socket *ps = ctx;

	packet_ring_close(&ps->ring);
	close(ps->fd);
	free(ps);
}

/* What can fail here costs latency, not function: an older kernel, a driver without it, no
 * CAP_NET_ADMIN. */
static void tune(int fd)
{
	int on = 1;
	int bytes = SOCKET_BUFFER_BYTES;
	int busy_poll_us = BUSY_POLL_US;

	setsockopt(fd, SOL_PACKET, PACKET_QDISC_BYPASS, &on, sizeof(on));
	setsockopt(fd, SOL_PACKET, PACKET_IGNORE_OUTGOING, &on, sizeof(on));
	setsockopt(fd, SOL_SOCKET, SO_BUSY_POLL, &busy_poll_us, sizeof(busy_poll_us));
	if (setsockopt(fd, SOL_SOCKET, SO_RCVBUFFORCE, &bytes, sizeof(bytes)) < 0) {
		setsockopt(fd, SOL_SOCKET, SO_RCVBUF, &bytes, sizeof(bytes));
	}
	if (setsockopt(fd, SOL_SOCKET, SO_SNDBUFFORCE, &bytes, sizeof(bytes)) < 0) {
		setsockopt(fd, SOL_SOCKET, SO_SNDBUF, &bytes, sizeof(bytes));
	}
}

static void list_interfaces(char *buf, size_t buf_bytes)
{
	struct if_nameindex *all = if_nameindex();
	size_t used = 0;

	buf[0] = '\0';
	for (const struct if_nameindex *i = all; i != NULL && i->if_index != 0; i++) {
		int r = snprintf(buf + used, buf_bytes - used, "%s%s", used > 0 ? ", " : "",
				 i->if_name);

		if (r < 0 || (size_t)r >= buf_bytes - used) {
			break;
		}
		used += (size_t)r;
	}
	if_freenameindex(all);
}

static int open_bound(const char *interface, int *ret_fd, struct packet_ring *ret_ring, char *error,
		      size_t error_bytes)
{
	char there[160];
	unsigned index = if_nametoindex(interface);
	int fd;
	int r;

	if (index == 0) {
		list_interfaces(there, sizeof(there));
		snprintf(error, error_bytes,
			 "interface %s: no such network interface; there are: %s", interface,
			 there);
		return -ENODEV;
	}
	/* Type 0: nothing is received before bind(). */
	fd = socket(AF_PACKET, SOCK_RAW | SOCK_CLOEXEC, 0);
	if (fd < 0) {
		r = -errno;
		snprintf(error, error_bytes, "interface %s: %s", interface,
			 r == -EPERM ? "no permission: raw sockets need root or CAP_NET_RAW "
				       "(setcap cap_net_raw+ep on the program)"
				     : strerror(-r));
		return r;
	}
	tune(fd);
	r = packet_ring_open(fd, ret_ring);
	if (r < 0) {
		snprintf(error, error_bytes, "interface %s: no ring for received frames: %s",
			 interface, strerror(-r));
		close(fd);
		return r;
	}
	r = bind_to(fd, (int)index);
	if (r < 0) {
		packet_ring_close(ret_ring);
		snprintf(error, error_bytes, "interface %s: cannot bind to it: %s", interface,
			 strerror(-r));
		close(fd);
		return r;
	}
	*ret_fd = fd;
	return (int)index;
}

static int resolve_wait(enum packet_wait wait)
{
	switch (wait) {
	case PACKET_WAIT_SPIN:
		return 1;
	case PACKET_WAIT_SLEEP:
		return 0;
	case PACKET_WAIT_AUTO:
		break;
	}
	return sysconf(_SC_NPROCESSORS_ONLN) >= SPIN_CPUS_MIN;
}

int packet_socket_open(const char *interface, enum packet_wait wait,
		       struct transport *ret_transport, char *error, size_t error_bytes)
{
	struct packet_socket *ps;
	struct packet_ring ring = { 0 };
	int fd = -1;
	int index;

	error[0] = '\0';
	if (strlen(interface) >= IF_NAMESIZE || interface[0] == '\0') {
		snprintf(error, error_bytes, "interface \"%s\": a name has 1 to %d characters",
			 interface, IF_NAMESIZE - 1);
		return -ENODEV;
	}
	index = open_bound(interface, &fd, &ring, error, error_bytes);
	if (index < 0) {
		return index;
	}
	ps = calloc(1, sizeof(*ps));
	if (ps == NULL) {
		packet_ring_close(&ring);
		close(fd);
		return -ENOMEM;
	}
	ps->fd = fd;
	ps->ring = ring;
	ps->is_spinning = resolve_wait(wait);
	atomic_init(&ps->interface_index, index);
	memcpy(ps->interface, interface, strlen(interface) + 1);
	if (carrier(ps) == 0) {
		snprintf(error, error_bytes,
			 "interface %s: the link is down (cable, slave power, ip link set %s up)",
			 interface, interface);
	}
	*ret_transport = (struct transport){
		.send = packet_send,
		.receive = packet_receive,
		.is_up = packet_is_up,
		.destroy = packet_destroy,
		.ctx = ps,
	};
	return 0;
}
