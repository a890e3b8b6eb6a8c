/* SPDX-License-Identifier: MIT */
#include "stream/broker.h"

#include <errno.h>
#include <inttypes.h>
#include <nats/nats.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/clock.h"
#include "base/host_clock.h"
#include "stream/ack.h"

/* Headers by which JetStream stores once and in order. */
#define ID_HEADER "Nats-Msg-Id"
#define STREAM_HEADER "Nats-Expected-Stream"
#define AFTER_HEADER "Nats-Expected-Last-Subject-Sequence"

enum {
	TIMEOUT_MS = 5000,
	PING_MS = 5000,
	PINGS_OUT = 2,
	PENDING_MESSAGES = 4096, /* answers kept; more than messages of one round */
	PENDING_BYTES = 4 << 20,
	PAYLOAD_RESERVE_BYTES = 2048, /* for headers, which count */
	SERVERS = 16,
	SERVER_BYTES = 256,
};

struct broker {
	const struct config *cfg;
	natsOptions *options;
	natsConnection *connection;
	jsCtx *js;
	natsSubscription *answers;
	natsInbox *inbox;
	char server[SERVER_BYTES];
};

/* A line about what the library reports. Its own text is better than that of the status. */
static int fail(struct broker *b, char *problem, const char *what, natsStatus status)
{
	natsStatus last = NATS_OK;
	const char *text = nats_GetLastError(&last);

	text = last == status && text != NULL && text[0] != '\0' ? text
								 : natsStatus_GetText(status);
	if (text[0] == '(' && strstr(text, "): ") != NULL) { /* "(conn.c:2088): ", its source */
		text = strstr(text, "): ") + 3;
	}
	snprintf(problem, BROKER_PROBLEM_BYTES, "%s: %.*s", what, (int)strcspn(text, "\n"), text);
	broker_disconnect(b);
	return -EIO;
}

static int refuse(struct broker *b, char *problem, const char *format, ...)
	__attribute__((format(printf, 3, 4)));

static int refuse(struct broker *b, char *problem, const char *format, ...)
{
	va_list args;

	va_start(args, format);
	vsnprintf(problem, BROKER_PROBLEM_BYTES, format, args);
	va_end(args);
	broker_disconnect(b);
	return -EIO;
}

static natsStatus set_servers(struct broker *b)
{
	char text[CONFIG_PATH_BYTES];
	const char *server[SERVERS];
	int count = 0;
	char *rest = NULL;

	snprintf(text, sizeof(text), "%s", b->cfg->stream_servers);
	for (char *one = strtok_r(text, ", ", &rest); one != NULL && count < SERVERS;
	     one = strtok_r(NULL, ", ", &rest)) {
		server[count++] = one;
	}
	return natsOptions_SetServers(b->options, server, count);
}

/* The library reads the credentials when it connects, and reports no file then. */
static int check_credentials(const struct config *cfg, char *problem)
{
	if (cfg->stream_credentials[0] == '\0' || access(cfg->stream_credentials, R_OK) == 0) {
		return 0;
	}
	snprintf(problem, BROKER_PROBLEM_BYTES, "stream.credentials: %.150s: %s",
		 cfg->stream_credentials, strerror(errno));
	return -EINVAL;
}

/* Each step, and the option that is to blame for it. */
static int set_security(struct broker *b, char *problem)
{
	const struct config *cfg = b->cfg;
	const char *key = NULL;
	natsStatus status = NATS_OK;

	if (cfg->stream_credentials[0] != '\0') {
		key = "stream.credentials";
		status = natsOptions_SetUserCredentialsFromFiles(b->options,
								 cfg->stream_credentials, NULL);
	}
	if (status == NATS_OK && cfg->stream_tls) {
		key = "stream.tls";
		status = natsOptions_SetSecure(b->options, true);
	}
	if (status == NATS_OK && cfg->stream_ca[0] != '\0') {
		key = "stream.ca";
		status = natsOptions_LoadCATrustedCertificates(b->options, cfg->stream_ca);
	}
	if (status == NATS_OK && cfg->stream_certificate[0] != '\0') {
		key = "stream.certificate";
		status = natsOptions_LoadCertificatesChain(b->options, cfg->stream_certificate,
							   cfg->stream_key);
	}
	if (status == NATS_OK) {
		return 0;
	}
	(void)fail(b, problem, key, status);
	return -EINVAL;
}

static natsStatus set_bounds(struct broker *b, const char *appliance)
{
	char name[128];
	natsStatus status;

	snprintf(name, sizeof(name), "ecdaq-stream %s", appliance);
	status = natsOptions_SetName(b->options, name);
	/* Reconnecting is ours: what the library had not sent is then not sent late. */
	status = status != NATS_OK ? status : natsOptions_SetAllowReconnect(b->options, false);
	status = status != NATS_OK ? status : natsOptions_SetTimeout(b->options, TIMEOUT_MS);
	status = status != NATS_OK ? status : natsOptions_SetPingInterval(b->options, PING_MS);
	status = status != NATS_OK ? status : natsOptions_SetMaxPingsOut(b->options, PINGS_OUT);
	return status != NATS_OK ? status : natsOptions_SetWriteDeadline(b->options, TIMEOUT_MS);
}

int broker_create(const struct config *cfg, const char *appliance, struct broker **ret_broker,
		  char problem[BROKER_PROBLEM_BYTES])
{
	struct broker *b = calloc(1, sizeof(*b));
	natsStatus status = b == NULL ? NATS_NO_MEMORY : natsOptions_Create(&b->options);
	int r = 0;

	if (status == NATS_OK) {
		b->cfg = cfg;
		status = set_servers(b);
	}
	status = status != NATS_OK ? status : set_bounds(b, appliance);
	if (status != NATS_OK) {
		snprintf(problem, BROKER_PROBLEM_BYTES, "stream.servers: %s",
			 natsStatus_GetText(status));
		r = -EINVAL;
	} else {
		r = check_credentials(cfg, problem);
		r = r < 0 ? r : set_security(b, problem);
	}
	if (r < 0) {
		broker_destroy(b);
		return r;
	}
	*ret_broker = b;
	return 0;
}

void broker_destroy(struct broker *b)
{
	if (b != NULL) {
		broker_disconnect(b);
		natsOptions_Destroy(b->options);
		free(b);
		nats_Close();
	}
}

void broker_disconnect(struct broker *b)
{
	natsSubscription_Destroy(b->answers);
	jsCtx_Destroy(b->js);
	natsConnection_Destroy(b->connection);
	natsInbox_Destroy(b->inbox);
	b->answers = NULL;
	b->js = NULL;
	b->connection = NULL;
	b->inbox = NULL;
	b->server[0] = '\0';
}

int broker_is_connected(const struct broker *b)
{
	return b->connection != NULL && !natsConnection_IsClosed(b->connection);
}

const char *broker_server(const struct broker *b)
{
	return b->server;
}

size_t broker_payload_limit(const struct broker *b)
{
	int64_t bytes = b->connection == NULL ? 0 : natsConnection_GetMaxPayload(b->connection);

	return bytes > PAYLOAD_RESERVE_BYTES ? (size_t)bytes - PAYLOAD_RESERVE_BYTES : 0;
}

int broker_connect(struct broker *b, char problem[BROKER_PROBLEM_BYTES])
{
	char pattern[BROKER_SUBJECT_BYTES];
	natsStatus status;

	broker_disconnect(b);
	status = natsConnection_Connect(&b->connection, b->options);
	if (status != NATS_OK) {
		return fail(b, problem, b->cfg->stream_servers, status);
	}
	(void)natsConnection_GetConnectedUrl(b->connection, b->server, sizeof(b->server));
	status = natsInbox_Create(&b->inbox);
	if (status == NATS_OK) {
		snprintf(pattern, sizeof(pattern), "%s.*", b->inbox);
		status = natsConnection_SubscribeSync(&b->answers, b->connection, pattern);
	}
	status = status != NATS_OK ? status
				   : natsSubscription_SetPendingLimits(b->answers, PENDING_MESSAGES,
								       PENDING_BYTES);
	status = status != NATS_OK ? status : natsConnection_JetStream(&b->js, b->connection, NULL);
	return status != NATS_OK ? fail(b, problem, b->cfg->stream_servers, status) : 0;
}

static void take_headers(natsMsg *msg, struct broker_newest *ret)
{
	const char *text;

	ret->sequence = natsMsg_GetSequence(msg);
	for (int i = 0; i < MARK_FIELDS; i++) {
		enum mark_field field = (enum mark_field)i;

		if (natsMsgHeader_Get(msg, mark_name(field), &text) == NATS_OK && text != NULL) {
			mark_take(&ret->mark, field, text);
		}
	}
	if (natsMsgHeader_Get(msg, ID_HEADER, &text) == NATS_OK && text != NULL) {
		snprintf(ret->id, sizeof(ret->id), "%s", text);
	}
}

int broker_newest(struct broker *b, const char *subject, struct broker_newest *ret,
		  char problem[BROKER_PROBLEM_BYTES])
{
	const char *stream = b->cfg->stream_name;
	struct broker_newest found = { .sequence = 0 };
	natsMsg *msg = NULL;
	jsErrCode error = JSBadRequestErr; /* or any other that has no line of its own */
	natsStatus status = js_GetLastMsg(&msg, b->js, stream, subject, NULL, &error);

	if (status == NATS_OK) {
		take_headers(msg, &found);
		natsMsg_Destroy(msg);
		*ret = found;
		return 1;
	}
	switch ((int)error) {
	case JSNoMessageFoundErr:
		return 0;
	case JSStreamNotFoundErr:
		return refuse(b, problem,
			      "%s: stream %s: not there: create it, with subject ecdaq.>",
			      b->server, stream);
	case JSNotEnabledErr:
	case JSNotEnabledForAccountErr:
		return refuse(b, problem, "%s: JetStream is off: enable it, for this account",
			      b->server);
	default:
		return fail(b, problem, subject, status);
	}
}

static natsStatus make(struct broker *b, const struct broker_message *m, size_t index,
		       natsMsg **ret_msg)
{
	char text[BROKER_SUBJECT_BYTES];
	natsMsg *msg = NULL;
	natsStatus status;

	snprintf(text, sizeof(text), "%s.%zu", b->inbox, index);
	status = natsMsg_Create(&msg, m->subject, text, m->data, (int)m->len);
	status = status != NATS_OK ? status : natsMsgHeader_Set(msg, ID_HEADER, m->id);
	status = status != NATS_OK ? status
				   : natsMsgHeader_Set(msg, STREAM_HEADER, b->cfg->stream_name);
	if (status == NATS_OK && m->after != BROKER_ANY) {
		snprintf(text, sizeof(text), "%" PRIu64, m->after);
		status = natsMsgHeader_Set(msg, AFTER_HEADER, text);
	}
	for (int i = 0; status == NATS_OK && i < MARK_FIELDS; i++) {
		enum mark_field field = (enum mark_field)i;

		if (mark_has(&m->mark, field)) {
			mark_format(&m->mark, field, text);
			status = natsMsgHeader_Set(msg, mark_name(field), text);
		}
	}
	if (status != NATS_OK) {
		natsMsg_Destroy(msg);
		return status;
	}
	*ret_msg = msg;
	return NATS_OK;
}

static int send_all(struct broker *b, const struct broker_message *message, size_t count,
		    char *problem)
{
	for (size_t i = 0; i < count; i++) {
		natsMsg *msg = NULL;
		natsStatus status = make(b, &message[i], i, &msg);

		status = status != NATS_OK ? status : natsConnection_PublishMsg(b->connection, msg);
		natsMsg_Destroy(msg);
		if (status != NATS_OK) {
			return fail(b, problem, message[i].subject, status);
		}
	}
	return 0;
}

/* The message that @msg answers: its index follows the inbox's name. */
static struct broker_message *answered(const struct broker *b, natsMsg *msg,
				       struct broker_message *message, size_t count)
{
	const char *subject = natsMsg_GetSubject(msg);
	size_t prefix = strlen(b->inbox) + 1;
	char *end;
	unsigned long index;

	if (strlen(subject) <= prefix) {
		return NULL;
	}
	index = strtoul(subject + prefix, &end, 10);
	return *end == '\0' && index < count ? &message[index] : NULL;
}

static int take_answer(struct broker *b, natsMsg *msg, struct broker_message *m, char *problem)
{
	struct ack ack;

	if (natsMsg_IsNoResponders(msg)) {
		return refuse(b, problem,
			      "%s: no stream takes subject %s: create stream %s, with subject "
			      "ecdaq.>",
			      b->server, m->subject, b->cfg->stream_name);
	}
	ack_parse(natsMsg_GetData(msg), (size_t)natsMsg_GetDataLength(msg), &ack);
	switch (ack.result) {
	case ACK_DUPLICATE:
		if (m->after != BROKER_ANY) {
			return refuse(b, problem, "%s: id %s is stored already: resuming behind it",
				      m->subject, m->id);
		}
		m->sequence = ack.sequence;
		return 0;
	case ACK_STORED:
		m->sequence = ack.sequence;
		return 0;
	case ACK_REJECTED:
		return refuse(b, problem, "%s: rejected: %s", m->subject, ack.reason);
	case ACK_INVALID:
		break;
	}
	return refuse(b, problem, "%s: not an answer of JetStream", m->subject);
}

static int take_answers(struct broker *b, struct broker_message *message, size_t count,
			char *problem)
{
	int64_t deadline_ns = host_clock_ns(CLOCK_MONOTONIC) + TIMEOUT_MS * NS_PER_MS;
	size_t left = count;
	int r = 0;

	while (left > 0 && r == 0) {
		int64_t wait_ms = (deadline_ns - host_clock_ns(CLOCK_MONOTONIC)) / NS_PER_MS;
		natsMsg *msg = NULL;
		struct broker_message *m;
		natsStatus status =
			natsSubscription_NextMsg(&msg, b->answers, wait_ms > 0 ? wait_ms : 1);

		if (status != NATS_OK) {
			return fail(b, problem, b->server, status);
		}
		m = answered(b, msg, message, count);
		if (m != NULL && m->sequence == 0) {
			r = take_answer(b, msg, m, problem);
			left--;
		}
		natsMsg_Destroy(msg);
	}
	return r;
}

int broker_store(struct broker *b, struct broker_message *message, size_t count,
		 char problem[BROKER_PROBLEM_BYTES])
{
	int r;

	for (size_t i = 0; i < count; i++) {
		message[i].sequence = 0;
	}
	r = send_all(b, message, count, problem);
	return r < 0 ? r : take_answers(b, message, count, problem);
}
