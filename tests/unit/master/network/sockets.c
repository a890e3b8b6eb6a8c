/* SPDX-License-Identifier: MIT */
/* The gateway's sockets on an address of the loopback network, without a bus: only the master
 * (address 0) answers. */
#include "network/gateway_sockets.h"

#include <errno.h>
#include <poll.h>
#include <unistd.h>

#include "base/bytes.h"
#include "harness/test.h"
#include "mailbox/mailbox.h"

enum { PORT = 34980, UPLOAD_BYTES = 18 };

struct bench {
	struct sockaddr_in address;
	struct gateway_sockets *sockets;
	struct mailbox_engine *mb;
	mono_t now;
};

static mono_t still(void *ctx)
{
	(void)ctx;
	return (mono_t){ 1 };
}

/* An address of this process alone: tests run at the same time. */
static void bench_open(struct bench *b)
{
	const struct mailbox_wire wire = { .now = still };
	uint32_t pid = (uint32_t)getpid();
	char error[256] = "";

	*b = (struct bench){ .address = { .sin_family = AF_INET, .sin_port = htons(PORT) },
			     .now = { NS_PER_S } };
	b->address.sin_addr.s_addr = htonl(0x7f000000u | (pid % 0xfffff0 + 2));
	CHECK_EQ(mailbox_create(&wire, &b->mb), 0);
	CHECK_EQ(gateway_sockets_create((const struct sockaddr *)&b->address, sizeof(b->address),
					&b->sockets, error, sizeof(error)),
		 0);
}

static void bench_close(struct bench *b)
{
	gateway_sockets_destroy(b->sockets);
	mailbox_destroy(b->mb);
}

static int bench_connect(const struct bench *b, int type)
{
	int fd = socket(AF_INET, type | SOCK_CLOEXEC, 0);

	CHECK_EQ(connect(fd, (const struct sockaddr *)&b->address, sizeof(b->address)), 0);
	return fd;
}

static void serve(struct bench *b)
{
	const struct gateway_bus bus = { .mb = b->mb, .timeout = { NS_PER_S } };

	gateway_sockets_service(b->sockets, &bus, b->now);
}

static void serve_for(struct bench *b, unsigned passes)
{
	while (passes-- > 0) {
		serve(b);
	}
}

static struct gateway_counters counters(struct bench *b)
{
	return *gateway_counters(gateway_sockets_gateway(b->sockets));
}

/* An SDO upload from the master. */
static void make_upload(uint8_t *bytes, uint8_t counter)
{
	static const uint8_t sdo[] = { 0, 0x20, 0x40, 0x18, 0x10, 1, 0, 0, 0, 0 };
	const struct gateway_mail mail = {
		.header = { .data_len = sizeof(sdo), .type = MAILBOX_TYPE_COE, .counter = counter },
		.data = sdo
	};

	CHECK_EQ(gateway_frame_put(bytes, &mail), UPLOAD_BYTES);
}

static void must_receive_abort(int fd, uint8_t counter)
{
	uint8_t answer[UPLOAD_BYTES + 1];

	CHECK_EQ(recv(fd, answer, sizeof(answer), MSG_DONTWAIT), UPLOAD_BYTES);
	CHECK_EQ(answer[7], MAILBOX_TYPE_COE | counter << 4);
	CHECK_EQ(answer[10], 0x80);
	CHECK_EQ(get_le32(answer + 14), 0x06020000);
}

static void must_be_closed(int fd)
{
	char byte;
	ssize_t n = recv(fd, &byte, 1, MSG_DONTWAIT);

	CHECK(n == 0 || (n < 0 && errno == ECONNRESET));
	close(fd);
}

TEST(gateway_sockets, udp_and_tcp_are_answered_with_the_counter_of_the_request)
{
	static const int types[] = { SOCK_DGRAM, SOCK_STREAM };
	struct bench b;

	bench_open(&b);
	for (unsigned i = 0; i < 2; i++) {
		uint8_t request[UPLOAD_BYTES];
		int fd = bench_connect(&b, types[i]);

		make_upload(request, (uint8_t)(3 + i));
		CHECK_EQ(send(fd, request, sizeof(request), 0), sizeof(request));
		serve_for(&b, 3);
		must_receive_abort(fd, (uint8_t)(3 + i));
		close(fd);
	}
	bench_close(&b);
}

TEST(gateway_sockets, a_message_byte_by_byte_is_answered_and_two_at_once_too)
{
	struct bench b;
	uint8_t request[2 * UPLOAD_BYTES];
	int fd;

	bench_open(&b);
	fd = bench_connect(&b, SOCK_STREAM);
	make_upload(request, 1);
	make_upload(request + UPLOAD_BYTES, 2);
	for (unsigned i = 0; i < UPLOAD_BYTES; i++) {
		CHECK_EQ(counters(&b).mails, 0);
		CHECK_EQ(send(fd, request + i, 1, 0), 1);
		serve_for(&b, 2);
	}
	serve(&b);
	must_receive_abort(fd, 1);
	CHECK_EQ(send(fd, request, sizeof(request), 0), sizeof(request));
	serve_for(&b, 3);
	CHECK_EQ(counters(&b).mails, 3);
	close(fd);
	bench_close(&b);
}

TEST(gateway_sockets, a_client_that_sends_no_message_is_disconnected_and_others_are_not)
{
	static const uint8_t rubbish[100] = { 0x11, 0x22 };
	struct bench b;
	uint8_t request[UPLOAD_BYTES];
	int good;
	int bad;

	bench_open(&b);
	good = bench_connect(&b, SOCK_STREAM);
	bad = bench_connect(&b, SOCK_STREAM);
	CHECK_EQ(send(bad, rubbish, sizeof(rubbish), 0), sizeof(rubbish));
	serve_for(&b, 3);
	must_be_closed(bad);
	CHECK_EQ(counters(&b).malformed, 1);
	CHECK_EQ(counters(&b).closed, 1);
	make_upload(request, 1);
	CHECK_EQ(send(good, request, sizeof(request), 0), sizeof(request));
	serve_for(&b, 3);
	must_receive_abort(good, 1);
	close(good);
	bench_close(&b);
}

TEST(gateway_sockets, a_message_that_stays_half_is_given_ten_seconds)
{
	struct bench b;
	uint8_t request[UPLOAD_BYTES];
	int fd;

	bench_open(&b);
	fd = bench_connect(&b, SOCK_STREAM);
	make_upload(request, 1);
	CHECK_EQ(send(fd, request, 5, 0), 5);
	serve_for(&b, 3);
	b.now = mono_add(b.now, (span_t){ 9 * NS_PER_S });
	serve(&b);
	CHECK_EQ(counters(&b).closed, 0);
	b.now = mono_add(b.now, (span_t){ 2 * NS_PER_S });
	serve(&b);
	CHECK_EQ(counters(&b).closed, 1);
	must_be_closed(fd);
	bench_close(&b);
}

TEST(gateway_sockets, a_client_that_reads_no_answers_is_not_read_and_then_disconnected)
{
	struct bench b;
	uint8_t request[UPLOAD_BYTES];
	uint64_t before;
	int small = 4096;
	int fd;

	bench_open(&b);
	fd = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
	CHECK_EQ(setsockopt(fd, SOL_SOCKET, SO_RCVBUF, &small, sizeof(small)), 0);
	connect(fd, (const struct sockaddr *)&b.address, sizeof(b.address));
	make_upload(request, 1);
	/* Until the gateway reads no more. */
	do {
		before = counters(&b).mails;
		while (send(fd, request, sizeof(request), MSG_NOSIGNAL) > 0) {
		}
		serve_for(&b, 1000);
	} while (counters(&b).mails != before);
	CHECK_EQ(counters(&b).closed, 0);
	CHECK(gateway_sockets_is_busy(b.sockets));
	/* The kernel may take some more of the answers at first. */
	for (unsigned i = 0; i < 1000 && counters(&b).closed == 0; i++) {
		b.now = mono_add(b.now, (span_t){ 11 * NS_PER_S });
		serve_for(&b, 2);
	}
	CHECK_EQ(counters(&b).closed, 1);
	CHECK(!gateway_sockets_is_busy(b.sockets));
	close(fd);
	bench_close(&b);
}

TEST(gateway_sockets, one_connection_too_many_waits_for_one_that_is_idle_for_a_minute)
{
	struct bench b;
	int fd[GATEWAY_CLIENTS + 2];

	bench_open(&b);
	for (unsigned i = 0; i <= GATEWAY_CLIENTS; i++) {
		fd[i] = bench_connect(&b, SOCK_STREAM);
		serve(&b);
		b.now = mono_add(b.now, (span_t){ NS_PER_MS });
	}
	must_be_closed(fd[GATEWAY_CLIENTS]);
	b.now = mono_add(b.now, (span_t){ 61 * NS_PER_S });
	fd[GATEWAY_CLIENTS] = bench_connect(&b, SOCK_STREAM);
	serve_for(&b, 2);
	must_be_closed(fd[0]);
	for (unsigned i = 1; i <= GATEWAY_CLIENTS; i++) {
		close(fd[i]);
	}
	bench_close(&b);
}

TEST(gateway_sockets, an_address_that_is_in_use_is_an_error_of_one_line)
{
	struct bench b;
	struct gateway_sockets *second = NULL;
	char error[256] = "";

	bench_open(&b);
	CHECK_EQ(gateway_sockets_create((const struct sockaddr *)&b.address, sizeof(b.address),
					&second, error, sizeof(error)),
		 -EADDRINUSE);
	CHECK_STR(error, "Address already in use");
	CHECK(second == NULL);
	bench_close(&b);
}

TEST(gateway_sockets, the_descriptor_is_readable_only_while_there_is_something_to_do)
{
	struct bench b;
	struct pollfd watched;
	uint8_t request[UPLOAD_BYTES];
	int fd;

	bench_open(&b);
	watched = (struct pollfd){ .fd = gateway_sockets_fd(b.sockets), .events = POLLIN };
	CHECK_EQ(poll(&watched, 1, 0), 0);
	fd = bench_connect(&b, SOCK_STREAM);
	CHECK_EQ(poll(&watched, 1, 1000), 1);
	serve(&b);
	CHECK_EQ(poll(&watched, 1, 0), 0);
	make_upload(request, 1);
	CHECK_EQ(send(fd, request, sizeof(request), 0), sizeof(request));
	CHECK_EQ(poll(&watched, 1, 1000), 1);
	serve_for(&b, 3);
	CHECK_EQ(poll(&watched, 1, 0), 0);
	CHECK(!gateway_sockets_is_busy(b.sockets));
	close(fd);
	bench_close(&b);
}
