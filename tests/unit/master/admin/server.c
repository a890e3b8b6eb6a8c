/* SPDX-License-Identifier: MIT */
#include "admin/server.h"

#include <errno.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include "harness/test.h"
#include "unit/master/admin/target.h"

/* A server in a directory of its own, and the fake session behind it. */
struct bench {
	char dir[64];
	char path[100];
	struct admin_server *server;
	struct fake fake;
	mono_t now;
};

static void bench_open(struct bench *b)
{
	char error[256];

	snprintf(b->dir, sizeof(b->dir), "/tmp/ecdaq-admin-XXXXXX");
	CHECK(mkdtemp(b->dir) != NULL);
	snprintf(b->path, sizeof(b->path), "%s/admin", b->dir);
	CHECK_EQ(admin_server_create(b->path, (gid_t)-1, &b->server, error, sizeof(error)), 0);
	fake_init(&b->fake);
	b->now = (mono_t){ 1 };
}

static void bench_close(struct bench *b)
{
	admin_server_destroy(b->server);
	CHECK_EQ(access(b->path, F_OK), -1);
	CHECK_EQ(rmdir(b->dir), 0);
}

static int bench_connect(const struct bench *b)
{
	struct sockaddr_un address = { .sun_family = AF_UNIX };
	int fd = socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0);

	snprintf(address.sun_path, sizeof(address.sun_path), "%s", b->path);
	CHECK_EQ(connect(fd, (const struct sockaddr *)&address, sizeof(address)), 0);
	return fd;
}

static unsigned service(struct bench *b)
{
	struct admin_target target = fake_target(&b->fake);

	return admin_server_service(b->server, &target, b->now);
}

static void ask(int fd, const struct admin_request *rq)
{
	CHECK_EQ(send(fd, rq, sizeof(*rq), 0), sizeof(*rq));
}

static int has_answer(int fd)
{
	struct pollfd p = { .fd = fd, .events = POLLIN };

	return poll(&p, 1, 0) == 1;
}

static struct admin_reply answer(int fd)
{
	struct admin_reply reply;

	CHECK_EQ(recv(fd, &reply, sizeof(reply), MSG_DONTWAIT), sizeof(reply));
	CHECK_EQ(reply.magic, ADMIN_MAGIC);
	return reply;
}

/* A client whose set waits for the cycle. */
static int connect_and_set(struct bench *b)
{
	struct admin_request rq = fake_request(ADMIN_SET);
	int fd = bench_connect(b);

	fake_item(&rq, "a.led", 1);
	ask(fd, &rq);
	CHECK_EQ(service(b), 1);
	return fd;
}

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
	b.now.ns += ADMIN_ANSWER_TIMEOUT_NS - 1;
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
	int fd[ADMIN_CLIENTS];
	int late;

	bench_open(&b);
	for (int i = 0; i < ADMIN_CLIENTS; i++) {
		fd[i] = bench_connect(&b);
		service(&b);
	}
	late = bench_connect(&b);
	service(&b);
	CHECK_EQ(answer(late).result, -EBUSY);
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
	CHECK_EQ(service(&b), 1);
	fake_cycle(&b.fake, 5);
	CHECK_EQ(service(&b), 0);
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
