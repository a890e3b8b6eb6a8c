/* SPDX-License-Identifier: MIT */
/*
 * A frame of the length of a process data frame, sent and received back in each cycle by nothing
 * but a packet socket: what a master cannot be faster than.
 *
 *   echo reflect NIC                sends back what it receives, until it is ended
 *   echo BYTES NIC PERIOD_NS ...    the loop (loop.h)
 */
#include <errno.h>
#include <linux/if_packet.h>
#include <net/if.h>
#include <netinet/in.h>
#include <poll.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>

#include "loop.h"

enum { ETHERTYPE = 0x88A4, HEAD_BYTES = 14, LEAST_BYTES = 60, MOST_BYTES = 1514 };

static int fd;
static uint32_t number;
static size_t frame_bytes;
static int64_t limit_ns;

static void open_nic(const char *nic)
{
	struct sockaddr_ll address = { .sll_family = AF_PACKET,
				       .sll_protocol = htons(ETHERTYPE),
				       .sll_ifindex = (int)if_nametoindex(nic) };

	fd = socket(AF_PACKET, SOCK_RAW, htons(ETHERTYPE));
	if (address.sll_ifindex == 0 || fd < 0 ||
	    bind(fd, (const struct sockaddr *)&address, sizeof(address)) < 0) {
		fprintf(stderr, "echo: %s: %s\n", nic, strerror(errno));
		exit(1);
	}
}

static _Noreturn void reflect(void)
{
	uint8_t frame[MOST_BYTES];

	printf("ready\n");
	fflush(stdout);
	for (;;) {
		struct sockaddr_ll from;
		socklen_t from_bytes = sizeof(from);
		ssize_t n = recvfrom(fd, frame, sizeof(frame), 0, (struct sockaddr *)&from,
				     &from_bytes);

		if (n > 0 && from.sll_pkttype != PACKET_OUTGOING) {
			(void)send(fd, frame, (size_t)n, 0);
		}
	}
}

static int take_answer(int64_t until_ns)
{
	uint8_t frame[MOST_BYTES];
	struct sockaddr_ll from;
	socklen_t from_bytes = sizeof(from);
	struct pollfd wait = { .fd = fd, .events = POLLIN };
	int64_t left_ns = until_ns - loop_now_ns();
	struct timespec ts = { .tv_nsec = left_ns > 0 ? left_ns % LOOP_NS_PER_S : 0 };
	ssize_t n;

	if (ppoll(&wait, 1, &ts, NULL) <= 0) {
		return -1;
	}
	n = recvfrom(fd, frame, sizeof(frame), 0, (struct sockaddr *)&from, &from_bytes);
	return n >= HEAD_BYTES + (ssize_t)sizeof(number) && from.sll_pkttype != PACKET_OUTGOING &&
	       memcmp(frame + HEAD_BYTES, &number, sizeof(number)) == 0;
}

static int exchange(void *ctx)
{
	uint8_t frame[MOST_BYTES] = { 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 2,
				      0,    0,    0,    0,    1,    0x88, 0xA4 };
	int64_t until_ns = loop_now_ns() + limit_ns;
	int got;

	(void)ctx;
	number++;
	memcpy(frame + HEAD_BYTES, &number, sizeof(number));
	if (send(fd, frame, frame_bytes, 0) != (ssize_t)frame_bytes) {
		return 0;
	}
	do {
		got = take_answer(until_ns);
	} while (got == 0);
	return got > 0;
}

int main(int argc, char **argv)
{
	struct loop loop = { .exchange = exchange };
	struct loop_options opt;

	if (argc == 3 && strcmp(argv[1], "reflect") == 0) {
		open_nic(argv[2]);
		reflect();
	}
	if (argc < 2) {
		fprintf(stderr, "usage: echo reflect NIC | echo BYTES " LOOP_ARGUMENTS "\n");
		return 2;
	}
	frame_bytes = strtoul(argv[1], NULL, 10);
	if (frame_bytes < LEAST_BYTES || frame_bytes > MOST_BYTES) {
		fprintf(stderr, "echo: '%s' is not %d to %d bytes\n", argv[1], LEAST_BYTES,
			MOST_BYTES);
		return 2;
	}
	opt = loop_read_options(argc - 1, argv + 1);
	limit_ns = opt.limit_ns;
	open_nic(opt.nic);
	loop_run(&opt, &loop);
	return 0;
}
