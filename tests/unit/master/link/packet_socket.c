/* SPDX-License-Identifier: MIT */
/*
 * On a loopback interface, where raw sockets are allowed; what needs no privilege always. The
 * interface is the test's own where the kernel gives it a network namespace: frames of others are
 * none of ours.
 */
#include "link/packet_socket.h"

#include <errno.h>
#include <fcntl.h>
#include <linux/if_tun.h>
#include <net/if.h>
#include <poll.h>
#include <sched.h>
#include <signal.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <unistd.h>

#include "harness/test.h"
#include "wire/datagram.h"

TEST(packet_socket, unknown_interface_is_reported_with_a_list_of_existing_ones)
{
	struct transport transport = { 0 };
	char error[PACKET_ERROR_BYTES];

	CHECK_EQ(packet_socket_open("nosuchnic0", PACKET_WAIT_AUTO, &transport, error,
				    sizeof(error)),
		 -ENODEV);
	CHECK(strstr(error, "nosuchnic0") != NULL);
	CHECK(strstr(error, "lo") != NULL);
	CHECK(strchr(error, '\n') == NULL);
	CHECK(transport.send == NULL);
}

TEST(packet_socket, invalid_name_is_rejected)
{
	struct transport transport = { 0 };
	char error[PACKET_ERROR_BYTES];

	CHECK_EQ(packet_socket_open("", PACKET_WAIT_AUTO, &transport, error, sizeof(error)),
		 -ENODEV);
	CHECK_EQ(packet_socket_open("an-interface-name-too-long", PACKET_WAIT_AUTO, &transport,
				    error, sizeof(error)),
		 -ENODEV);
	CHECK(transport.send == NULL);
}

/* Counts the waits of the socket under test, which are as they were. */
static unsigned waits;

int ppoll(struct pollfd *fds, nfds_t nfds, const struct timespec *timeout, const sigset_t *mask)
{
	struct timespec left = *timeout; /* the kernel writes what is left of it */

	waits++;
	return (int)syscall(SYS_ppoll, fds, nfds, &left, mask, (size_t)_NSIG / 8);
}

/* Counts the reads of it, too. */
static unsigned reads;

ssize_t recvfrom(int fd, void *buf, size_t len, int flags, struct sockaddr *addr,
		 socklen_t *addr_len)
{
	reads++;
	return syscall(SYS_recvfrom, fd, buf, len, flags, addr, addr_len);
}

static void move_to_own_network(void)
{
	static int is_there;
	struct ifreq ifr = { .ifr_name = "lo", .ifr_flags = IFF_UP | IFF_LOOPBACK };
	int fd;

	if (is_there || unshare(CLONE_NEWNET) < 0) {
		return; /* not allowed: then the machine's own loopback it is */
	}
	is_there = 1;
	fd = socket(AF_INET, SOCK_DGRAM, 0);
	CHECK(fd >= 0);
	CHECK_EQ(ioctl(fd, SIOCSIFFLAGS, &ifr), 0);
	close(fd);
}

static struct transport open_loopback(enum packet_wait wait)
{
	struct transport transport;
	char error[PACKET_ERROR_BYTES];
	int r;

	move_to_own_network();
	r = packet_socket_open("lo", wait, &transport, error, sizeof(error));
	if (r == -EPERM) {
		CHECK(strstr(error, "CAP_NET_RAW") != NULL);
		SKIP("raw sockets are not allowed");
	}
	CHECK_EQ(r, 0);
	if (transport.is_up(transport.ctx) != 1) {
		transport.destroy(transport.ctx);
		SKIP("the loopback interface is down");
	}
	return transport;
}

static size_t make_frame(uint8_t *frame, uint8_t idx)
{
	static const uint8_t source[6] = { 0x10, 0x10, 0x10, 0x10, 0x10, 0x10 };
	struct ecat_frame_builder fb;

	ecat_frame_begin(&fb, frame, source);
	ecat_frame_add(&fb, ECAT_CMD_NOP, idx, 0, 0, 4);
	return ecat_frame_end(&fb);
}

/* Every frame sent comes back once: the copy on its way out is not taken for a received one. */
static void check_echo(enum packet_wait wait)
{
	struct platform platform = platform_posix();
	struct transport transport = open_loopback(wait);

	for (uint8_t i = 0; i < 20; i++) {
		uint8_t frame[ECAT_FRAME_MAX_BYTES];
		uint8_t got[ECAT_FRAME_MAX_BYTES];
		size_t len = make_frame(frame, i);
		mono_t before = platform.now(NULL);
		mono_t at = { 0 };

		CHECK_EQ(transport.send(transport.ctx, frame, len), 0);
		CHECK_EQ(transport.receive(transport.ctx, got, sizeof(got),
					   mono_add(before, (span_t){ NS_PER_S }), &at),
			 len);
		CHECK_MEM(got, frame, len);
		CHECK(at.ns >= before.ns && at.ns <= platform.now(NULL).ns);
		CHECK_EQ(transport.receive(transport.ctx, got, sizeof(got), before, NULL), -EAGAIN);
	}
	transport.destroy(transport.ctx);
}

TEST(packet_socket, frame_comes_back_once_when_spinning)
{
	check_echo(PACKET_WAIT_SPIN);
}

TEST(packet_socket, frame_comes_back_once_when_sleeping)
{
	check_echo(PACKET_WAIT_SLEEP);
}

/* Even where the answer is there at once: a look behind each send would find nothing on a wire. */
TEST(packet_socket, a_frame_is_waited_for_before_the_first_look_behind_a_send)
{
	struct transport transport = open_loopback(PACKET_WAIT_SLEEP);
	mono_t soon = mono_add(platform_posix().now(NULL), (span_t){ NS_PER_S });
	uint8_t frame[ECAT_FRAME_MAX_BYTES];
	uint8_t got[ECAT_FRAME_MAX_BYTES];
	size_t len = make_frame(frame, 1);
	unsigned before;

	CHECK_EQ(transport.send(transport.ctx, frame, len), 0);
	before = waits;
	CHECK_EQ(transport.receive(transport.ctx, got, sizeof(got), soon, NULL), len);
	CHECK_EQ(waits - before, 1);
	/* Nothing is waited for behind the deadline. */
	CHECK_EQ(transport.send(transport.ctx, frame, len), 0);
	before = waits;
	transport.receive(transport.ctx, got, sizeof(got), (mono_t){ 1 }, NULL);
	CHECK_EQ(waits - before, 0);
	transport.destroy(transport.ctx);
}

/* More frames than the ring of received ones has slots, in bursts; none is read by a system call.
 */
TEST(packet_socket, frames_are_taken_in_order_without_a_system_call)
{
	struct transport transport = open_loopback(PACKET_WAIT_SLEEP);
	struct platform platform = platform_posix();
	unsigned before = reads;

	for (unsigned burst = 0; burst < 100; burst++) {
		uint8_t frame[ECAT_FRAME_MAX_BYTES];
		uint8_t got[ECAT_FRAME_MAX_BYTES];
		mono_t soon = mono_add(platform.now(NULL), (span_t){ NS_PER_S });
		size_t len = 0;

		for (unsigned i = 0; i < 8; i++) {
			len = make_frame(frame, (uint8_t)(8 * burst + i));
			CHECK_EQ(transport.send(transport.ctx, frame, len), 0);
		}
		for (unsigned i = 0; i < 8; i++) {
			make_frame(frame, (uint8_t)(8 * burst + i));
			CHECK_EQ(transport.receive(transport.ctx, got, sizeof(got), soon, NULL),
				 len);
			CHECK_MEM(got, frame, len);
		}
	}
	CHECK_EQ(reads - before, 0);
	transport.destroy(transport.ctx);
}

/* A network interface that lives as long as the descriptor. */
static int make_interface(const char *name)
{
	struct ifreq ifr = { .ifr_flags = IFF_TAP | IFF_NO_PI };
	int tap = open("/dev/net/tun", O_RDWR | O_CLOEXEC);
	int fd = socket(AF_INET, SOCK_DGRAM, 0);

	snprintf(ifr.ifr_name, sizeof(ifr.ifr_name), "%s", name);
	if (tap < 0 || ioctl(tap, TUNSETIFF, &ifr) < 0) {
		SKIP("no TAP interfaces here");
	}
	ifr.ifr_flags = IFF_UP;
	CHECK(fd >= 0);
	CHECK_EQ(ioctl(fd, SIOCSIFFLAGS, &ifr), 0);
	close(fd);
	return tap;
}

/* The error of an interface that went down would end each wait at once. */
TEST(packet_socket, an_interface_that_goes_down_does_not_make_a_wait_spin)
{
	static const char name[] = "ecdaqtest1";
	struct transport transport;
	struct platform platform = platform_posix();
	char error[PACKET_ERROR_BYTES];
	uint8_t got[ECAT_FRAME_MAX_BYTES];
	unsigned before;
	int tap;

	move_to_own_network();
	tap = make_interface(name);
	if (packet_socket_open(name, PACKET_WAIT_SLEEP, &transport, error, sizeof(error)) ==
	    -EPERM) {
		SKIP("raw sockets are not allowed");
	}
	close(tap);
	before = waits;
	while (transport.receive(transport.ctx, got, sizeof(got),
				 mono_add(platform.now(NULL), (span_t){ 5 * NS_PER_MS }),
				 NULL) >= 0) {
	}
	CHECK(waits - before < 20); /* frames of the kernel's own that came before, and two */
	transport.destroy(transport.ctx);
}

/* Not before the deadline, and not ticks behind it as a socket's own time-out (T01); generous for a
 * loaded machine. */
static void check_deadline(enum packet_wait wait)
{
	struct platform platform = platform_posix();
	struct transport transport = open_loopback(wait);
	int64_t least_ns = INT64_MAX;

	for (int i = 0; i < 10; i++) {
		uint8_t got[ECAT_FRAME_MAX_BYTES];
		mono_t deadline = mono_add(platform.now(NULL), (span_t){ 300 * NS_PER_US });
		int64_t late_ns;

		CHECK_EQ(transport.receive(transport.ctx, got, sizeof(got), deadline, NULL),
			 -EAGAIN);
		late_ns = mono_sub(platform.now(NULL), deadline).ns;
		CHECK(late_ns >= 0);
		least_ns = late_ns < least_ns ? late_ns : least_ns;
	}
	CHECK(least_ns < 2 * NS_PER_MS);
	transport.destroy(transport.ctx);
}

TEST(packet_socket, receive_returns_at_its_deadline)
{
	check_deadline(PACKET_WAIT_SPIN);
	check_deadline(PACKET_WAIT_SLEEP);
}

TEST(packet_socket, frame_longer_than_the_buffer_is_passed_over)
{
	struct transport transport = open_loopback(PACKET_WAIT_SLEEP);
	struct platform platform = platform_posix();
	uint8_t frame[ECAT_FRAME_MAX_BYTES];
	uint8_t got[32];
	size_t len = make_frame(frame, 1);

	CHECK_EQ(transport.send(transport.ctx, frame, len), 0);
	CHECK_EQ(transport.receive(transport.ctx, got, sizeof(got),
				   mono_add(platform.now(NULL), (span_t){ 5 * NS_PER_MS }), NULL),
		 -EAGAIN);
	transport.destroy(transport.ctx);
}

TEST(packet_socket, an_interface_that_is_deleted_and_recreated_is_used_again)
{
	static const char name[] = "ecdaqtest0";
	struct transport transport;
	char error[PACKET_ERROR_BYTES];
	uint8_t frame[ECAT_FRAME_MAX_BYTES];
	uint8_t got[ECAT_FRAME_MAX_BYTES];
	size_t len = make_frame(frame, 1);
	unsigned first;
	int tap;
	int r;

	move_to_own_network();
	tap = make_interface(name);
	first = if_nametoindex(name);
	if (packet_socket_open(name, PACKET_WAIT_AUTO, &transport, error, sizeof(error)) ==
	    -EPERM) {
		SKIP("raw sockets are not allowed");
	}
	CHECK_EQ(transport.is_up(transport.ctx), 1);
	close(tap);
	CHECK_EQ(transport.is_up(transport.ctx), 0);
	tap = make_interface(name);
	CHECK(if_nametoindex(name) != first);
	CHECK_EQ(transport.is_up(transport.ctx), 1);
	CHECK_EQ(transport.is_up(transport.ctx), 1);
	/* The socket may still hold the error of the deletion; it is reported once. */
	r = transport.send(transport.ctx, frame, len);
	CHECK(r == 0 || r == -ENETDOWN);
	CHECK_EQ(transport.send(transport.ctx, frame, len), 0);
	/* The kernel's own frames (IPv6) may be first. */
	do {
		CHECK(read(tap, got, sizeof(got)) > 0);
	} while (memcmp(got, frame, len) != 0);
	close(tap);
	transport.destroy(transport.ctx);
}
