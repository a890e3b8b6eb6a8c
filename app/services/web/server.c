/* SPDX-License-Identifier: MIT */
#include "web/server.h"

#include <errno.h>
#include <netinet/in.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/clock.h"
#include "base/foreign.h"
#include "config/gateway.h"
#include "web/foxglove.h"
#include "web/origin.h"
#include "web/server_private.h"

enum {
	OUTBOX_BYTES = 8 * 1024 * 1024,
	STEP_US = 5000,      /* while somebody has subscribed */
	IDLE_US = 100000,    /* while nobody has */
	REQUEST_SECONDS = 5, /* for the request line and its headers */
	KEEPALIVE_SECONDS = 5,
	PING_SECONDS = 10,   /* a WebSocket that said nothing for so long is asked */
	HANGUP_SECONDS = 25, /* and ended */
	HEADER_BYTES = 4096, /* all headers of a request */
	SPARE_SOCKETS = 64,  /* beside the WebSockets: requests, and what the library needs */
	HEADER_POOL = 32,    /* requests whose headers are kept at a time */
	RECEIVE_BYTES = 4096,
};
#define REPORT_NS NS_PER_S

static const lws_retry_bo_t idle_policy = {
	.secs_since_valid_ping = PING_SECONDS,
	.secs_since_valid_hangup = HANGUP_SECONDS,
};

static void (*report_log)(const char *line);

static void take_log(int level, const char *line)
{
	char text[SERVER_WHY_BYTES];

	(void)level;
	snprintf(text, sizeof(text), "%s", line);
	text[strcspn(text, "\n")] = '\0';
	if (report_log != NULL) {
		report_log(text);
	}
}

struct server *server_of(struct lws *wsi)
{
	return lws_context_user(lws_get_context(wsi));
}

static void get_header(struct lws *wsi, enum lws_token_indexes token, char *ret, int bytes)
{
	if (lws_hdr_copy(wsi, ret, bytes, token) < 0) {
		ret[0] = '\0'; /* there is none, or it is too long for a name */
	}
}

/* At most one line a second, whoever asks how often. */
static void report_rejected(struct server *s, const char *why)
{
	if (s->now_ns - s->reported_ns >= REPORT_NS || s->reported_ns == 0) {
		s->reported_ns = s->now_ns;
		s->report(why);
	}
}

int server_has_tls(const struct config *cfg)
{
	return cfg->web_certificate[0] != '\0';
}

int server_check_request(struct server *s, struct lws *wsi, const char **ret_why)
{
	char why[SERVER_WHY_BYTES];
	char host[SERVER_HOST_BYTES];

	if (server_has_tls(s->cfg) && !lws_is_ssl(wsi)) {
		*ret_why = "this port has TLS only: https://, wss://\n";
		return HTTP_STATUS_FORBIDDEN;
	}

	get_header(wsi, WSI_TOKEN_HOST, host, sizeof(host));
	if (!origin_host_is_ours(host, s->own_name, s->cfg->web_hosts)) {
		snprintf(why, SERVER_WHY_BYTES,
			 "rejected a request for host \"%s\": add the name to web.hosts if this "
			 "machine has it",
			 host);
		report_rejected(s, why);
		*ret_why = "this server does not have that host name (option web.hosts)\n";
		return HTTP_STATUS_FORBIDDEN;
	}
	return 0;
}

static int check_websocket(struct server *s, struct lws *wsi)
{
	char why[SERVER_WHY_BYTES];
	char host[SERVER_HOST_BYTES];
	char origin[SERVER_HOST_BYTES];
	const char *answer;
	int r = server_check_request(s, wsi, &answer);

	if (r != 0) {
		return r;
	}
	get_header(wsi, WSI_TOKEN_HOST, host, sizeof(host));
	get_header(wsi, WSI_TOKEN_ORIGIN, origin, sizeof(origin));
	if (lws_hdr_total_length(wsi, WSI_TOKEN_ORIGIN) > 0 &&
	    (origin[0] == '\0' || !origin_is_allowed(origin, host, s->cfg->web_origins))) {
		snprintf(why, sizeof(why),
			 "rejected a WebSocket of a page from \"%s\": add this origin to "
			 "web.origins if it may read the measurements",
			 origin);
		report_rejected(s, why);
		return HTTP_STATUS_FORBIDDEN;
	}
	if (s->clients >= s->cfg->web_clients) {
		snprintf(why, sizeof(why), "rejected a client: there are %u already (web.clients)",
			 s->clients);
		report_rejected(s, why);
		return HTTP_STATUS_SERVICE_UNAVAILABLE;
	}
	return 0;
}

int server_filter(struct lws *wsi)
{
	int status = check_websocket(server_of(wsi), wsi);

	if (status != 0) {
		(void)lws_return_http_status(wsi, (unsigned)status, NULL);
	}
	return status == 0 ? 0 : -1;
}

int server_send_text(struct lws *wsi, const char *text)
{
	size_t len = text == NULL ? 0 : strlen(text);
	uint8_t *buf = text == NULL ? NULL : malloc(LWS_PRE + len + 1);
	int r;

	if (buf == NULL) {
		return -1;
	}
	memcpy(buf + LWS_PRE, text, len + 1);
	r = lws_write(wsi, buf + LWS_PRE, len, LWS_WRITE_TEXT) < (int)len ? -1 : 1;
	free(buf);
	return r;
}

void server_client_opened(struct server *s, struct server_client *client, struct lws *wsi)
{
	client->wsi = wsi;
	client->next = s->first_client;
	s->first_client = client;
	s->clients++;
}

void server_client_closed(struct server *s, struct server_client *client)
{
	struct server_client **at = &s->first_client;

	while (*at != NULL && *at != client) {
		at = &(*at)->next;
	}
	if (*at != NULL) {
		*at = client->next;
		s->clients--;
	}
}

static void step(lws_sorted_usec_list_t *timer)
{
	struct server *s = (void *)((char *)timer - offsetof(struct server, timer));
	uint64_t head = outbox_head(s->box);
	uint32_t session = source_session(s->source);
	int is_new;

	s->now_ns = s->platform.now(s->platform.ctx).ns;
	source_poll(s->source, s->now_ns);
	exports_reap(&s->exports);
	exports_reap(&s->reports);
	is_new = s->first_client != NULL && server_pages_refresh(s);
	is_new = is_new || head != outbox_head(s->box) || session != source_session(s->source);
	for (struct server_client *c = s->first_client; c != NULL; c = c->next) {
		if (is_new || c->is_waiting) {
			lws_callback_on_writable(c->wsi);
		}
	}
	lws_sul_schedule(s->context, 0, timer, step, s->first_client != NULL ? STEP_US : IDLE_US);
}

/* libwebsockets itself reports no reason why it cannot listen: find it. */
static int try_listen(const struct config *cfg, char *error, size_t error_bytes)
{
	struct sockaddr_in6 address;
	socklen_t bytes;
	int one = 1;
	int fd;
	int r = config_web_address(cfg, &address, &bytes);

	if (r < 0) {
		snprintf(error, error_bytes, "web.listen: \"%s\" is no address", cfg->web_listen);
		return r;
	}
	fd = socket(address.sin6_family, SOCK_STREAM | SOCK_CLOEXEC, 0);
	r = fd < 0 ? -errno : 0;
	if (r == 0 &&
	    (setsockopt(fd, SOL_SOCKET, SO_REUSEADDR, &one, sizeof(one)) < 0 ||
	     bind(fd, (const struct sockaddr *)&address, bytes) < 0 || listen(fd, 1) < 0)) {
		r = -errno;
	}
	if (fd >= 0) {
		close(fd);
	}
	if (r < 0) {
		snprintf(error, error_bytes,
			 "cannot listen on %s port %u (web.listen, web.port): %s", cfg->web_listen,
			 cfg->web_port, strerror(-r));
	}
	return r;
}

/* libwebsockets says little of what it does not take. */
static int check_file(const char *option, const char *path, char *error, size_t error_bytes)
{
	struct stat st;
	int fd = foreign_open(path, &st);

	if (fd < 0) {
		snprintf(error, error_bytes, "%s: %s: %s", option, path,
			 fd == -EPROTO ? "is no regular file" : strerror(-fd));
		return fd == -EACCES ? fd : -EINVAL;
	}
	close(fd);
	return 0;
}

static int check_tls(const struct config *cfg, char *error, size_t error_bytes)
{
	int r = 0;

	if (server_has_tls(cfg)) {
		r = check_file("web.certificate", cfg->web_certificate, error, error_bytes);
		r = r < 0 ? r : check_file("web.key", cfg->web_key, error, error_bytes);
	}
	return r;
}

/* HTTP without TLS on its port gets an answer in words, and nothing else. */
#define TLS_OPTIONS                                                                                \
	(LWS_SERVER_OPTION_DO_SSL_GLOBAL_INIT | LWS_SERVER_OPTION_ALLOW_NON_SSL_ON_SSL_PORT |      \
	 LWS_SERVER_OPTION_ALLOW_HTTP_ON_HTTPS_LISTENER)

static struct lws_context *create_context(struct server *s)
{
	int has_tls = server_has_tls(s->cfg);
	const struct lws_context_creation_info info = {
		.iface = strcmp(s->cfg->web_listen, "loopback") == 0 ? "127.0.0.1"
								     : s->cfg->web_listen,
		.port = (int)s->cfg->web_port,
		.protocols = s->protocols,
		.options = LWS_SERVER_OPTION_FAIL_UPON_UNABLE_TO_BIND |
			   LWS_SERVER_OPTION_VALIDATE_UTF8 | LWS_SERVER_OPTION_DISABLE_OS_CA_CERTS |
			   (has_tls ? TLS_OPTIONS : 0),
		.ssl_cert_filepath = has_tls ? s->cfg->web_certificate : NULL,
		.ssl_private_key_filepath = has_tls ? s->cfg->web_key : NULL,
		.user = s,
		.server_string = "ecdaq",
		.timeout_secs = REQUEST_SECONDS,
		.keepalive_timeout = KEEPALIVE_SECONDS,
		.retry_and_idle_policy = &idle_policy,
		.max_http_header_data = HEADER_BYTES,
		.max_http_header_pool = HEADER_POOL,
		.fd_limit_per_thread = s->cfg->web_clients + SPARE_SOCKETS,
	};

	return lws_create_context(&info);
}

static int create_texts(struct server *s)
{
	s->info = foxglove_server_info();
	s->fixed = foxglove_advertise_fixed();
	s->scratch = malloc(LWS_PRE + FOXGLOVE_MESSAGE_HEAD_BYTES + SOURCE_LARGEST_BYTES);
	return s->info == NULL || s->fixed == NULL || s->scratch == NULL ? -ENOMEM : 0;
}

static void set_protocols(struct server *s)
{
	s->protocols[0] = (struct lws_protocols){ .name = "http",
						  .callback = server_http,
						  .per_session_data_size = server_http_bytes() };
	s->protocols[1] = (struct lws_protocols){ .name = "foxglove.sdk.v1",
						  .callback = server_foxglove,
						  .per_session_data_size = server_foxglove_bytes(),
						  .rx_buffer_size = RECEIVE_BYTES };
	s->protocols[2] = s->protocols[1];
	s->protocols[2].name = "foxglove.websocket.v1";
	s->protocols[3] = (struct lws_protocols){ .name = "ecdaq.page.v1",
						  .callback = server_page,
						  .per_session_data_size = server_page_bytes(),
						  .rx_buffer_size = RECEIVE_BYTES };
}

int server_create(const struct config *cfg, void (*report)(const char *line),
		  struct server **ret_server, char *error, size_t error_bytes)
{
	struct server *s = calloc(1, sizeof(*s));
	int r = s == NULL ? -ENOMEM : 0;

	if (r == 0) {
		s->cfg = cfg;
		s->report = report;
		s->platform = platform_posix();
		s->now_ns = s->platform.now(s->platform.ctx).ns;
		report_log = report;
		lws_set_log_level(LLL_ERR, take_log);
		set_protocols(s);
		(void)gethostname(s->own_name, sizeof(s->own_name) - 1);
		r = outbox_create(OUTBOX_BYTES, SOURCE_LARGEST_BYTES, &s->box);
	}
	r = r < 0 ? r : source_create(cfg, s->box, &s->source);
	r = r < 0 ? r : create_texts(s);
	r = r < 0 ? r : server_pages_create(s);
	snprintf(error, error_bytes, "%s", strerror(-r));
	r = r < 0 ? r : check_tls(cfg, error, error_bytes);
	r = r < 0 ? r : try_listen(cfg, error, error_bytes);
	if (r == 0) {
		s->context = create_context(s);
		if (s->context == NULL) {
			r = server_has_tls(cfg) ? -EINVAL : -ENOMEM;
			snprintf(error, error_bytes, "%s",
				 r == -ENOMEM ? "libwebsockets cannot start"
					      : "web.certificate, web.key: no certificate and its "
						"key in PEM: see above");
		}
	}
	if (r < 0) {
		server_destroy(s);
		return r;
	}
	lws_sul_schedule(s->context, 0, &s->timer, step, 1);
	*ret_server = s;
	return 0;
}

void server_destroy(struct server *s)
{
	if (s == NULL) {
		return;
	}
	if (s->context != NULL) {
		lws_context_destroy(s->context);
	}
	exports_done(&s->exports);
	exports_done(&s->reports);
	server_pages_destroy(s);
	source_destroy(s->source);
	outbox_destroy(s->box);
	free(s->info);
	free(s->fixed);
	free(s->slaves);
	free(s->scratch);
	free(s);
}

int server_step(struct server *s)
{
	return lws_service(s->context, 0) < 0 ? -EIO : 0;
}
