/* SPDX-License-Identifier: MIT */
/*
 * Members of the group who use the admin socket as they like: each input is a sequence of steps of
 * 20 clients (connect, ask, send half a request or data that were not announced, cancel, read
 * nothing, leave) and of the session (time passes, a request is done). Whatever they do: a client
 * that behaves is answered in the next pass, no pass takes two frames, and nothing stays open when
 * all have left.
 */
#include <assert.h>
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include "admin/command.h"
#include "admin/server.h"

enum { CLIENTS = 20, STEP_BYTES = 6, STEPS_MAX = 100 };

enum step { CONNECT, ASK, ASK_MORE, GARBAGE, LEAVE, READ, PASS_TIME, COMPLETE, STEPS };

static char dir[] = "/tmp/ecdaq-fuzz-XXXXXX";
static char path[sizeof(dir) + 8];
static struct admin_server *server;
static struct config cfg;
static struct slave_info slaves[2];
static mono_t now;
static int client[CLIENTS];
static int good;
static struct admin_pending *open_request[ADMIN_PENDING];
static unsigned open_count;
static unsigned frames;
static int is_cancel_slow;

/* --- the session --- */

static void complete(unsigned n, int result)
{
	struct admin_pending *pending = open_request[n];

	open_request[n] = open_request[--open_count];
	if (result == 0 && pending->request.length % 2 != 0) {
		size_t bytes = 1 + pending->request.length % 20000;
		uint8_t *room = admin_pending_reserve(pending, bytes);

		assert(room != NULL);
		memset(room, 0x55, bytes);
		admin_pending_answer_len(pending, bytes);
	}
	admin_pending_complete(pending, result);
}

static void cancel(struct admin_pending *pending)
{
	for (unsigned n = 0; n < open_count && !is_cancel_slow; n++) {
		if (open_request[n] == pending) {
			complete(n, -ECANCELED);
		}
	}
}

static void keep_open(struct admin_pending *pending)
{
	assert(open_count < ADMIN_PENDING);
	open_request[open_count++] = pending;
	pending->cancel = cancel;
}

static void mailbox(void *ctx, struct admin_pending *pending)
{
	(void)ctx;
	assert(pending->request.slave_pos < 2);
	assert(pending->data_len >= pending->request.data_total);
	keep_open(pending);
}

static void poll_state(struct admin_pending *pending, const struct admin_target *target)
{
	(void)target;
	(void)pending;
	frames++;
}

static void bus_request(void *ctx, struct admin_pending *pending)
{
	(void)ctx;
	if (pending->request.verb == ADMIN_RESCAN) {
		keep_open(pending);
		return;
	}
	/* Answered from memory. */
	if (pending->request.verb == ADMIN_DATAGRAMS || pending->request.verb == ADMIN_COMPARE ||
	    pending->request.verb == ADMIN_CONFIG_RELOAD ||
	    pending->request.verb == ADMIN_STARTUP) {
		admin_pending_complete(pending, 0);
		return;
	}
	frames++;
	if (pending->request.verb == ADMIN_STATE || pending->request.verb == ADMIN_SII_WRITE) {
		keep_open(pending);
		pending->poll = poll_state;
		return;
	}
	admin_pending_complete(pending, 0);
}

/* It takes no frame, and stays open. */
static void capture(void *ctx, struct admin_pending *pending)
{
	(void)ctx;
	keep_open(pending);
}

static void nothing(void *ctx)
{
	(void)ctx;
}

static void emit(void *ctx, const struct event *ev)
{
	(void)ctx;
	(void)ev;
}

static unsigned service(void)
{
	const struct admin_target target = { .cfg = &cfg,
					     .slaves = slaves,
					     .slave_count = 2,
					     .mailbox = mailbox,
					     .bus_request = bus_request,
					     .capture = capture,
					     .stop = nothing,
					     .clear = nothing,
					     .emit = emit };
	unsigned waiting;

	frames = 0;
	waiting = admin_server_service(server, &target, now);
	assert(frames <= 1);
	assert(waiting <= ADMIN_PENDING);
	return waiting;
}

/* --- the clients --- */

static int connect_client(void)
{
	struct sockaddr_un address = { .sun_family = AF_UNIX };
	int fd = socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);

	memcpy(address.sun_path, path, strlen(path) + 1);
	assert(fd >= 0);
	assert(connect(fd, (const struct sockaddr *)&address, sizeof(address)) == 0);
	return fd;
}

static void check_good_client(void)
{
	const struct admin_request rq = { .magic = ADMIN_MAGIC, .verb = ADMIN_PING, .id = 77 };
	struct admin_reply reply;

	assert(send(good, &rq, sizeof(rq), MSG_NOSIGNAL) == (ssize_t)sizeof(rq));
	service();
	assert(recv(good, &reply, sizeof(reply), 0) == (ssize_t)sizeof(reply));
	assert(reply.id == 77 && reply.result == 0 && reply.kind == ADMIN_REPLY_DONE);
}

static void ask(int fd, const uint8_t *arg)
{
	static const uint8_t verbs[] = {
		ADMIN_PING,          ADMIN_SET,       ADMIN_SDO_READ, ADMIN_SDO_WRITE,
		ADMIN_STOP,          ADMIN_CANCEL,    ADMIN_RESCAN,   ADMIN_STATE,
		ADMIN_REGISTER_READ, ADMIN_SII_WRITE, ADMIN_VOE,      ADMIN_FOE_WRITE,
		ADMIN_DIAGNOSIS,     ADMIN_SOE_READ,  ADMIN_CLEAR,    ADMIN_ERRORS_RESET,
		ADMIN_DATAGRAMS,     ADMIN_COMPARE,   ADMIN_CAPTURE,  ADMIN_CONFIG_RELOAD,
		ADMIN_STARTUP
	};
	struct admin_request rq = { .magic = ADMIN_MAGIC,
				    .verb = verbs[arg[0] % sizeof(verbs)],
				    .id = arg[1] % 16,
				    .slave_pos = arg[2] % 3,
				    .length = (uint32_t)arg[2] * 100 + 1,
				    .timeout_ms = arg[3] % 4 == 0 ? arg[3] * 16u : 0,
				    .data_len = arg[3] * 5u,
				    .argument = { 1 },
				    .name = "file" };

	rq.data_total = arg[2] % 2 != 0 ? rq.data_len + arg[3] * UINT32_C(70000) : 0;
	send(fd, &rq, sizeof(rq), MSG_NOSIGNAL);
}

static void ask_more(int fd, const uint8_t *arg)
{
	const struct admin_request rq = { .magic = ADMIN_MAGIC,
					  .verb = ADMIN_DATA,
					  .id = arg[1] % 16,
					  .data_len = arg[2] % 2 != 0 ? ADMIN_DATA_BYTES : arg[2],
					  .data_offset = arg[3] * 5u };

	send(fd, &rq, sizeof(rq), MSG_NOSIGNAL);
}

static void send_garbage(int fd, const uint8_t *arg)
{
	uint8_t bytes[sizeof(struct admin_request) + 16];
	size_t len = (size_t)(arg[1] * 256 + arg[2]) % sizeof(bytes);

	memset(bytes, arg[0], sizeof(bytes));
	send(fd, bytes, len, MSG_NOSIGNAL);
}

static void read_some(int fd, unsigned count)
{
	struct admin_reply reply;

	while (count-- > 0 && recv(fd, &reply, sizeof(reply), 0) == (ssize_t)sizeof(reply)) {
		assert(reply.magic == ADMIN_MAGIC && reply.kind <= ADMIN_REPLY_PROGRESS);
		assert(reply.data_len <= ADMIN_DATA_BYTES);
		assert(memchr(reply.text, '\0', sizeof(reply.text)) != NULL);
		assert(reply.result >= 0 || reply.text[0] != '\0');
	}
}

static void leave(unsigned n)
{
	if (client[n] >= 0) {
		close(client[n]);
		client[n] = -1;
	}
}

static void take_step(const uint8_t *step)
{
	unsigned n = step[1] % CLIENTS;
	const uint8_t *arg = step + 2;

	switch ((enum step)(step[0] % STEPS)) {
	case CONNECT:
		leave(n);
		client[n] = connect_client();
		break;
	case ASK:
		ask(client[n], arg);
		break;
	case ASK_MORE:
		ask_more(client[n], arg);
		break;
	case GARBAGE:
		send_garbage(client[n], arg);
		break;
	case LEAVE:
		leave(n);
		break;
	case READ:
		read_some(client[n], arg[0]);
		break;
	case PASS_TIME:
		now.ns += arg[0] * 20 * NS_PER_MS;
		is_cancel_slow = arg[1] % 2;
		break;
	case COMPLETE:
		if (open_count > 0) {
			complete(arg[0] % open_count, arg[1] % 2 == 0 ? 0 : -EIO);
		}
		break;
	case STEPS:
		break;
	}
}

static void remove_dir(void)
{
	rmdir(dir);
}

static void begin(void)
{
	char error[256];

	if (path[0] == '\0') {
		assert(mkdtemp(dir) != NULL);
		atexit(remove_dir);
		snprintf(path, sizeof(path), "%s/admin", dir);
		cfg.cycle_period_ns = 1000000;
	}
	assert(admin_server_create(path, (gid_t)-1, &server, error, sizeof(error)) == 0);
	now = (mono_t){ 1 };
	open_count = 0;
	is_cancel_slow = 0;
	for (unsigned n = 0; n < CLIENTS; n++) {
		client[n] = -1;
	}
	good = connect_client();
	service();
}

static void end(void)
{
	for (unsigned n = 0; n < CLIENTS; n++) {
		leave(n);
	}
	service();
	while (open_count > 0) {
		complete(0, -ECANCELED);
	}
	service();
	assert(service() == 0);
	close(good);
	admin_server_destroy(server);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
	begin();
	for (size_t i = 0; i + STEP_BYTES <= size && i < (size_t)STEP_BYTES * STEPS_MAX;
	     i += STEP_BYTES) {
		take_step(data + i);
		check_good_client();
	}
	end();
	return 0;
}
