/* SPDX-License-Identifier: MIT */
/*
 * The Foxglove WebSocket protocol, version 1 (subprotocols foxglove.websocket.v1 and
 * foxglove.sdk.v1): the texts of the server, and the requests of clients, which are foreign input.
 * Context: blocking.
 */
#ifndef WEB_FOXGLOVE_H
#define WEB_FOXGLOVE_H

#include <stddef.h>
#include <stdint.h>

#include "web/source.h"

enum {
	FOXGLOVE_REQUEST_BYTES = 64 * 1024, /* of one request; longer ones end the connection */
	FOXGLOVE_ITEMS = 1024,              /* of one request */
	FOXGLOVE_MESSAGE_HEAD_BYTES = 13,
};

enum foxglove_op {
	FOXGLOVE_SUBSCRIBE,
	FOXGLOVE_UNSUBSCRIBE,
	FOXGLOVE_GET_PARAMETERS, /* see web/parameters.h */
	FOXGLOVE_SET_PARAMETERS,
	FOXGLOVE_OTHER
};

struct foxglove_request {
	enum foxglove_op op;
	uint32_t count;
	struct {
		uint32_t id;
		uint32_t channel; /* FOXGLOVE_SUBSCRIBE only */
	} item[FOXGLOVE_ITEMS];
};

/** 0; -EBADMSG: not JSON or not of the protocol; -E2BIG: too many items; -ENOMEM. @ret is undefined
 * on failure. */
int foxglove_parse(const char *text, size_t len, struct foxglove_request *ret);

/* A text for a client; free() it. NULL without memory. */
char *foxglove_server_info(void);
/** The channels that are in every session; those of the slaves of @source. */
char *foxglove_advertise_fixed(void);
char *foxglove_advertise_slaves(const struct source *source);
/** The channels of session @session, which had @count slaves, are gone. */
char *foxglove_unadvertise_slaves(uint32_t session, size_t count);

enum foxglove_level { FOXGLOVE_INFO, FOXGLOVE_WARNING, FOXGLOVE_ERROR };

char *foxglove_status(enum foxglove_level level, const char *message);

/** The head of a binary message; its data follows. */
void foxglove_message_head(uint32_t subscription, int64_t time_ns,
			   uint8_t ret[FOXGLOVE_MESSAGE_HEAD_BYTES]);

#endif
