/* SPDX-License-Identifier: MIT */
/*
 * The cyclic exchange: our own frames, made once, sent every cycle. The first frame carries LRW (or
 * LWR and LRD, for slaves that forbid LRW, of
 * the first part of the process image), FRMW of 0x0910, and, if configured, BRD of 0x0130 and of
 * 0x092C, and LRD of the mailbox states (bus/mailbox_state.c); further frames carry the rest of the
 * image. A SyncManager's buffer is never split (T41). Every datagram's echo is checked (command,
 * index, address, length, and that a slave marked the source address); its index bytes carry a
 * 16-bit exchange sequence, so that a late or doubled frame is recognised, counted and dropped
 * (T05, T06). The reference clock is read with FPRD instead of FRMW in the first cycle and while it
 * does not answer (T17, bus/exchange_dc.h).
 */
#ifndef BUS_EXCHANGE_H
#define BUS_EXCHANGE_H

#include <stddef.h>
#include <stdint.h>

#include "base/slave_set.h"
#include "bus/exchange_plan.h"
#include "link/line.h"

enum exchange_status {
	EXCHANGE_OK,
	EXCHANGE_NO_FRAME, /* one or more frames were not back before the deadline */
	EXCHANGE_WKC_LOW,  /* all back, but a WKC is not as expected: the image is not touched, or,
			      of a split one, what is not slaves_low's */
};

struct exchange_result {
	enum exchange_status status;
	uint16_t wkc;
	uint16_t wkc_expected;
	struct slave_set slaves_low; /* whose data was in a chunk with another WKC */
	int64_t dc_time_ns; /* system time of the reference at this frame; 0: no (believable) answer
			     */
	uint16_t al_status; /* all slaves' AL status ORed: exactly AL_OP only if all are in OP */
	uint16_t al_wkc;    /* how many answered; 0 without monitor */
	int64_t dc_diff_ns; /* all slaves' |0x092C| ORed: an upper estimate; -1: not read */
	mono_t sent;        /* when the first frame was handed to the NIC */
	span_t round_trip;  /* first frame out to last frame back; -1 ns: not back */
	unsigned late;      /* frames of earlier cycles dropped in this one */
	unsigned late_by;   /* cycles, of the latest of them */
	unsigned doubled;
	unsigned foreign;
	int send_error; /* 0 or -errno of the transport */
};

struct exchange;

/**
 * 1 while the times of the reference clock are implausible for long: the host's clock was stopped,
 * or another device answers. They are not used until exchange_confirm_reference(). Context: any.
 */
int exchange_doubts_reference(const struct exchange *ex);
/** The reference has been identified: the next time it gives is right. Context: service thread. */
void exchange_confirm_reference(struct exchange *ex);

/* Mailbox states, bus/mailbox_state.c. */
struct exchange_mailboxes {
	uint64_t word[LIMIT_SLAVES / 64]; /* a bit each: it is full */
	mono_t sent;                      /* when the frame was, or an older one */
};

/** The states of the newest frame to which all slaves with a bit answered. 1; 0: there was none.
 * Context: service thread. */
int exchange_mailboxes(const struct exchange *ex, struct exchange_mailboxes *ret);

/* The datagrams whose working counter exchange_wkc_seen() gives. */
enum exchange_seen {
	EXCHANGE_SEEN_NONE, /* a filler */
	EXCHANGE_SEEN_CHUNK,
	EXCHANGE_SEEN_DC,
	EXCHANGE_SEEN_AL,
	EXCHANGE_SEEN_DIFF,
	EXCHANGE_SEEN_MAILBOXES,
	EXCHANGE_SEEN_KINDS,
};

/** The working counter in the newest frame that came back, of process data chunk @chunk (of
 * EXCHANGE_SEEN_CHUNK); 0xffff: none came yet. Context: any. */
uint16_t exchange_wkc_seen(const struct exchange *ex, enum exchange_seen which, unsigned chunk);

/** Everything is allocated here. Free with exchange_destroy(). */
int exchange_create(const struct exchange_plan *plan, struct line *line,
		    struct exchange **ret_exchange);
void exchange_destroy(struct exchange *ex);

/**
 * Send the outputs (first output_bytes of @image), take back the inputs (the rest of @image,
 * touched only with EXCHANGE_OK, or the good chunks of a split image) until @deadline. Answers to
 * service frames received meanwhile are handed over. Context: cycle thread.
 */
struct exchange_result exchange_run(struct exchange *ex, uint8_t *image, mono_t deadline);

/* What a cycle leaves for service frames. */
struct exchange_window {
	span_t period;
	mono_t wire_needed;  /* by the next cyclic frames: the last slave must be passed by then */
	mono_t listen_until; /* answers that come later are taken in by the next exchange */
};

/**
 * Send the service frames that fit into @window, and look for their answers. Context: cycle
 * thread. Returns how many were sent.
 */
unsigned exchange_ride(struct exchange *ex, const struct exchange_window *window);

#endif
