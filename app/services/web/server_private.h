/* SPDX-License-Identifier: MIT */
/* What the parts of the server share. Private to web/server*.c and its protocols. */
#ifndef WEB_SERVER_PRIVATE_H
#define WEB_SERVER_PRIVATE_H

#include <libwebsockets.h>
#include <stdint.h>

#include "base/platform.h"
#include "web/exports.h"
#include "web/outbox.h"
#include "web/source.h"

enum { SERVER_NAME_BYTES = 65, SERVER_HOST_BYTES = 262, SERVER_WHY_BYTES = 400 };

struct server_client {
	struct lws *wsi;
	struct server_client *next;
	int is_waiting; /* it has something to do at the next step */
};

enum { SERVER_PROTOCOLS = 4 };

struct server_pages;

struct server {
	const struct config *cfg;
	void (*report)(const char *line);
	struct lws_context *context;
	struct outbox *box;
	struct source *source;
	char own_name[SERVER_NAME_BYTES]; /* of the host */
	int64_t now_ns;                   /* CLOCK_MONOTONIC at the last step */
	struct platform platform;
	struct lws_protocols protocols[SERVER_PROTOCOLS + 1];
	uint32_t clients; /* WebSockets that are open */
	struct server_client *first_client;
	int64_t reported_ns;    /* when a rejected request was reported */
	uint32_t downloads;     /* that are being sent */
	uint32_t commands;      /* that are being posted */
	struct exports exports; /* of recordings */
	struct exports reports; /* of ecdaq */
	lws_sorted_usec_list_t timer;
	struct server_pages *pages; /* server_page.c */
	/* Foxglove: what all clients are sent */
	char *info;
	char *fixed;
	char *slaves; /* of session slaves_of */
	uint32_t slaves_of;
	uint8_t *scratch; /* LWS_PRE, head and largest message */
};

/** The server that @wsi belongs to. */
struct server *server_of(struct lws *wsi);

/** Is it HTTPS? */
int server_has_tls(const struct config *cfg);
/** 0 if the request may be served; else the HTTP status, and the answer, a constant, in @ret_why.
 */
int server_check_request(struct server *server, struct lws *wsi, const char **ret_why);
/** LWS_CALLBACK_FILTER_PROTOCOL_CONNECTION: 0: the request becomes a WebSocket; -1: it was
 * rejected. */
int server_filter(struct lws *wsi);
/** Send one text. 1; -1: end the connection. */
int server_send_text(struct lws *wsi, const char *text);

/** What the pages need. 0, -ENOMEM, -ENAMETOOLONG. */
int server_pages_create(struct server *server);
void server_pages_destroy(struct server *server);
/** Four times a second, read state and events again; 1: that was done. */
int server_pages_refresh(struct server *server);
/** A WebSocket was opened or closed; its callback comes whenever there is something new. */
void server_client_opened(struct server *server, struct server_client *client, struct lws *wsi);
void server_client_closed(struct server *server, struct server_client *client);

/** Put what every answer has into a head. 0; -1: there is no room. */
int server_put_headers(struct lws *wsi, uint8_t **p, uint8_t *end);

/* A recording, or what a program prints, that is being sent, server_download.c. */
struct download;

/**
 * Begin to send the recording @name, or as a table STEM.csv. 0; -1: end the connection; or the HTTP
 * status to be answered. Free with server_download_end().
 */
int server_download_begin(struct lws *wsi, const char *name, struct download **ret_download);
/** The same with what a verb of `ecdaq` prints, or a window of the scope as a recording; -ENOENT:
 * there is none for @path. */
int server_report_begin(struct lws *wsi, const char *path, struct download **ret_download);
void server_download_end(struct download *d);
/** Send some more, when the client takes it. 0: go on; 1: all was sent; -1: end the connection; or
 * the HTTP status to be answered. */
int server_download_turn(struct download *d);

/* What the page posts, server_command.c. */
struct command_post;

struct command_answer {
	unsigned status;
	const char *text;   /* as long as the post */
	const char *cookie; /* to be set; "": none */
};

/** Begin with what is posted to @path. 0; -ENOENT: nothing is; or the HTTP status to be answered
 * with a constant in @ret_why. Free with server_command_end(). */
int server_command_begin(struct lws *wsi, const char *path, struct command_post **ret_post,
			 const char **ret_why);
void server_command_end(struct command_post *post);
/** A part of the body. 0; -1: end the connection. */
int server_command_body(struct command_post *post, const void *data, size_t len);
/** All of it is there: pass it on; the client becomes writable when there is an answer. */
void server_command_send(struct command_post *post);
/** 1 with the answer; 0: not yet, the client becomes writable again. */
int server_command_turn(struct command_post *post, struct command_answer *ret);

/* Callbacks of libwebsockets. */
int server_http(struct lws *wsi, enum lws_callback_reasons reason, void *user, void *in,
		size_t len);
int server_foxglove(struct lws *wsi, enum lws_callback_reasons reason, void *user, void *in,
		    size_t len);
int server_page(struct lws *wsi, enum lws_callback_reasons reason, void *user, void *in,
		size_t len);
/** Bytes of user data that they need. */
size_t server_http_bytes(void);
size_t server_foxglove_bytes(void);
size_t server_page_bytes(void);

#endif
