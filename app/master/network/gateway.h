/* SPDX-License-Identifier: MIT */
/*
 * The mailbox gateway (ETG.8200), apart from sockets: mails of clients, one after another for each
 * slave, through the mailbox engine, and what the slaves answer back to the client, with the
 * address and the counter of its mail.
 *
 * While a transfer of several mails goes on (segments of an SDO, packets of FoE), mails of the same
 * protocol of other clients wait. The engine's own requests do not: they come between two mails.
 *
 * A mail that cannot be sent is answered by an error reply of the mailbox; one that the slave does
 * not answer in time, or that was dropped, by nothing, and counted. Memory is allocated at
 * creation only. Context: service thread.
 */
#ifndef NETWORK_GATEWAY_H
#define NETWORK_GATEWAY_H

#include <netinet/in.h>
#include <stddef.h>
#include <stdint.h>
#include <sys/socket.h>

#include "base/clock.h"
#include "base/sample.h"
#include "network/gateway_frame.h"

struct mailbox_engine;
struct gateway;

/* TCP connections at the same time. */
enum { GATEWAY_CLIENTS = 16 };
/* Mails that wait or are with a slave: of one client, of all over UDP, and of all. A flood of
 * datagrams takes no place from a connection. */
enum {
	GATEWAY_MAILS_OF_PEER = 8,
	GATEWAY_MAILS_OF_UDP = 64,
	GATEWAY_MAILS = GATEWAY_MAILS_OF_UDP + GATEWAY_CLIENTS * GATEWAY_MAILS_OF_PEER,
};

/* Who sent a mail: a connection, or an address. */
struct gateway_peer {
	uint64_t connection;         /* 0: UDP */
	struct sockaddr_in6 address; /* of UDP; a struct sockaddr_in, rest 0, in it for IPv4 */
};

struct gateway_counters {
	uint64_t mails;
	uint64_t answers;
	uint64_t refused;    /* answered by the gateway itself, with an error */
	uint64_t unanswered; /* by the slave, in time */
	uint64_t dropped;    /* too many mails, or the bus is not up */
	uint64_t malformed;  /* by a client */
	uint64_t closed;     /* connections closed by the gateway */
};

/* Where answers go; a frame that cannot be sent is lost. */
struct gateway_out {
	void (*send)(void *ctx, const struct gateway_peer *peer, const uint8_t *frame, size_t len);
	void *ctx;
};

/* The bus as it is now. */
struct gateway_bus {
	struct mailbox_engine *mb; /* NULL: not up */
	const struct slave_info *slaves;
	size_t slave_count;
	span_t timeout; /* of an answer */
};

/** Free with gateway_destroy(), before the engine. 0; -ENOMEM. */
int gateway_create(const struct gateway_out *out, struct gateway **ret_gateway);
void gateway_destroy(struct gateway *gw);

/** 1: @peer may not have another mail waiting, or nobody may. */
int gateway_is_full(const struct gateway *gw, const struct gateway_peer *peer);
/** A mail of @peer; its data are copied. Dropped and counted if gateway_is_full(). */
void gateway_take(struct gateway *gw, const struct gateway_peer *peer,
		  const struct gateway_mail *mail);
/** The connection is closed: what waits is forgotten, what is with a slave is not answered. */
void gateway_forget(struct gateway *gw, const struct gateway_peer *peer);

/** Give mails to the engine, whose step follows. */
void gateway_step(struct gateway *gw, const struct gateway_bus *bus, mono_t now);
/** The bus goes down: end all requests at the engine. */
void gateway_detach(struct gateway *gw);
/** Mails that wait or are with a slave. */
unsigned gateway_open(const struct gateway *gw);

/** To be counted by whoever has the sockets, too. */
struct gateway_counters *gateway_counters(struct gateway *gw);

#endif
