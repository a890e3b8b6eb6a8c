/* SPDX-License-Identifier: MIT */
#include "web/command_server.h"

#include <errno.h>
#include <limits.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/epoll.h>
#include <sys/socket.h>
#include <unistd.h>

#include "base/clock.h"
#include "base/group.h"
#include "base/listener.h"
#include "base/platform.h"
#include "base/run_path.h"
#include "base/web_command.h"
#include "web/command.h"
#include "web/exports.h"
#include "web/sessions.h"

/* SPARE: for tokens, which ecdaq-web cannot use up. */
enum { CLIENTS = 24, SPARE = 4, IDLE_MS = 100, BUSY_MS = 5, LINE_BYTES = 400 };
#define REQUEST_NS (5 * NS_PER_S)
#define EXCHANGE_NS (NS_PER_S / 5) /* of all pages together: mailboxes are slow, and not theirs */
#define COMMAND_NS (60 * NS_PER_S)

enum { OK = 200, BAD = 400, NOT_LOGGED_IN = 401, FORBIDDEN = 403, REFUSED = 409 };
enum { TOO_MANY = 429, FAILED = 500, BUSY = 503, TOO_LATE = 504 };

struct client {
	int fd; /* -1: free */
	int is_token;
	int64_t end_ns;
	int pipe; /* of the command that is done; -1: none yet */
	int export;
	int is_paced;    /* its command */
	int is_watching; /* its command */
	int is_cut;      /* what the tool printed is longer than reply.text */
	size_t filled;   /* of reply.text */
	char who[LINE_BYTES];
	struct web_reply reply;
};

struct command_server {
	const struct config *cfg;
	void (*report)(const char *line);
	struct platform platform;
	char run_dir[CONFIG_PATH_BYTES];
	int poller;
	struct listener page;
	struct listener token;
	struct exports exports;
	int64_t mailbox_ns; /* from when on a mailbox may be asked again */
	struct client client[CLIENTS + SPARE];
	struct sessions sessions;
};

static int64_t now_of(const struct command_server *s)
{
	return s->platform.now(s->platform.ctx).ns;
}

static void report(const struct command_server *s, const char *format, ...)
	__attribute__((format(printf, 2, 3)));

static void report(const struct command_server *s, const char *format, ...)
{
	char line[2 * LINE_BYTES];
	va_list args;

	va_start(args, format);
	vsnprintf(line, sizeof(line), format, args);
	va_end(args);
	s->report(line);
}

static void answer(struct client *c, unsigned status, const char *text)
{
	c->reply.status = status;
	snprintf(c->reply.text, sizeof(c->reply.text), "%s", text);
}

static void answer_session(struct client *c, const struct session *session)
{
	char secret[WEB_SECRET_TEXT_BYTES];

	session_text(session->secret, secret);
	c->reply.status = OK;
	snprintf(c->reply.text, sizeof(c->reply.text), "{\"role\":\"%s\",\"secret\":\"%s\"}\n",
		 role_to_str(session->role), secret);
	explicit_bzero(secret, sizeof(secret));
}

static void log_in(struct command_server *s, struct client *c, const struct command_body *body)
{
	struct session *session;
	int r = body->count != 1
			? -EACCES
			: sessions_log_in(&s->sessions, body->line[0], now_of(s), &session);

	switch (r) {
	case 0:
		session_text(session->id, c->reply.session);
		answer_session(c, session);
		report(s, "%s %u has logged in", role_to_str(session->role), session->number);
		return;
	case -EACCES:
		answer(c, FORBIDDEN,
		       "no such token: it is good once, and for some minutes; a new one: ecdaq "
		       "web-token\n");
		report(s, "a log-in with a wrong token");
		return;
	case -EAGAIN:
		answer(c, TOO_MANY, "too many wrong tokens: try again in a minute\n");
		return;
	case -ENOSPC:
		answer(c, BUSY, "too many are logged in: one has to log out first\n");
		return;
	default:
		answer(c, FAILED, "no random bytes\n");
		return;
	}
}

static void make_token(struct command_server *s, struct client *c, const struct command_body *body)
{
	enum role role = body->count == 2 ? role_of(body->line[0]) : ROLE_NONE;
	long minutes = body->count == 2 ? strtol(body->line[1], NULL, 10) : 0;
	int64_t now_ns = now_of(s);
	int r;

	if (role == ROLE_NONE || minutes < 1 || minutes > WEB_TOKEN_MINUTES_MAX) {
		answer(c, BAD, "expected a role and minutes\n");
		return;
	}
	r = sessions_make_token(&s->sessions, role, now_ns, now_ns + minutes * 60 * NS_PER_S,
				c->reply.text);
	if (r < 0) {
		answer(c, BUSY, r == -ENOSPC ? "too many tokens are open\n" : "no random bytes\n");
		return;
	}
	c->reply.status = OK;
	report(s, "a token for one %s, good for %ld min", role_to_str(role), minutes);
}

/* Is it the turn of a command to a mailbox? One at a time, so that others find a place. */
static int may_ask_mailbox(const struct command_server *s)
{
	for (int i = 0; i < CLIENTS; i++) {
		if (s->client[i].pipe >= 0 && s->client[i].is_paced) {
			return 0;
		}
	}
	return now_of(s) >= s->mailbox_ns;
}

/* The arguments of the tool, started with @words. 1: it is being done. */
static int start_tool(struct command_server *s, struct client *c, const char *const *words,
		      const struct command *command)
{
	/* posix_spawn() only reads them */
	int r = exports_start(&s->exports, (char *const *)(uintptr_t)words, EXPORTS_ERRORS_TO_PIPE,
			      &c->pipe);

	if (r < 0) {
		answer(c, BUSY,
		       r == -EBUSY ? "other commands are being done: try again\n"
				   : "ecdaq cannot be started\n");
		return 0;
	}
	c->export = r;
	c->is_paced = command->exchanges > 0;
	c->is_watching = command->is_watching;
	c->end_ns = now_of(s) + COMMAND_NS;
	if (c->is_paced) {
		s->mailbox_ns = now_of(s) + command->exchanges * EXCHANGE_NS;
	}
	return 1;
}

/* 1: it is being done. */
static int begin_command(struct command_server *s, struct client *c, struct session *session,
			 const struct command_body *body)
{
	const char *words[COMMAND_WORDS + 4] = { "ecdaq", "--run-dir", s->run_dir };
	struct command command;
	size_t used = 0;
	int r = command_parse(body->line + 1, body->count - 1, &command);

	if (r < 0) {
		answer(c, BAD,
		       r == -ENOENT ? "no such command\n"
				    : "the command has not these words, or not of this form\n");
		return 0;
	}
	if (session->role < command.role) {
		answer(c, FORBIDDEN, "the role of this log-in may not do that\n");
		return 0;
	}
	if (!command.is_watching) {
		session_use(session, now_of(s));
	}
	if (command.exchanges > 0 && !may_ask_mailbox(s)) {
		answer(c, TOO_MANY, "mailboxes are asked one at a time, five times a second\n");
		return 0;
	}
	memcpy(words + 3, command.word, sizeof(command.word[0]) * (size_t)(command.count + 1));
	used = (size_t)snprintf(c->who, sizeof(c->who), "%s %u:", role_to_str(session->role),
				session->number);
	for (int i = 1; i < body->count && used < sizeof(c->who); i++) {
		used += (size_t)snprintf(c->who + used, sizeof(c->who) - used, " %s",
					 body->line[i]);
	}
	return start_tool(s, c, words, &command);
}

/* A request of a session that there is. 1: it is being done. */
static int do_for(struct command_server *s, struct client *c, struct session *session,
		  enum web_verb verb, const struct command_body *body)
{
	if (verb == WEB_SESSION) {
		session_use(session, now_of(s));
		answer_session(c, session);
		return 0;
	}
	if (!session_has_secret(session, body->line[0])) {
		answer(c, FORBIDDEN,
		       "the secret of this log-in is another one: load the page again\n");
		report(s, "%s %u: a request without the secret", role_to_str(session->role),
		       session->number);
		return 0;
	}
	if (verb == WEB_LOGOUT) {
		report(s, "%s %u has logged out", role_to_str(session->role), session->number);
		session_end(session);
		answer(c, OK, "{}\n");
		return 0;
	}
	return begin_command(s, c, session, body);
}

/* 1: it is being done; 0: there is an answer. */
static int handle(struct command_server *s, struct client *c, const struct web_request *request)
{
	struct command_body body;
	struct session *session;
	int is_busy = 0;

	if (command_body_parse(request->body, &body) < 0) {
		answer(c, BAD, "expected lines of printable ASCII\n");
	} else if (c->is_token != (request->verb == WEB_TOKEN) || request->verb < WEB_LOGIN ||
		   request->verb > WEB_TOKEN) {
		answer(c, FORBIDDEN, "this socket does not do that\n");
	} else if (request->verb == WEB_TOKEN) {
		make_token(s, c, &body);
	} else if (request->verb == WEB_LOGIN) {
		log_in(s, c, &body);
	} else {
		session = sessions_find(&s->sessions, request->session, now_of(s));
		if (session == NULL) {
			answer(c, NOT_LOGGED_IN, "not logged in, or no longer\n");
		} else {
			is_busy = do_for(s, c, session, (enum web_verb)request->verb, &body);
		}
	}
	explicit_bzero(&body, sizeof(body));
	return is_busy;
}

static void end_client(struct command_server *s, struct client *c)
{
	if (c->pipe >= 0) {
		close(c->pipe);
	}
	if (c->export >= 0) {
		exports_stop(&s->exports, c->export);
	}
	close(c->fd); /* and out of the epoll set */
	explicit_bzero(c, sizeof(*c));
	c->fd = -1;
	c->pipe = -1;
	c->export = -1;
}

static void send_answer(struct command_server *s, struct client *c)
{
	c->reply.magic = WEB_COMMAND_MAGIC;
	(void)!send(c->fd, &c->reply, sizeof(c->reply), MSG_NOSIGNAL | MSG_DONTWAIT);
	end_client(s, c);
}

/* The one request of a client, once it is there. */
static void take_request(struct command_server *s, struct client *c)
{
	struct web_request request;
	ssize_t n = recv(c->fd, &request, sizeof(request), MSG_DONTWAIT | MSG_TRUNC);

	if (n < 0 && (errno == EAGAIN || errno == EINTR)) {
		if (now_of(s) >= c->end_ns) {
			end_client(s, c);
		}
		return;
	}
	if (n != (ssize_t)sizeof(request) || request.magic != WEB_COMMAND_MAGIC ||
	    request.session[sizeof(request.session) - 1] != '\0') {
		end_client(s, c);
		return;
	}
	if (!handle(s, c, &request)) {
		send_answer(s, c);
	}
	explicit_bzero(&request, sizeof(request));
}

static void finish_command(struct command_server *s, struct client *c)
{
	int r = exports_finish(&s->exports, c->export, 0);

	if (r == 0) {
		return;
	}
	c->export = -1;
	c->reply.status = r > 0 ? OK : REFUSED;
	if (r > 0 && c->is_cut) {
		answer(c, FAILED, "done, but what it says is longer than an answer may be\n");
	}
	if (r > 0 && !c->is_watching) {
		report(s, "%s: done", c->who);
	} else if (r <= 0 && !c->is_watching) {
		report(s, "%s: %.*s", c->who, (int)strcspn(c->reply.text, "\n"), c->reply.text);
	}
	send_answer(s, c);
}

/* What the tool prints, up to the end. */
static void read_command(struct command_server *s, struct client *c)
{
	char buf[WEB_TEXT_BYTES];
	ssize_t n;

	if (now_of(s) >= c->end_ns) {
		report(s, "%s: not done within a minute", c->who);
		answer(c, TOO_LATE, "not done within a minute: see the state of the bus\n");
		send_answer(s, c);
		return;
	}
	n = read(c->pipe, buf, sizeof(buf));
	if (n > 0) {
		size_t room = sizeof(c->reply.text) - 1 - c->filled;
		size_t bytes = (size_t)n < room ? (size_t)n : room;

		memcpy(c->reply.text + c->filled, buf, bytes);
		c->filled += bytes;
		c->is_cut = c->is_cut || bytes < (size_t)n;
	} else if (n == 0 || (errno != EAGAIN && errno != EINTR)) {
		finish_command(s, c);
	}
}

static struct client *find_free(struct command_server *s, int is_token)
{
	for (int i = is_token ? CLIENTS : 0; i < (is_token ? CLIENTS + SPARE : CLIENTS); i++) {
		if (s->client[i].fd < 0) {
			return &s->client[i];
		}
	}
	return NULL;
}

static void accept_from(struct command_server *s, const struct listener *listener, int is_token)
{
	struct client *c = find_free(s, is_token);
	struct epoll_event interest = { .events = EPOLLIN };
	int fd;

	if (c == NULL) {
		return; /* it waits in the backlog */
	}
	fd = accept4(listener->fd, NULL, NULL, SOCK_NONBLOCK | SOCK_CLOEXEC);
	if (fd < 0) {
		return;
	}
	if (epoll_ctl(s->poller, EPOLL_CTL_ADD, fd, &interest) < 0) {
		close(fd);
		return;
	}
	c->fd = fd;
	c->is_token = is_token;
	c->end_ns = now_of(s) + REQUEST_NS;
}

int command_server_step(struct command_server *s)
{
	struct epoll_event event;
	int is_busy = 0;

	exports_reap(&s->exports);
	for (int i = 0; i < CLIENTS + SPARE; i++) {
		is_busy = is_busy || s->client[i].fd >= 0;
	}
	if (epoll_wait(s->poller, &event, 1, is_busy ? BUSY_MS : IDLE_MS) < 0 && errno != EINTR) {
		return -errno;
	}
	accept_from(s, &s->page, 0);
	accept_from(s, &s->token, 1);
	for (int i = 0; i < CLIENTS + SPARE; i++) {
		struct client *c = &s->client[i];

		if (c->fd >= 0 && c->pipe >= 0) {
			read_command(s, c);
		} else if (c->fd >= 0) {
			take_request(s, c);
		}
	}
	return 0;
}

static int open_listener(struct command_server *s, const char *file, gid_t group,
			 struct listener *listener, char *error, size_t error_bytes)
{
	char path[CONFIG_PATH_BYTES];
	int r = config_run_path(s->cfg, file, path, sizeof(path));

	r = r < 0 ? r : run_path_own_folder(path);
	r = r < 0 ? r : listener_open(listener, path, group, s->poller);
	if (r < 0) {
		snprintf(error, error_bytes, "%s: %s%s", path, strerror(-r),
			 r == -ENOENT ? ": ecdaqd makes the run directory: start it first" : "");
	}
	return r;
}

static int begin(struct command_server *s, char *error, size_t error_bytes)
{
	gid_t group;
	int r = group_find(s->cfg->admin_group, "ecdaq-admin", &group);

	if (r < 0) {
		snprintf(error, error_bytes, "runtime.admin_group: %s: no such group",
			 s->cfg->admin_group);
		return r;
	}
	r = config_run_path(s->cfg, "", s->run_dir, sizeof(s->run_dir));
	s->poller = r < 0 ? -1 : epoll_create1(EPOLL_CLOEXEC);
	if (s->poller < 0) {
		snprintf(error, error_bytes, "the run directory: %s", strerror(r < 0 ? -r : errno));
		return r < 0 ? r : -errno;
	}
	r = open_listener(s, CONFIG_RUN_WEB_PAGE, (gid_t)-1, &s->page, error, error_bytes);
	return r < 0 ? r
		     : open_listener(s, CONFIG_RUN_WEB_TOKEN, group, &s->token, error, error_bytes);
}

int command_server_create(const struct config *cfg, void (*report_line)(const char *line),
			  struct command_server **ret_server, char *error, size_t error_bytes)
{
	struct command_server *s = calloc(1, sizeof(*s));
	int r;

	if (s == NULL) {
		snprintf(error, error_bytes, "out of memory");
		return -ENOMEM;
	}
	s->cfg = cfg;
	s->report = report_line;
	s->platform = platform_posix();
	s->poller = -1;
	s->page.fd = -1;
	s->token.fd = -1;
	for (int i = 0; i < CLIENTS + SPARE; i++) {
		s->client[i] = (struct client){ .fd = -1, .pipe = -1, .export = -1 };
	}
	sessions_init(&s->sessions, NULL);
	r = begin(s, error, error_bytes);
	if (r < 0) {
		command_server_destroy(s);
		return r;
	}
	*ret_server = s;
	return 0;
}

void command_server_destroy(struct command_server *s)
{
	if (s == NULL) {
		return;
	}
	for (int i = 0; i < CLIENTS + SPARE; i++) {
		if (s->client[i].fd >= 0) {
			end_client(s, &s->client[i]);
		}
	}
	exports_done(&s->exports);
	listener_close(&s->page);
	listener_close(&s->token);
	if (s->poller >= 0) {
		close(s->poller);
	}
	sessions_wipe(&s->sessions);
	free(s);
}
