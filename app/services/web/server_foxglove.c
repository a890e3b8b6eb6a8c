/* SPDX-License-Identifier: MIT */
/* A client of the Foxglove protocol, and what it is sent: as fast as it reads, and no faster. */
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "web/foxglove.h"
#include "web/parameters.h"
#include "web/server_private.h"
#include "web/subscriptions.h"

enum {
	MESSAGES_PER_TURN = 500,
	BYTES_PER_SECOND = 4 * FOXGLOVE_REQUEST_BYTES, /* of requests; more end the connection */
	STATUS_BYTES = 200,
	ANSWERS = 4, /* with parameters, that wait for the client; and so many in a second */
};

struct client {
	struct server_client link; /* first: the server's list */
	struct subscriptions subs;
	uint64_t cursor;
	uint32_t session;      /* whose channels it knows; 0: none */
	size_t session_slaves; /* how many those are */
	int has_info;          /* was sent */
	int has_fixed;         /* was sent */
	char *status;          /* to be sent; NULL: none */
	char *answer[ANSWERS]; /* to be sent, the oldest first */
	int answers;
	int answers_made;      /* in the second */
	uint64_t dropped;      /* messages in all */
	uint64_t dropped_told; /* of those, in a status */
	int64_t dropped_at_ns; /* when */
	uint8_t *request;      /* that arrives in parts; FOXGLOVE_REQUEST_BYTES */
	size_t request_bytes;
	int64_t second_ns; /* of received_bytes and answers_made */
	size_t received_bytes;
};

size_t server_foxglove_bytes(void)
{
	return sizeof(struct client);
}

/* The newest status replaces one that could not be sent yet. */
static void set_status(struct client *c, enum foxglove_level level, const char *text)
{
	free(c->status);
	c->status = foxglove_status(level, text);
	lws_callback_on_writable(c->link.wsi);
}

static void set_status_for(struct client *c, const char *what, uint32_t id, const char *why)
{
	char text[STATUS_BYTES];

	snprintf(text, sizeof(text), "%s %u: %s", what, id, why);
	set_status(c, FOXGLOVE_ERROR, text);
}

static void subscribe(struct server *s, struct client *c, uint32_t id, uint32_t channel)
{
	if (!source_has_channel(s->source, channel)) {
		set_status_for(c, "subscription", id, "there is no such channel");
		return;
	}
	if (subscriptions_add(&c->subs, id, channel, source_next(s->source, channel)) < 0) {
		set_status_for(c, "subscription", id, "this id or channel is in use");
		return;
	}
	source_want(s->source, channel, 1);
	if (c->subs.count == 1) {
		c->cursor = outbox_head(s->box);
	}
}

/* Channels of a session that has ended are not counted any more. */
static void forget(struct server *s, uint32_t channel)
{
	if (source_has_channel(s->source, channel)) {
		source_want(s->source, channel, -1);
	}
}

static void unsubscribe(struct server *s, struct client *c, uint32_t id)
{
	int64_t channel = subscriptions_remove(&c->subs, id);

	if (channel < 0) {
		set_status_for(c, "subscription", id, "there is none with this id");
		return;
	}
	forget(s, (uint32_t)channel);
}

static void answer_parameters(struct server *s, struct client *c)
{
	if (c->answers == ANSWERS || c->answers_made == ANSWERS) {
		set_status(c, FOXGLOVE_WARNING, "too many requests for parameters in a second");
		return;
	}
	c->answers_made++;
	if (parameters_answer((const char *)c->request, c->request_bytes, s->source,
			      &c->answer[c->answers]) < 0) {
		set_status(c, FOXGLOVE_ERROR,
			   "a request for parameters was ignored: it is not valid");
		return;
	}
	c->answers++;
	lws_callback_on_writable(c->link.wsi);
}

static int send_answer(struct client *c)
{
	char *answer = c->answer[0];
	int r = server_send_text(c->link.wsi, answer);

	free(answer);
	c->answers--;
	memmove(&c->answer[0], &c->answer[1], (size_t)c->answers * sizeof(c->answer[0]));
	return r;
}

static void take_request(struct server *s, struct client *c)
{
	struct foxglove_request *request = malloc(sizeof(*request));
	int r = request == NULL
			? -1
			: foxglove_parse((const char *)c->request, c->request_bytes, request);

	if (r < 0) {
		set_status(c, FOXGLOVE_ERROR, "a request was ignored: it is not valid");
	} else if (request->op == FOXGLOVE_GET_PARAMETERS) {
		answer_parameters(s, c);
	} else if (request->op == FOXGLOVE_SET_PARAMETERS) {
		set_status(c, FOXGLOVE_ERROR, "parameters were not set: they can only be read");
	} else if (request->op == FOXGLOVE_OTHER) {
		set_status(c, FOXGLOVE_WARNING,
			   "a request was ignored: this server has channels to subscribe to and "
			   "parameters to read only");
	} else {
		for (uint32_t i = 0; i < request->count; i++) {
			if (request->op == FOXGLOVE_SUBSCRIBE) {
				subscribe(s, c, request->item[i].id, request->item[i].channel);
			} else {
				unsubscribe(s, c, request->item[i].id);
			}
		}
	}
	free(request);
}

/* -1: end the connection. */
static int receive(struct lws *wsi, struct client *c, const void *in, size_t len)
{
	struct server *s = server_of(wsi);

	if (s->now_ns - c->second_ns >= NS_PER_S) {
		c->second_ns = s->now_ns;
		c->received_bytes = 0;
		c->answers_made = 0;
	}
	c->received_bytes += len;
	if (c->received_bytes > BYTES_PER_SECOND) {
		lws_close_reason(wsi, LWS_CLOSE_STATUS_POLICY_VIOLATION, NULL, 0);
		return -1;
	}
	if (c->request_bytes + len > FOXGLOVE_REQUEST_BYTES) {
		lws_close_reason(wsi, LWS_CLOSE_STATUS_MESSAGE_TOO_LARGE, NULL, 0);
		return -1;
	}
	c->request = c->request == NULL ? malloc(FOXGLOVE_REQUEST_BYTES) : c->request;
	if (c->request == NULL) {
		return -1;
	}
	if (len > 0) {
		memcpy(c->request + c->request_bytes, in, len);
		c->request_bytes += len;
	}
	if (lws_is_final_fragment(wsi) && lws_remaining_packet_payload(wsi) == 0) {
		take_request(s, c);
		c->request_bytes = 0;
	}
	return 0;
}

static int send_bytes(struct lws *wsi, uint8_t *bytes, size_t len, enum lws_write_protocol how)
{
	return lws_write(wsi, bytes, len, how) < (int)len ? -1 : 1;
}

/* Also ends its subscriptions of the session before. */
static int send_session(struct server *s, struct client *c)
{
	uint32_t session = source_session(s->source);
	size_t count;

	if (c->session != 0) {
		char *text = foxglove_unadvertise_slaves(c->session, c->session_slaves);
		int r = server_send_text(c->link.wsi, text);

		free(text);
		for (uint32_t slot = SOURCE_FIRST_SLAVE; slot < SOURCE_SLOTS; slot++) {
			if (c->subs.slot[slot].channel != 0) {
				(void)subscriptions_remove(&c->subs, c->subs.slot[slot].id);
			}
		}
		c->session = 0;
		return r;
	}
	if (s->slaves_of != session) {
		free(s->slaves);
		s->slaves = foxglove_advertise_slaves(s->source);
		s->slaves_of = session;
	}
	(void)source_slaves(s->source, &count);
	c->session = session;
	c->session_slaves = count;
	return server_send_text(c->link.wsi, s->slaves);
}

static void tell_dropped(struct server *s, struct client *c)
{
	char text[STATUS_BYTES];

	if (c->dropped == c->dropped_told || s->now_ns - c->dropped_at_ns < NS_PER_S) {
		return;
	}
	snprintf(text, sizeof(text),
		 "%" PRIu64 " messages were dropped, %" PRIu64
		 " in all: this connection is slower than the data; subscribe to fewer topics",
		 c->dropped - c->dropped_told, c->dropped);
	c->dropped_told = c->dropped;
	c->dropped_at_ns = s->now_ns;
	set_status(c, FOXGLOVE_WARNING, text);
}

static int send_message(struct server *s, struct client *c)
{
	struct outbox_message message;
	const struct subscription *sub = NULL;
	uint64_t lost;

	while (sub == NULL) {
		if (!outbox_read(s->box, &c->cursor, &message)) {
			return 0;
		}
		sub = subscriptions_take(&c->subs, &message, &lost);
	}
	c->dropped += lost;
	tell_dropped(s, c);
	foxglove_message_head(sub->id, message.time_ns, s->scratch + LWS_PRE);
	memcpy(s->scratch + LWS_PRE + FOXGLOVE_MESSAGE_HEAD_BYTES, message.data, message.len);
	return send_bytes(c->link.wsi, s->scratch + LWS_PRE,
			  FOXGLOVE_MESSAGE_HEAD_BYTES + message.len, LWS_WRITE_BINARY);
}

/* 1: something was sent; 0: all was; -1: end the connection. */
static int send_next(struct server *s, struct client *c)
{
	int r;

	if (!c->has_info) {
		c->has_info = 1;
		return server_send_text(c->link.wsi, s->info);
	}
	if (!c->has_fixed) {
		c->has_fixed = 1;
		return server_send_text(c->link.wsi, s->fixed);
	}
	if (c->status != NULL) {
		r = server_send_text(c->link.wsi, c->status);
		free(c->status);
		c->status = NULL;
		return r;
	}
	if (c->answers > 0) {
		return send_answer(c);
	}
	/* First what is left of the session before. */
	if (c->session != source_session(s->source) &&
	    (c->subs.count == 0 || c->cursor >= source_session_position(s->source))) {
		return send_session(s, c);
	}
	return send_message(s, c);
}

static int send_turn(struct lws *wsi, struct client *c)
{
	struct server *s = server_of(wsi);

	for (int n = 0; n < MESSAGES_PER_TURN && !lws_send_pipe_choked(wsi); n++) {
		int r = send_next(s, c);

		if (r <= 0) {
			return r;
		}
	}
	lws_callback_on_writable(wsi);
	return 0;
}

static void opened(struct lws *wsi, struct client *c)
{
	struct server *s = server_of(wsi);

	memset(c, 0, sizeof(*c));
	server_client_opened(s, &c->link, wsi);
	c->cursor = outbox_head(s->box);
	lws_callback_on_writable(wsi);
}

static void closed(struct lws *wsi, struct client *c)
{
	struct server *s = server_of(wsi);

	server_client_closed(s, &c->link);
	for (uint32_t slot = 0; slot < SOURCE_SLOTS; slot++) {
		if (c->subs.slot[slot].channel != 0) {
			forget(s, c->subs.slot[slot].channel);
		}
	}
	if (c->dropped > 0) {
		char text[STATUS_BYTES];

		snprintf(text, sizeof(text),
			 "a client was slower than the data: %" PRIu64 " messages were dropped",
			 c->dropped);
		s->report(text);
	}
	while (c->answers > 0) {
		free(c->answer[--c->answers]);
	}
	free(c->status);
	free(c->request);
}

int server_foxglove(struct lws *wsi, enum lws_callback_reasons reason, void *user, void *in,
		    size_t len)
{
	int r = 0;

	/* A long table of reasons; those that are not here are not ours. */
	if (reason == LWS_CALLBACK_FILTER_PROTOCOL_CONNECTION) {
		r = server_filter(wsi);
	} else if (reason == LWS_CALLBACK_ESTABLISHED) {
		opened(wsi, user);
	} else if (reason == LWS_CALLBACK_RECEIVE) {
		r = receive(wsi, user, in, len);
	} else if (reason == LWS_CALLBACK_SERVER_WRITEABLE) {
		r = send_turn(wsi, user);
	} else if (reason == LWS_CALLBACK_CLOSED) {
		closed(wsi, user);
	}
	return r;
}
