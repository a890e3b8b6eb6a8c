/* SPDX-License-Identifier: MIT */
/*
 * One connection to NATS and the JetStream behind it. No message is sent before the answers to
 * those before it have come: after any failure the connection is closed, and what is stored is
 * asked for. Unit tests put a fake in its place. Context: one thread; blocks up to the timeouts.
 */
#ifndef STREAM_BROKER_H
#define STREAM_BROKER_H

#include <stddef.h>
#include <stdint.h>

#include "config/config.h"
#include "stream/mark.h"

struct broker;

enum { BROKER_PROBLEM_BYTES = 256, BROKER_ID_BYTES = 96, BROKER_SUBJECT_BYTES = 192 };

/* In broker_message.after: stored whatever the newest of its subject is. */
#define BROKER_ANY UINT64_MAX

struct broker_message {
	const char *subject;
	char id[BROKER_ID_BYTES]; /* Nats-Msg-Id */
	struct mark mark;
	uint64_t after; /* stored only if this is the newest of its subject (0: if there is none) */
	const void *data;
	size_t len;
	uint64_t sequence; /* in the stream, once it is stored */
};

/* The newest message of a subject. */
struct broker_newest {
	uint64_t sequence;
	struct mark mark;
	char id[BROKER_ID_BYTES];
};

/** @cfg is kept. 0; -EINVAL with a line in @problem: an option or one of its files is unusable. */
int broker_create(const struct config *cfg, const char *appliance, struct broker **ret_broker,
		  char problem[BROKER_PROBLEM_BYTES]);
void broker_destroy(struct broker *b);

/* All of these: 0 or more; negative with a line in @problem, and the connection is closed. */
int broker_connect(struct broker *b, char problem[BROKER_PROBLEM_BYTES]);
void broker_disconnect(struct broker *b);
int broker_is_connected(const struct broker *b);
/** Where it is connected to; "": not. */
const char *broker_server(const struct broker *b);
/** Bytes of the largest payload. */
size_t broker_payload_limit(const struct broker *b);
/** 1; 0: the stream has none. @subject may have wildcards. */
int broker_newest(struct broker *b, const char *subject, struct broker_newest *ret,
		  char problem[BROKER_PROBLEM_BYTES]);
/** Store all, each of another subject. A duplicate of a message with BROKER_ANY counts as stored.
 */
int broker_store(struct broker *b, struct broker_message *message, size_t count,
		 char problem[BROKER_PROBLEM_BYTES]);

#endif
