/* SPDX-License-Identifier: MIT */
/*
 * The mailbox engine: requests to the mailboxes of all slaves at the same time, a state machine a
 * slave, one frame with many datagrams a pass. It never blocks; the service thread calls
 * mailbox_step() again and again.
 *
 * No mail is ever executed twice. A mail is written in two strokes: all but the last byte of the
 * box, then the last byte, which alone makes the box full (an ESC denies the last byte to whoever
 * has not begun at the first). Either may be sent again after a lost frame. Mail of the slave is
 * read likewise; what a lost frame took out of the box is asked for again (repeat request, 0x080E).
 *
 * Mails of the slave go to the request of their protocol if it takes them, else to the protocol's
 * sink, else they are counted and dropped. Context: service thread.
 */
#ifndef MAILBOX_MAILBOX_H
#define MAILBOX_MAILBOX_H

#include <errno.h>
#include <stddef.h>
#include <stdint.h>

#include "base/limits.h"
#include "base/platform.h"
#include "mailbox/aoe.h"
#include "mailbox/coe.h"
#include "mailbox/eoe.h"
#include "mailbox/foe.h"
#include "mailbox/raw.h"
#include "mailbox/soe.h"
#include "mailbox/voe.h"
#include "wire/mailbox.h"

enum { MAILBOX_TYPES = 16 };

/* How the engine's frames travel: the mailbox slot of a line (link/line.h), or a test. */
struct mailbox_wire {
	/** line_submit(): 0; -EBUSY; -EMSGSIZE. */
	int (*submit)(void *ctx, const uint8_t *frame, size_t frame_len);
	/** line_collect(): length; -EAGAIN not yet; -ENOENT none; -ETIMEDOUT sent and not answered;
	 * any other -errno: never sent. */
	int (*collect)(void *ctx, uint8_t *ret_answer, size_t capacity);
	/** Length of the longest frame that submit() takes. */
	size_t (*frame_limit)(void *ctx);
	mono_t (*now)(void *ctx);
	/** For mailbox_wait(): 0 or -ECANCELED. */
	int (*sleep)(void *ctx, span_t span);
	void *ctx;
};

/* A slave's boxes, as SM0 and SM1 are programmed. */
struct mailbox_slave_spec {
	uint16_t station_addr;
	uint16_t out_start; /* SM0: the master writes */
	uint16_t out_bytes; /* MAILBOX_MIN_BYTES to MAILBOX_BYTES */
	uint16_t in_start;  /* SM1: the master reads */
	uint16_t in_bytes;
	uint16_t protocols; /* SII_MAILBOX_... */
};

enum { MAILBOX_MIN_BYTES = MAILBOX_HEADER_BYTES + 10 };

/* What a protocol's function returns; or -errno, which ends the request. */
enum mailbox_next {
	MAILBOX_DONE,   /* the request is complete */
	MAILBOX_SEND,   /* compose() the next mail, as soon as the box is free */
	MAILBOX_WAIT,   /* for another mail of the slave */
	MAILBOX_IGNORE, /* received(): this mail is not for the request */
};

struct mailbox_request;

/* One protocol, one file. Each function gets the request that runs. */
struct mailbox_protocol {
	enum mailbox_type type;
	uint16_t sii_bit; /* SII_MAILBOX_...: a slave without it refuses requests with -ENOTSUP */
	/** Check the parameters, set up rq->state. enum mailbox_next or -errno. */
	int (*start)(struct mailbox_request *rq);
	/** The next mail's data (without mailbox header) into @data. Its length, <= @capacity;
	 * -errno. Called once for each mail. */
	int (*compose)(struct mailbox_request *rq, uint8_t *data, size_t capacity);
	/** The mail of compose() is in the slave's box: enum mailbox_next or -errno. NULL:
	 * MAILBOX_WAIT. */
	int (*sent)(struct mailbox_request *rq);
	/** A mail of the slave. enum mailbox_next or -errno. */
	int (*received)(struct mailbox_request *rq, const uint8_t *data, size_t len);
	/** The request ends with @error (-ECANCELED, -ETIMEDOUT, what received() returned) in the
	 * middle: a last mail to the slave (an abort), its length; 0: none. NULL: none. */
	int (*give_up)(struct mailbox_request *rq, int error, uint8_t *data, size_t capacity);
};

struct mailbox_request {
	/* --- the caller's, unchanged by the engine --- */
	const struct mailbox_protocol *protocol;
	uint16_t slave_pos;
	union {
		struct coe_parameters coe;
		struct foe_parameters foe;
		struct soe_parameters soe;
		struct eoe_parameters eoe;
		struct aoe_parameters aoe;
		struct voe_parameters voe;
		struct raw_parameters raw;
	} with;              /* parameters */
	uint8_t *buffer;     /* what is written, or where it is read to */
	size_t capacity;     /* of the buffer; of what is written: its length */
	span_t timeout;      /* of one mail's answer, > 0 */
	span_t send_timeout; /* until the slave has room for one; 0: as timeout */
	/** Called once, when the request has ended; it may submit another, or this one again. NULL:
	 * none. */
	void (*done)(void *ctx, struct mailbox_request *rq);
	void *ctx;
	/* --- results --- */
	/* -EINPROGRESS; 0; -EREMOTEIO refused by the slave, see detail; -ETIMEDOUT; -ECANCELED;
	 * -EPROTO a reply that breaks the protocol; -EMSGSIZE the buffer is too small; -EIO a part
	 * of the reply was lost; -ENOTSUP; -ENODEV the slave has no mailbox (any more); -EINVAL. */
	int result;
	uint32_t detail; /* SDO abort code, FoE error, or mailbox error (is_mailbox_error) */
	uint8_t is_mailbox_error;
	size_t len;   /* bytes read or written so far */
	size_t total; /* bytes in all; 0: not known */
	/* --- the engine's and the protocol's --- */
	union {
		struct coe_state coe;
		struct foe_state foe;
		struct soe_state soe;
		struct eoe_state eoe;
		struct aoe_state aoe;
		struct voe_state voe;
		struct raw_state raw;
	} state;
	uint16_t mail_capacity; /* data bytes of a mail to this slave */
	uint16_t mail_room;     /* data bytes of a mail of this slave */
	mono_t not_before;      /* a protocol may delay its next compose() */
	mono_t deadline;
	uint8_t has_gap; /* a mail of the slave was lost while this waited: it may have been ours */
	uint8_t step;    /* engine */
	struct mailbox_request *next;
};

struct mailbox_engine;

/** Free with mailbox_destroy(), which ends all requests with -ECANCELED first. */
int mailbox_create(const struct mailbox_wire *wire, struct mailbox_engine **ret_mb);
void mailbox_destroy(struct mailbox_engine *mb);

/**
 * The slave at @slave_pos has these boxes from now on (its SM0 and SM1 were programmed, it is in
 * PRE-OP or higher, or BOOT): stale mail is read and dropped first. Requests that had begun end
 * with -ENODEV. NULL: it has no boxes; all its requests end with -ENODEV. 0; -EINVAL for a box that
 * no frame can carry or too short.
 */
int mailbox_slave_set(struct mailbox_engine *mb, uint16_t slave_pos,
		      const struct mailbox_slave_spec *spec);
/** 1 if the slave has a mailbox with protocol @sii_bit (SII_MAILBOX_...). */
int mailbox_slave_has(const struct mailbox_engine *mb, uint16_t slave_pos, uint16_t sii_bit);

/**
 * Begin @rq; it stays the engine's until it has ended. Requests of one protocol to one slave run
 * one after the other, in order. 0; or -errno, and done() is not called: -ENODEV, -ENOTSUP,
 * -EINVAL, -EBUSY it runs already.
 */
int mailbox_submit(struct mailbox_engine *mb, struct mailbox_request *rq);
/** End @rq with -ECANCELED (done() is called), with an abort to the slave if it has begun. Nothing
 * if it has ended. */
void mailbox_cancel(struct mailbox_engine *mb, struct mailbox_request *rq);
/** 1 while @rq is the engine's. */
static inline int mailbox_is_running(const struct mailbox_request *rq)
{
	return rq->result == -EINPROGRESS;
}

/** One pass: the answer of the last frame, all state machines, the next frame. Never waits while
 * the line is ridden; in direct mode for one frame. */
void mailbox_step(struct mailbox_engine *mb);
/** 1 while a request runs or the last frame is out: step again soon. */
int mailbox_is_busy(const struct mailbox_engine *mb);
/** Step until @rq has ended (bring-up, tests): its result; -ECANCELED when the wire's sleep() says
 * so. */
int mailbox_wait(struct mailbox_engine *mb, struct mailbox_request *rq);
/** The same until no request runs: 0 or -ECANCELED. */
int mailbox_wait_all(struct mailbox_engine *mb);

/** SM1's state, seen in a cyclic frame sent at @sent (FMMU onto 0x080D): this slave is not polled
 * until no newer one has come for long. */
void mailbox_status_hint(struct mailbox_engine *mb, uint16_t slave_pos, int is_full, mono_t sent);

/** Mails of @type that no request takes: emergencies, EoE frames, notifications. NULL: dropped. */
void mailbox_sink_set(struct mailbox_engine *mb, enum mailbox_type type,
		      void (*take)(void *ctx, uint16_t slave_pos, const uint8_t *data, size_t len),
		      void *ctx);

/* What happened at one slave since mailbox_create(). */
struct mailbox_counters {
	uint64_t sent;
	uint64_t received;
	uint64_t dropped;   /* nobody took it: stale, late, unexpected */
	uint64_t repeated;  /* seen twice, dropped */
	uint64_t malformed; /* length beyond the box */
	uint64_t recovered; /* read again by a repeat request */
	uint64_t lost;      /* gone: the slave had put the next one in before it was asked again */
	uint64_t timeouts;  /* requests that ended with -ETIMEDOUT */
	uint64_t polls;     /* datagrams that only looked whether there is mail */
};

const struct mailbox_counters *mailbox_counters_of(const struct mailbox_engine *mb,
						   uint16_t slave_pos);

#endif
