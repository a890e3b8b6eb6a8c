/* SPDX-License-Identifier: MIT */
/* An admin server in a directory of its own, the fake session behind it, and clients. */
#ifndef TESTS_UNIT_ADMIN_SERVER_BENCH_H
#define TESTS_UNIT_ADMIN_SERVER_BENCH_H

#include "admin/server.h"
#include "unit/master/admin/target.h"

struct bench {
	char dir[64];
	char path[100];
	struct admin_server *server;
	struct fake fake;
	mono_t now;
};

void bench_open(struct bench *b);
/** The server's socket and directory must be gone then. */
void bench_close(struct bench *b);
/** A client's descriptor. */
int bench_connect(const struct bench *b);
/** One pass of the server: requests that are open. */
unsigned service(struct bench *b);

void ask(int fd, const struct admin_request *rq);
int has_answer(int fd);
struct admin_reply answer(int fd);
/** A client whose set waits for the cycle. */
int connect_and_set(struct bench *b);

#endif
