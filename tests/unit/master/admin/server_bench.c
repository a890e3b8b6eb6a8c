/* SPDX-License-Identifier: MIT */
#include "unit/master/admin/server_bench.h"

#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include "harness/test.h"

void bench_open(struct bench *b)
{
	char error[256];

	snprintf(b->dir, sizeof(b->dir), "/tmp/ecdaq-admin-XXXXXX");
	CHECK(mkdtemp(b->dir) != NULL);
	snprintf(b->path, sizeof(b->path), "%s/admin", b->dir);
	CHECK_EQ(admin_server_create(b->path, (gid_t)-1, &b->server, error, sizeof(error)), 0);
	fake_init(&b->fake);
	b->now = (mono_t){ 1 };
}

void bench_close(struct bench *b)
{
	admin_server_destroy(b->server);
	CHECK_EQ(access(b->path, F_OK), -1);
	CHECK_EQ(rmdir(b->dir), 0);
}

int bench_connect(const struct bench *b)
{
	struct sockaddr_un address = { .sun_family = AF_UNIX };
	int fd = socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0);

	snprintf(address.sun_path, sizeof(address.sun_path), "%s", b->path);
	CHECK_EQ(connect(fd, (const struct sockaddr *)&address, sizeof(address)), 0);
	return fd;
}

unsigned service(struct bench *b)
{
	struct admin_target target = fake_target(&b->fake);

	return admin_server_service(b->server, &target, b->now);
}

void ask(int fd, const struct admin_request *rq)
{
	CHECK_EQ(send(fd, rq, sizeof(*rq), 0), sizeof(*rq));
}

int has_answer(int fd)
{
	struct pollfd p = { .fd = fd, .events = POLLIN };

	return poll(&p, 1, 0) == 1;
}

struct admin_reply answer(int fd)
{
	struct admin_reply reply;

	CHECK_EQ(recv(fd, &reply, sizeof(reply), MSG_DONTWAIT), sizeof(reply));
	CHECK_EQ(reply.magic, ADMIN_MAGIC);
	return reply;
}

int connect_and_set(struct bench *b)
{
	struct admin_request rq = fake_request(ADMIN_SET);
	int fd = bench_connect(b);

	fake_item(&rq, "a.led", 1);
	ask(fd, &rq);
	CHECK_EQ(service(b), 1);
	return fd;
}
