/* SPDX-License-Identifier: MIT */
#include "admin/server.h"

#include <errno.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include "harness/test.h"
#include "unit/master/admin/server_bench.h"
#include "unit/master/admin/target.h"

TEST(admin_server, the_socket_is_for_owner_and_group_only)
{
	struct bench b;
	struct stat st;

	bench_open(&b);
	CHECK_EQ(stat(b.path, &st), 0);
	CHECK(S_ISSOCK(st.st_mode));
	CHECK_EQ(st.st_mode & 07777, 0660);
	bench_close(&b);
}

TEST(admin_server, a_ping_is_answered_in_the_pass_that_finds_it)
{
	struct bench b;
	struct admin_request rq = fake_request(ADMIN_PING);
	int fd;

	bench_open(&b);
	fd = bench_connect(&b);
	ask(fd, &rq);
	CHECK_EQ(service(&b), 0);
	CHECK_EQ(answer(fd).result, 0);
	close(fd);
	service(&b);
	bench_close(&b);
}

TEST(admin_server, its_descriptor_polls_readable_when_there_is_something_to_do)
{
	struct bench b;
	struct admin_request rq = fake_request(ADMIN_PING);
	int fd;

	bench_open(&b);
	CHECK(!has_answer(admin_server_fd(b.server)));
	fd = bench_connect(&b);
	CHECK(has_answer(admin_server_fd(b.server)));
	service(&b);
	CHECK(!has_answer(admin_server_fd(b.server)));
	ask(fd, &rq);
	CHECK(has_answer(admin_server_fd(b.server)));
	service(&b);
	CHECK(!has_answer(admin_server_fd(b.server)));
	close(fd);
	bench_close(&b);
}

/* Requests go on in a pass that asks no socket: they end in time. */
TEST(admin_server, a_pass_behind_silence_asks_no_socket_and_the_next_one_does)
{
	struct bench b;
	struct admin_request rq = fake_request(ADMIN_PING);
	int waiting;
	int fd;

	bench_open(&b);
	waiting = connect_and_set(&b);
	fd = bench_connect(&b);
	ask(fd, &rq);
	b.now = mono_add(b.now, (span_t){ 2 * NS_PER_S });
	admin_server_note_silence(b.server);
	CHECK_EQ(service(&b), 0);
	CHECK_EQ(answer(waiting).result, -ETIMEDOUT);
	CHECK(!has_answer(fd));
	service(&b);
	CHECK_EQ(answer(fd).result, 0);
	close(waiting);
	close(fd);
	bench_close(&b);
}

TEST(admin_server, a_set_is_answered_only_after_the_cycle_took_it)
{
	struct bench b;
	struct admin_request other = fake_request(ADMIN_PING);
	struct admin_reply reply;
	int fd;
	int second;

	bench_open(&b);
	fd = connect_and_set(&b);
	second = bench_connect(&b);
	CHECK(!has_answer(fd));
	ask(second, &other); /* the first one's answer is not waited for */
	CHECK_EQ(service(&b), 1);
	CHECK_EQ(answer(second).result, 0);
	fake_cycle(&b.fake, 99);
	CHECK_EQ(service(&b), 0);
	reply = answer(fd);
	CHECK_EQ(reply.result, 0);
	CHECK_EQ(reply.cycle, 99);
	close(fd);
	close(second);
	bench_close(&b);
}

TEST(admin_server, a_set_that_the_cycle_does_not_take_times_out_after_a_second)
{
	struct bench b;
	int fd;

	bench_open(&b);
	fd = connect_and_set(&b);
	b.now.ns += NS_PER_S - 1;
	CHECK_EQ(service(&b), 1);
	b.now.ns += 1;
	CHECK_EQ(service(&b), 0);
	CHECK_EQ(answer(fd).result, -ETIMEDOUT);
	close(fd);
	bench_close(&b);
}

TEST(admin_server, damaged_messages_are_answered_and_foreign_ones_close_the_connection)
{
	struct bench b;
	struct admin_request rq = fake_request(99);
	char byte;
	int fd;

	bench_open(&b);
	fd = bench_connect(&b);
	ask(fd, &rq);
	service(&b);
	CHECK_EQ(answer(fd).result, -EINVAL);
	CHECK_EQ(send(fd, "hello", 5, 0), 5);
	service(&b);
	CHECK_EQ(answer(fd).result, -EMSGSIZE);
	CHECK_EQ(recv(fd, &byte, 1, MSG_DONTWAIT), 0);
	close(fd);
	bench_close(&b);
}

TEST(admin_server, the_seventeenth_client_is_rejected_and_the_others_continue)
{
	struct bench b;
	struct admin_request rq = fake_request(ADMIN_PING);
	struct admin_request set = fake_request(ADMIN_SET);
	struct admin_request stop = fake_request(ADMIN_STOP);
	int fd[ADMIN_CLIENTS];
	int late;

	bench_open(&b);
	fake_item(&set, "a.led", 1);
	for (int i = 0; i < ADMIN_CLIENTS; i++) {
		fd[i] = bench_connect(&b);
		service(&b);
	}
	late = bench_connect(&b);
	ask(late, &set);
	service(&b);
	CHECK_EQ(answer(late).result, -EBUSY);
	close(late);
	/* But whether it lives, and that it shall stop, can always be said. */
	late = bench_connect(&b);
	ask(late, &rq);
	service(&b);
	CHECK_EQ(answer(late).result, 0);
	ask(late, &stop);
	service(&b);
	CHECK_EQ(answer(late).result, 0);
	CHECK_EQ(b.fake.stops, 1);
	close(late);
	ask(fd[ADMIN_CLIENTS - 1], &rq);
	service(&b);
	CHECK_EQ(answer(fd[ADMIN_CLIENTS - 1]).result, 0);
	close(fd[0]);
	service(&b);
	fd[0] = bench_connect(&b); /* its place is free again */
	ask(fd[0], &rq);
	service(&b);
	service(&b);
	CHECK_EQ(answer(fd[0]).result, 0);
	for (int i = 0; i < ADMIN_CLIENTS; i++) {
		close(fd[i]);
	}
	bench_close(&b);
}

TEST(admin_server, a_client_that_disconnects_while_it_waits_does_no_harm)
{
	struct bench b;
	int fd;

	bench_open(&b);
	fd = connect_and_set(&b);
	close(fd);
	CHECK_EQ(service(&b), 0);
	fake_cycle(&b.fake, 5);
	CHECK_EQ(service(&b), 0);
	bench_close(&b);
}

/* --- requests that are answered later --- */

static int connect_and_read_sdo(struct bench *b, uint32_t id, uint32_t timeout_ms)
{
	struct admin_request rq = fake_request(ADMIN_SDO_READ);
	int fd = bench_connect(b);

	b->fake.is_sdo_slow = 1;
	rq.id = id;
	rq.timeout_ms = timeout_ms;
	rq.index = 0x1018;
	ask(fd, &rq);
	CHECK_EQ(service(b), 1);
	CHECK(!has_answer(fd));
	return fd;
}

/* The same beside another one. */
static int connect_and_open(struct bench *b, uint32_t id)
{
	struct admin_request rq = fake_request(ADMIN_SDO_READ);
	int fd = bench_connect(b);

	rq.id = id;
	ask(fd, &rq);
	CHECK_EQ(service(b), 2);
	return fd;
}

static void ask_verb(int fd, enum admin_verb verb, uint32_t id)
{
	struct admin_request rq = fake_request(verb);

	rq.id = id;
	ask(fd, &rq);
}

TEST(admin_server, ping_and_stop_are_answered_while_a_request_of_the_same_client_is_open)
{
	struct bench b;
	struct admin_reply reply;
	int fd;

	bench_open(&b);
	fd = connect_and_read_sdo(&b, 7, 0);
	ask_verb(fd, ADMIN_PING, 8);
	ask_verb(fd, ADMIN_STOP, 9);
	CHECK_EQ(service(&b), 1);
	CHECK_EQ(answer(fd).id, 8);
	CHECK_EQ(answer(fd).id, 9);
	CHECK_EQ(b.fake.stops, 1);
	b.fake.pending->reply.data[0] = 0x42;
	b.fake.pending->reply.data_len = 1;
	admin_pending_complete(b.fake.pending, 0);
	CHECK_EQ(service(&b), 0);
	reply = answer(fd);
	CHECK_EQ(reply.id, 7);
	CHECK_EQ(reply.result, 0);
	CHECK_EQ(reply.data[0], 0x42);
	close(fd);
	bench_close(&b);
}

TEST(admin_server, progress_comes_before_the_answer)
{
	struct bench b;
	struct admin_reply reply;
	int fd;

	bench_open(&b);
	fd = connect_and_read_sdo(&b, 7, 0);
	admin_pending_progress(b.fake.pending, 300, 1000);
	service(&b);
	reply = answer(fd);
	CHECK_EQ(reply.kind, ADMIN_REPLY_PROGRESS);
	CHECK_EQ(reply.id, 7);
	CHECK_EQ(reply.done, 300);
	CHECK_EQ(reply.total, 1000);
	service(&b);
	CHECK(!has_answer(fd)); /* once */
	admin_pending_complete(b.fake.pending, 0);
	service(&b);
	CHECK_EQ(answer(fd).kind, ADMIN_REPLY_DONE);
	close(fd);
	bench_close(&b);
}

TEST(admin_server, a_request_ends_by_cancel_by_its_timeout_and_with_its_client)
{
	struct bench b;
	struct admin_reply reply;
	int fd;

	bench_open(&b);
	fd = connect_and_read_sdo(&b, 7, 0);
	ask_verb(fd, ADMIN_CANCEL, 7);
	CHECK_EQ(service(&b), 0);
	reply = answer(fd);
	CHECK_EQ(reply.id, 7);
	CHECK_EQ(reply.result, -ECANCELED);
	CHECK_EQ(b.fake.cancels, 1);
	ask_verb(fd, ADMIN_CANCEL, 7);
	service(&b);
	CHECK_EQ(answer(fd).result, -ENOENT);
	close(fd);

	fd = connect_and_read_sdo(&b, 8, 300);
	b.now.ns += 300 * NS_PER_MS - 1;
	CHECK_EQ(service(&b), 1);
	b.now.ns += 1;
	CHECK_EQ(service(&b), 0);
	reply = answer(fd);
	CHECK_EQ(reply.id, 8);
	CHECK_EQ(reply.result, -ETIMEDOUT);
	CHECK_EQ(b.fake.cancels, 2);
	close(fd);

	fd = connect_and_read_sdo(&b, 9, 0);
	close(fd);
	CHECK_EQ(service(&b), 0);
	CHECK_EQ(b.fake.cancels, 3);
	bench_close(&b);
}

TEST(admin_server, a_look_at_a_bus_that_is_brought_up_for_long_ends_with_the_reason)
{
	struct bench b;
	struct admin_target target;
	struct admin_reply reply;
	int fd;

	bench_open(&b);
	target = fake_target(&b.fake);
	target.bus_request = NULL;
	fd = bench_connect(&b);
	ask_verb(fd, ADMIN_COMPARE, 7);
	CHECK_EQ(admin_server_service(b.server, &target, b.now), 1);
	b.now.ns += ADMIN_TIMEOUT_S * NS_PER_S;
	CHECK_EQ(admin_server_service(b.server, &target, b.now), 0);
	reply = answer(fd);
	CHECK_EQ(reply.result, -ETIMEDOUT);
	CHECK_STR(reply.text, "the bus is being brought up");
	close(fd);
	bench_close(&b);
}

TEST(admin_server, a_cancelled_request_stays_valid_until_its_executor_has_completed_it)
{
	struct bench b;
	struct admin_pending *old;
	int fd;

	bench_open(&b);
	b.fake.is_cancel_slow = 1;
	fd = connect_and_read_sdo(&b, 7, 0);
	old = b.fake.pending;
	close(fd);
	CHECK_EQ(service(&b), 1);
	CHECK_EQ(b.fake.cancels, 1);
	fd = connect_and_open(&b, 7);
	CHECK(b.fake.pending != old);
	CHECK_EQ(old->request.index, 0x1018);
	admin_pending_complete(old, -ECANCELED);
	CHECK_EQ(service(&b), 1);
	CHECK(!has_answer(fd)); /* nothing for the new one, which has the same id */
	admin_pending_complete(b.fake.pending, 0);
	CHECK_EQ(service(&b), 0);
	CHECK_EQ(answer(fd).result, 0);
	CHECK_EQ(b.fake.cancels, 1);
	close(fd);
	bench_close(&b);
}

TEST(admin_server, all_requests_can_be_cancelled_and_their_clients_get_an_answer)
{
	struct bench b;
	int fd;
	int second;

	bench_open(&b);
	fd = connect_and_read_sdo(&b, 7, 0);
	second = connect_and_open(&b, 1);
	admin_server_cancel_all(b.server);
	CHECK_EQ(service(&b), 0);
	CHECK_EQ(answer(fd).result, -ECANCELED);
	CHECK_EQ(answer(second).result, -ECANCELED);
	close(fd);
	close(second);
	bench_close(&b);
}

TEST(admin_server, a_capture_outlives_the_bus_and_ends_with_its_client)
{
	struct bench b;
	int fd;

	bench_open(&b);
	fd = connect_and_read_sdo(&b, 7, 0);
	b.fake.pending->outlives_bus = 1;
	admin_server_cancel_all(b.server);
	CHECK_EQ(service(&b), 1);
	CHECK_EQ(b.fake.cancels, 0);
	close(fd);
	CHECK_EQ(service(&b), 0);
	CHECK_EQ(b.fake.cancels, 1);
	bench_close(&b);
}

/* Octet @i of a long transfer. */
static uint8_t octet(size_t i)
{
	return (uint8_t)(i * 7 + i / 251);
}

TEST(admin_server, a_long_answer_comes_in_parts_and_waits_for_its_reader)
{
	enum { BYTES = 1 << 20 };
	struct bench b;
	struct admin_reply reply = { .kind = ADMIN_REPLY_DATA };
	size_t got = 0;
	uint8_t *room;
	int fd;

	bench_open(&b);
	fd = connect_and_read_sdo(&b, 7, 0);
	room = admin_pending_reserve(b.fake.pending, BYTES + 10);
	for (size_t i = 0; i < BYTES; i++) {
		room[i] = octet(i);
	}
	admin_pending_answer_len(b.fake.pending, BYTES);
	admin_pending_complete(b.fake.pending, 0);
	CHECK_EQ(service(&b), 1); /* more than a socket takes */
	ask_verb(fd, ADMIN_PING, 8);
	while (reply.kind == ADMIN_REPLY_DATA) {
		if (!has_answer(fd)) {
			service(&b);
		}
		reply = answer(fd);
		if (reply.id == 8) {
			reply.kind = ADMIN_REPLY_DATA;
			continue;
		}
		CHECK_EQ(reply.data_total, BYTES);
		CHECK_EQ(reply.data_offset, got);
		for (size_t i = 0; i < reply.data_len; i++) {
			CHECK_EQ(reply.data[i], octet(got + i));
		}
		got += reply.data_len;
	}
	CHECK_EQ(got, BYTES);
	CHECK_EQ(service(&b), 0);
	close(fd);
	bench_close(&b);
}

TEST(admin_server, a_client_that_does_not_read_its_answer_is_closed_after_two_seconds)
{
	struct bench b;
	int fd;

	bench_open(&b);
	fd = connect_and_read_sdo(&b, 7, 0);
	CHECK(admin_pending_reserve(b.fake.pending, ADMIN_TRANSFER_BYTES) != NULL);
	CHECK(admin_pending_reserve(b.fake.pending, ADMIN_TRANSFER_BYTES + 1) == NULL);
	memset(b.fake.pending->answer, 0, ADMIN_TRANSFER_BYTES);
	admin_pending_answer_len(b.fake.pending, ADMIN_TRANSFER_BYTES);
	admin_pending_complete(b.fake.pending, 0);
	CHECK_EQ(service(&b), 1);
	b.now.ns += 2 * NS_PER_S - 1;
	CHECK_EQ(service(&b), 1);
	b.now.ns += 1;
	service(&b);
	CHECK_EQ(service(&b), 0);
	close(fd);
	bench_close(&b);
}

TEST(admin_server, long_data_of_a_request_are_collected_before_it_is_executed)
{
	enum { BYTES = 5000 };
	struct bench b;
	struct admin_request rq = fake_request(ADMIN_SDO_WRITE);
	int fd;

	bench_open(&b);
	b.fake.is_sdo_slow = 1;
	fd = bench_connect(&b);
	rq.id = 3;
	rq.data_total = BYTES;
	for (size_t at = 0; at < BYTES; at += rq.data_len) {
		rq.data_offset = (uint32_t)at;
		rq.data_len =
			BYTES - at < ADMIN_DATA_BYTES ? (uint32_t)(BYTES - at) : ADMIN_DATA_BYTES;
		for (size_t i = 0; i < rq.data_len; i++) {
			rq.data[i] = octet(at + i);
		}
		CHECK(b.fake.pending == NULL);
		ask(fd, &rq);
		rq.verb = ADMIN_DATA;
		service(&b);
	}
	CHECK(b.fake.pending != NULL);
	CHECK_EQ(b.fake.pending->data_len, BYTES);
	for (size_t i = 0; i < BYTES; i++) {
		CHECK_EQ(b.fake.pending->data[i], octet(i));
	}
	admin_pending_complete(b.fake.pending, 0);
	CHECK_EQ(service(&b), 0);
	CHECK_EQ(answer(fd).id, 3);
	close(fd);
	bench_close(&b);
}

TEST(admin_server, data_out_of_order_end_the_request)
{
	struct bench b;
	struct admin_request rq = fake_request(ADMIN_SDO_WRITE);
	int fd;

	bench_open(&b);
	fd = bench_connect(&b);
	rq.id = 3;
	rq.data_total = 5000;
	rq.data_len = ADMIN_DATA_BYTES;
	ask(fd, &rq);
	rq.verb = ADMIN_DATA;
	rq.data_offset = 2 * ADMIN_DATA_BYTES;
	ask(fd, &rq);
	CHECK_EQ(service(&b), 0);
	CHECK_EQ(answer(fd).result, -EINVAL);
	ask(fd, &rq);
	CHECK_EQ(service(&b), 0);
	CHECK_EQ(answer(fd).result, -ENOENT);
	CHECK(b.fake.pending == NULL);
	close(fd);
	bench_close(&b);
}

TEST(admin_server, a_client_has_eight_requests_open_at_most_and_ids_are_its_own)
{
	struct bench b;
	struct admin_request rq = fake_request(ADMIN_SDO_READ);
	int fd;

	bench_open(&b);
	fd = connect_and_read_sdo(&b, 0, 0);
	ask(fd, &rq);
	service(&b);
	CHECK_EQ(answer(fd).result, -EEXIST);
	for (rq.id = 1; rq.id < 8; rq.id++) {
		ask(fd, &rq);
	}
	CHECK_EQ(service(&b), 8);
	CHECK(!has_answer(fd));
	ask(fd, &rq);
	CHECK_EQ(service(&b), 8);
	CHECK_EQ(answer(fd).result, -EBUSY);
	close(fd);
	CHECK_EQ(service(&b), 0);
	CHECK_EQ(b.fake.cancels, 8);
	bench_close(&b);
}

TEST(admin_server, data_that_were_announced_and_do_not_come_end_the_request_after_two_seconds)
{
	struct bench b;
	struct admin_request rq = fake_request(ADMIN_SII_WRITE);
	int fd;

	bench_open(&b);
	fd = bench_connect(&b);
	rq.id = 3;
	rq.data_total = ADMIN_TRANSFER_BYTES;
	rq.data_len = ADMIN_DATA_BYTES;
	ask(fd, &rq);
	service(&b);
	rq.verb = ADMIN_DATA;
	rq.data_offset = ADMIN_DATA_BYTES;
	b.now.ns += ADMIN_DATA_TIMEOUT_NS - 1;
	ask(fd, &rq); /* the next part has a time of its own */
	service(&b);
	b.now.ns += ADMIN_DATA_TIMEOUT_NS - 1;
	service(&b);
	CHECK(!has_answer(fd));
	b.now.ns += 1;
	service(&b);
	CHECK_EQ(answer(fd).result, -ETIMEDOUT);
	CHECK_EQ(b.fake.frames, 0);
	close(fd);
	bench_close(&b);
}

/* --- clients that ask for too much --- */

/* @count clients, each with as many requests of @verb as it may have open. */
static void connect_and_flood(struct bench *b, int *ret_fd, int count, enum admin_verb verb)
{
	struct admin_request rq = fake_request(verb);

	rq.length = 1;
	rq.argument[0] = 2;
	for (int i = 0; i < count; i++) {
		ret_fd[i] = bench_connect(b);
		for (rq.id = 0; rq.id < 8; rq.id++) {
			ask(ret_fd[i], &rq);
		}
	}
}

TEST(admin_server, requests_for_frames_get_one_in_a_pass_and_none_is_forgotten)
{
	enum { CLIENTS = 7, OPEN = 8 * CLIENTS };
	struct bench b;
	struct admin_request rq = fake_request(ADMIN_DIAGNOSIS);
	int fd[CLIENTS];
	int other;
	unsigned passes = 0;

	bench_open(&b);
	connect_and_flood(&b, fd, CLIENTS, ADMIN_STATE);
	other = bench_connect(&b);
	CHECK_EQ(service(&b), OPEN);
	CHECK_EQ(b.fake.frames, 1);
	ask(other, &rq);
	while (!has_answer(other)) {
		service(&b);
		CHECK_EQ(b.fake.frames, 2 + passes);
		passes++;
	}
	CHECK(passes <= ADMIN_PENDING);
	CHECK_EQ(answer(other).result, 0);
	b.now.ns += ADMIN_TIMEOUT_S * NS_PER_S;
	service(&b);
	for (int i = 0; i < CLIENTS; i++) {
		for (int n = 0; n < 8; n++) {
			CHECK_EQ(answer(fd[i]).result, -ETIMEDOUT);
		}
		close(fd[i]);
	}
	close(other);
	bench_close(&b);
}

TEST(admin_server, requests_that_wait_for_their_frame_can_be_cancelled_and_lose_their_client)
{
	struct bench b;
	struct admin_request cancel = fake_request(ADMIN_CANCEL);
	int fd[2];

	bench_open(&b);
	connect_and_flood(&b, fd, 2, ADMIN_REGISTER_READ);
	CHECK_EQ(service(&b), 15);
	CHECK_EQ(b.fake.frames, 1);
	CHECK_EQ(answer(fd[0]).result, 0);
	cancel.id = 7;
	ask(fd[0], &cancel);
	close(fd[1]);
	service(&b);
	CHECK_EQ(b.fake.frames, 2);
	admin_server_cancel_all(b.server);
	CHECK_EQ(service(&b), 0);
	CHECK_EQ(b.fake.frames, 2);
	for (int n = 0; n < 7; n++) {
		int result = answer(fd[0]).result;

		CHECK(result == (n == 1 ? 0 : -ECANCELED) || result == (n == 0 ? -ECANCELED : 0));
	}
	CHECK(!has_answer(fd[0]));
	close(fd[0]);
	bench_close(&b);
}

TEST(admin_server, a_client_with_a_thousand_requests_delays_no_other)
{
	struct bench b;
	struct admin_request rq = fake_request(ADMIN_SDO_READ);
	struct admin_request ping = fake_request(ADMIN_PING);
	int flood;
	int other;
	int is_open = 1;

	bench_open(&b);
	b.fake.is_sdo_slow = 1;
	flood = bench_connect(&b);
	other = bench_connect(&b);
	for (rq.id = 0; rq.id < 1000 && is_open; rq.id++) {
		is_open = send(flood, &rq, sizeof(rq), MSG_DONTWAIT | MSG_NOSIGNAL) == sizeof(rq);
		ask(other, &ping);
		CHECK(service(&b) <= 8);
		CHECK_EQ(answer(other).result, 0);
	}
	CHECK(!is_open); /* it does not read its answers: it is closed */
	CHECK_EQ(b.fake.cancels, 8);
	b.fake.is_sdo_slow = 0;
	rq.id = 1;
	ask(other, &rq);
	CHECK_EQ(service(&b), 0);
	CHECK_EQ(answer(other).result, 0);
	close(flood);
	close(other);
	bench_close(&b);
}

TEST(admin_server, a_path_that_cannot_be_bound_is_reported_in_one_line)
{
	struct admin_server *server = NULL;
	char error[256];

	CHECK_EQ(admin_server_create("/nowhere/admin", (gid_t)-1, &server, error, sizeof(error)),
		 -ENOENT);
	CHECK_STR(error, "admin socket /nowhere/admin: No such file or directory");
	CHECK(server == NULL);
}

TEST(admin_server, each_client_of_the_board_socket_gets_the_board)
{
	struct bench b;
	char path[100];
	char error[256];
	char byte;
	union {
		struct cmsghdr header;
		char bytes[CMSG_SPACE(sizeof(int))];
	} control;
	struct iovec data = { .iov_base = &byte, .iov_len = 1 };
	struct msghdr message = { .msg_iov = &data, .msg_iovlen = 1 };
	struct stat st;
	int board_fd = -1;
	struct board *board = board_create_shared(&board_fd);
	struct board *given;
	int fd;

	bench_open(&b);
	snprintf(path, sizeof(path), "%s/commands-remote", b.dir);
	CHECK_EQ(
		admin_server_offer_board(b.server, path, (gid_t)-1, board_fd, error, sizeof(error)),
		0);
	CHECK_EQ(stat(path, &st), 0);
	CHECK_EQ(st.st_mode & 07777, 0660);
	for (int i = 0; i < 2; i++) {
		snprintf(b.path, sizeof(b.path), "%s", path);
		fd = bench_connect(&b);
		CHECK(has_answer(admin_server_fd(b.server)));
		service(&b);
		CHECK(!has_answer(admin_server_fd(b.server)));
		message.msg_control = &control;
		message.msg_controllen = sizeof(control.bytes);
		CHECK_EQ(recvmsg(fd, &message, MSG_DONTWAIT | MSG_CMSG_CLOEXEC), 1);
		close(fd);
		memcpy(&fd, CMSG_DATA(&control.header), sizeof(fd));
		given = board_map(fd);
		CHECK(given != NULL);
		board_put(given, 1, 40 + (unsigned)i);
		CHECK_EQ(board->output[1].raw, 40 + (unsigned)i);
		board_unmap(given);
		close(fd);
	}
	board_unmap(board);
	close(board_fd);
	bench_close(&b); /* the server removes both sockets */
}
