/* SPDX-License-Identifier: MIT */
/* The page's files, which are in the program, recordings, and what ecdaq says; nothing else is
 * served, and nothing but log-in and commands is taken. */
#include <errno.h>
#include <stdio.h>
#include <string.h>

#include "web/assets.h"
#include "web/server_private.h"

enum { CHUNK_BYTES = 16 * 1024, HEAD_BYTES = 2048 };

/* A reply that is being sent. */
struct reply {
	const uint8_t *body;
	size_t bytes;
	size_t sent;
	int is_last_one;           /* what follows on this connection is not read */
	struct download *download; /* in place of a body */
	struct command_post *post; /* the same */
	const char *cookie;        /* NULL, "": none */
};

static const char recordings_path[] = "/recordings/";

/* No script, style or connection but our own; no other page may embed this one. */
static const struct {
	const char *name;
	const char *value;
} headers[] = {
	{ "content-security-policy:",
	  "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:; "
	  "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'" },
	{ "x-content-type-options:", "nosniff" },
	{ "referrer-policy:", "no-referrer" },
	{ "cross-origin-resource-policy:", "same-origin" },
	{ "cache-control:", "no-cache" },
};

size_t server_http_bytes(void)
{
	return sizeof(struct reply);
}

int server_put_headers(struct lws *wsi, uint8_t **p, uint8_t *end)
{
	for (size_t i = 0; i < sizeof(headers) / sizeof(headers[0]); i++) {
		if (lws_add_http_header_by_name(wsi, (const uint8_t *)headers[i].name,
						(const uint8_t *)headers[i].value,
						(int)strlen(headers[i].value), p, end) != 0) {
			return -1;
		}
	}
	return 0;
}

static int put_cookie(struct lws *wsi, const struct reply *reply, uint8_t **p, uint8_t *end)
{
	return reply->cookie == NULL || reply->cookie[0] == '\0'
		       ? 0
		       : lws_add_http_header_by_name(wsi, (const uint8_t *)"set-cookie:",
						     (const uint8_t *)reply->cookie,
						     (int)strlen(reply->cookie), p, end);
}

static int begin(struct lws *wsi, struct reply *reply, unsigned status, const char *type)
{
	uint8_t buf[LWS_PRE + HEAD_BYTES];
	uint8_t *start = buf + LWS_PRE;
	uint8_t *p = start;
	uint8_t *end = buf + sizeof(buf) - 1;

	if (lws_add_http_common_headers(wsi, status, type, reply->bytes, &p, end) != 0 ||
	    server_put_headers(wsi, &p, end) != 0 || put_cookie(wsi, reply, &p, end) != 0) {
		return -1;
	}
	if (lws_finalize_write_http_header(wsi, start, &p, end) != 0) {
		return -1;
	}
	reply->sent = 0;
	if (lws_hdr_total_length(wsi, WSI_TOKEN_HEAD_URI) > 0) {
		return lws_http_transaction_completed(wsi) != 0 ? -1 : 0;
	}
	lws_callback_on_writable(wsi);
	return 0;
}

static int put_text(struct lws *wsi, struct reply *reply, unsigned status, const char *text)
{
	reply->body = (const uint8_t *)text; /* a constant, or of the post */
	reply->bytes = strlen(text);
	return begin(wsi, reply, status, "text/plain; charset=utf-8");
}

/* A recording cannot be sent. */
static int put_failure(struct lws *wsi, struct reply *reply, int status)
{
	return put_text(wsi, reply, (unsigned)status,
			status == HTTP_STATUS_NOT_FOUND ? "no such recording\n"
			: status == HTTP_STATUS_SERVICE_UNAVAILABLE
				? "too many downloads or exports at a time: try again later\n"
			: status == HTTP_STATUS_BAD_REQUEST
				? "the query is not session=N&from=CYCLE&to=CYCLE of at most "
				  "4194304 cycles\n"
			: status == HTTP_STATUS_FORBIDDEN
				? "ecdaq-web may not read this recording: see its user's groups\n"
				: "the export failed: see the log of ecdaq-web\n");
}

/* The outcome @r of the beginning of a download. */
static int begun(struct lws *wsi, struct reply *reply, int r)
{
	return r > 0 ? put_failure(wsi, reply, r) : r;
}

static int continue_download(struct lws *wsi, struct reply *reply)
{
	int r = server_download_turn(reply->download);

	if (r != 0) {
		server_download_end(reply->download);
		reply->download = NULL;
	}
	if (r == 1) {
		return lws_http_transaction_completed(wsi) != 0 ? -1 : 0;
	}
	return r > 1 ? put_failure(wsi, reply, r) : r;
}

static int take_post(struct lws *wsi, struct reply *reply, const char *path)
{
	const char *why = "GET and HEAD only\n";
	int r = server_command_begin(wsi, path, &reply->post, &why);

	if (r == 0) {
		return 0; /* its body follows */
	}
	reply->is_last_one = 1;
	return put_text(wsi, reply, r == -ENOENT ? HTTP_STATUS_METHOD_NOT_ALLOWED : (unsigned)r,
			why);
}

static int continue_post(struct lws *wsi, struct reply *reply)
{
	struct command_answer answer;

	if (server_command_turn(reply->post, &answer) == 0) {
		return 0;
	}
	reply->cookie = answer.cookie;
	reply->is_last_one = 1; /* and with it all of the post */
	return put_text(wsi, reply, answer.status, answer.text);
}

static int serve(struct lws *wsi, struct reply *reply, const char *path)
{
	const struct asset *asset = asset_find(path);
	const char *why;

	if (server_check_request(server_of(wsi), wsi, &why) != 0) {
		reply->is_last_one = 1;
		return put_text(wsi, reply, HTTP_STATUS_FORBIDDEN, why);
	}
	if (lws_hdr_total_length(wsi, WSI_TOKEN_GET_URI) <= 0 &&
	    lws_hdr_total_length(wsi, WSI_TOKEN_HEAD_URI) <= 0) {
		return take_post(wsi, reply, path);
	}
	if (strncmp(path, recordings_path, strlen(recordings_path)) == 0) {
		return begun(wsi, reply,
			     server_download_begin(wsi, path + strlen(recordings_path),
						   &reply->download));
	}
	if (asset == NULL) {
		int r = server_report_begin(wsi, path, &reply->download);

		if (r != -ENOENT) {
			return begun(wsi, reply, r);
		}
		return put_text(wsi, reply, HTTP_STATUS_NOT_FOUND, "no such page\n");
	}
	reply->body = asset->data;
	reply->bytes = asset->bytes;
	return begin(wsi, reply, HTTP_STATUS_OK, asset->type);
}

static int put_chunk(struct lws *wsi, struct reply *reply)
{
	uint8_t buf[LWS_PRE + CHUNK_BYTES];
	size_t rest = reply->bytes - reply->sent;
	size_t bytes = rest > CHUNK_BYTES ? CHUNK_BYTES : rest;
	int is_last = bytes == rest;

	if (reply->body == NULL) {
		return -1;
	}
	memcpy(buf + LWS_PRE, reply->body + reply->sent, bytes);
	reply->sent += bytes;
	if (lws_write(wsi, buf + LWS_PRE, bytes, is_last ? LWS_WRITE_HTTP_FINAL : LWS_WRITE_HTTP) <
	    (int)bytes) {
		return -1;
	}
	if (is_last && reply->is_last_one) {
		return -1;
	}
	if (is_last) {
		return lws_http_transaction_completed(wsi) != 0 ? -1 : 0;
	}
	lws_callback_on_writable(wsi);
	return 0;
}

/* What was refused already is not kept: the connection ends with its answer. */
static int take_body(struct reply *reply, enum lws_callback_reasons reason, const void *in,
		     size_t len)
{
	if (reply->post == NULL) {
		return 0;
	}
	if (reason == LWS_CALLBACK_HTTP_BODY) {
		return server_command_body(reply->post, in, len);
	}
	server_command_send(reply->post);
	return 0;
}

int server_http(struct lws *wsi, enum lws_callback_reasons reason, void *user, void *in, size_t len)
{
	/* A long table of reasons; those that are not here are not ours. */
	if (reason == LWS_CALLBACK_HTTP) {
		return serve(wsi, user, in);
	}
	if (reason == LWS_CALLBACK_HTTP_WRITEABLE) {
		struct reply *reply = user;

		return reply->download != NULL                      ? continue_download(wsi, reply)
		       : reply->post != NULL && reply->body == NULL ? continue_post(wsi, reply)
								    : put_chunk(wsi, reply);
	}
	if (reason == LWS_CALLBACK_HTTP_BODY || reason == LWS_CALLBACK_HTTP_BODY_COMPLETION) {
		return take_body(user, reason, in, len);
	}
	if ((reason == LWS_CALLBACK_CLOSED_HTTP || reason == LWS_CALLBACK_HTTP_DROP_PROTOCOL) &&
	    user != NULL) {
		struct reply *reply = user;

		server_download_end(reply->download);
		reply->download = NULL;
		server_command_end(reply->post);
		reply->post = NULL;
	}
	if (reason == LWS_CALLBACK_FILTER_PROTOCOL_CONNECTION) {
		return -1; /* a WebSocket without a subprotocol that we have */
	}
	return lws_callback_http_dummy(wsi, reason, user, in, len);
}
