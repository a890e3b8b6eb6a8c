/* SPDX-License-Identifier: MIT */
/* What the page posts: log-in and commands, passed on to ecdaq-web-command, which alone has the
 * right to command. Only the page of this very server may post. */
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include "base/clock.h"
#include "base/web_command.h"
#include "config/gateway.h"
#include "web/server_private.h"

enum { COMMANDS = 8, POLL_US = 5000, LENGTH_BYTES = 16, COOKIE_BYTES = 200 };

/* What is posted, and passed on; its end has the answer. */
struct command_post {
	lws_sorted_usec_list_t timer; /* first: it is all that its callback has */
	struct lws *wsi;
	struct server *server;
	int fd; /* -1: not sent yet */
	int64_t end_ns;
	size_t wanted; /* bytes of the body */
	size_t filled;
	struct web_request request;
	struct web_reply reply;
	char cookie[COOKIE_BYTES];
};

static const struct {
	const char *path;
	enum web_verb verb;
} posts[] = {
	{ "/login", WEB_LOGIN },
	{ "/logout", WEB_LOGOUT },
	{ "/session", WEB_SESSION },
	{ "/command", WEB_COMMAND },
};

static enum web_verb verb_of(const char *path)
{
	for (size_t i = 0; i < sizeof(posts) / sizeof(posts[0]); i++) {
		if (strcmp(path, posts[i].path) == 0) {
			return posts[i].verb;
		}
	}
	return WEB_NONE;
}

/* Cookies of a host are those of all its ports. */
static void name_cookie(const struct server *s, char ret[COOKIE_BYTES])
{
	snprintf(ret, COOKIE_BYTES, "ecdaq-%u", s->cfg->web_port);
}

static void get_header(struct lws *wsi, enum lws_token_indexes token, char *ret, int bytes)
{
	if (lws_hdr_copy(wsi, ret, bytes, token) < 0) {
		ret[0] = '\0';
	}
}

/* The page of this server, by the address that it was asked for; web.origins may only read. */
static int is_own_page(struct lws *wsi)
{
	char host[SERVER_HOST_BYTES];
	char origin[SERVER_HOST_BYTES];
	const char *scheme = server_has_tls(server_of(wsi)->cfg) ? "https://" : "http://";

	get_header(wsi, WSI_TOKEN_HOST, host, sizeof(host));
	get_header(wsi, WSI_TOKEN_ORIGIN, origin, sizeof(origin));
	return strncmp(origin, scheme, strlen(scheme)) == 0 &&
	       strcasecmp(origin + strlen(scheme), host) == 0;
}

/* 0, or the HTTP status with the reason. */
static int check(struct server *s, struct lws *wsi, size_t *ret_bytes, const char **ret_why)
{
	char text[LENGTH_BYTES];
	char *end;
	unsigned long bytes;

	if (!server_has_tls(s->cfg) && !config_web_is_loopback(s->cfg)) {
		*ret_why =
			"commands are for web.listen: loopback only, without web.certificate: use "
			"an SSH tunnel\n";
		return HTTP_STATUS_FORBIDDEN;
	}
	if (!is_own_page(wsi)) {
		*ret_why = "only the page of this server may post (Origin)\n";
		return HTTP_STATUS_FORBIDDEN;
	}
	get_header(wsi, WSI_TOKEN_HTTP_CONTENT_LENGTH, text, sizeof(text));
	bytes = strtoul(text, &end, 10);
	if (text[0] < '0' || text[0] > '9' || *end != '\0' || bytes == 0) {
		*ret_why = "a body with its length is required\n";
		return HTTP_STATUS_LENGTH_REQUIRED;
	}
	if (bytes >= WEB_BODY_BYTES) {
		*ret_why = "the body is too long\n";
		return HTTP_STATUS_REQ_ENTITY_TOO_LARGE;
	}
	if (s->commands >= COMMANDS) {
		*ret_why = "too many requests at a time: try again\n";
		return HTTP_STATUS_SERVICE_UNAVAILABLE;
	}
	*ret_bytes = bytes;
	return 0;
}

int server_command_begin(struct lws *wsi, const char *path, struct command_post **ret_post,
			 const char **ret_why)
{
	struct server *s = server_of(wsi);
	enum web_verb verb = verb_of(path);
	struct command_post *post;
	char name[COOKIE_BYTES];
	size_t bytes;
	size_t id_bytes = WEB_SECRET_TEXT_BYTES;
	int r;

	if (verb == WEB_NONE) {
		return -ENOENT;
	}
	r = check(s, wsi, &bytes, ret_why);
	if (r != 0) {
		return r;
	}
	post = calloc(1, sizeof(*post));
	if (post == NULL) {
		*ret_why = "out of memory\n";
		return HTTP_STATUS_INTERNAL_SERVER_ERROR;
	}
	s->commands++;
	*post = (struct command_post){ .wsi = wsi, .server = s, .fd = -1, .wanted = bytes };
	post->request.magic = WEB_COMMAND_MAGIC;
	post->request.verb = verb;
	name_cookie(s, name);
	if (lws_http_cookie_get(wsi, name, post->request.session, &id_bytes) != 0) {
		post->request.session[0] = '\0';
	}
	post->request.session[WEB_SECRET_TEXT_BYTES - 1] = '\0';
	*ret_post = post;
	return 0;
}

void server_command_end(struct command_post *post)
{
	if (post == NULL) {
		return;
	}
	lws_sul_cancel(&post->timer);
	if (post->fd >= 0) {
		close(post->fd);
	}
	post->server->commands--;
	explicit_bzero(post, sizeof(*post));
	free(post);
}

int server_command_body(struct command_post *post, const void *data, size_t len)
{
	if (len > post->wanted - post->filled || memchr(data, '\0', len) != NULL) {
		return -1;
	}
	memcpy(post->request.body + post->filled, data, len);
	post->filled += len;
	return 0;
}

static int connect_to(const struct server *s)
{
	struct sockaddr_un address = { .sun_family = AF_UNIX };
	int fd;
	int r = config_run_path(s->cfg, CONFIG_RUN_WEB_PAGE, address.sun_path,
				sizeof(address.sun_path));

	if (r < 0) {
		return r;
	}
	fd = socket(AF_UNIX, SOCK_SEQPACKET | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
	if (fd >= 0 && connect(fd, (const struct sockaddr *)&address, sizeof(address)) < 0) {
		r = -errno;
		close(fd);
		return r;
	}
	return fd < 0 ? -errno : fd;
}

static void answer(struct command_post *post, unsigned status, const char *text)
{
	post->reply.status = status;
	snprintf(post->reply.text, sizeof(post->reply.text), "%s", text);
}

static void ask_again(lws_sorted_usec_list_t *timer)
{
	lws_callback_on_writable(((struct command_post *)timer)->wsi);
}

void server_command_send(struct command_post *post)
{
	const struct server *s = post->server;
	int fd = connect_to(s);

	post->end_ns = s->platform.now(s->platform.ctx).ns + WEB_ANSWER_S * NS_PER_S;
	if (fd == -EAGAIN) {
		answer(post, HTTP_STATUS_SERVICE_UNAVAILABLE,
		       "too many requests at a time: try again\n");
	} else if (fd == -EACCES) {
		answer(post, HTTP_STATUS_SERVICE_UNAVAILABLE,
		       "ecdaq-web may not use the socket of ecdaq-web-command: see its user's "
		       "groups\n");
	} else if (fd < 0) {
		answer(post, HTTP_STATUS_SERVICE_UNAVAILABLE,
		       "no log-in and no commands: ecdaq-web-command is not running\n");
	} else if (send(fd, &post->request, sizeof(post->request), MSG_NOSIGNAL) < 0) {
		answer(post, HTTP_STATUS_SERVICE_UNAVAILABLE, "ecdaq-web-command takes nothing\n");
	}
	explicit_bzero(&post->request.body, sizeof(post->request.body));
	post->fd = fd < 0 ? -1 : fd;
	lws_set_timeout(post->wsi, PENDING_TIMEOUT_HTTP_CONTENT, WEB_ANSWER_S + 5);
	lws_callback_on_writable(post->wsi);
}

static void make_cookie(struct command_post *post)
{
	const char *secure = server_has_tls(post->server->cfg) ? "; Secure" : "";
	char name[COOKIE_BYTES];

	name_cookie(post->server, name);
	if (post->reply.status != HTTP_STATUS_OK) {
		return;
	}
	if (post->request.verb == WEB_LOGIN) {
		snprintf(post->cookie, sizeof(post->cookie),
			 "%.16s=%s; Path=/; HttpOnly; SameSite=Strict%s", name, post->reply.session,
			 secure);
	} else if (post->request.verb == WEB_LOGOUT) {
		snprintf(post->cookie, sizeof(post->cookie),
			 "%.16s=; Path=/; HttpOnly; SameSite=Strict; Max-Age=0%s", name, secure);
	}
}

int server_command_turn(struct command_post *post, struct command_answer *ret)
{
	ssize_t n = post->fd < 0 ? 0 : recv(post->fd, &post->reply, sizeof(post->reply), 0);

	if (n < 0 && (errno == EAGAIN || errno == EINTR) &&
	    post->server->platform.now(post->server->platform.ctx).ns < post->end_ns) {
		lws_sul_schedule(lws_get_context(post->wsi), 0, &post->timer, ask_again, POLL_US);
		return 0;
	}
	if (post->fd >= 0 &&
	    (n != (ssize_t)sizeof(post->reply) || post->reply.magic != WEB_COMMAND_MAGIC)) {
		answer(post, HTTP_STATUS_BAD_GATEWAY, "no answer of ecdaq-web-command\n");
	}
	post->reply.text[sizeof(post->reply.text) - 1] = '\0';
	post->reply.session[sizeof(post->reply.session) - 1] = '\0';
	make_cookie(post);
	*ret = (struct command_answer){ post->reply.status, post->reply.text, post->cookie };
	return 1;
}
