/* SPDX-License-Identifier: MIT */
/*
 * What the files of mailbox/ share. engine.c has the requests, box.c the two boxes of one slave.
 */
#ifndef MAILBOX_MAILBOX_INTERNAL_H
#define MAILBOX_MAILBOX_INTERNAL_H

#include "mailbox/mailbox.h"
#include "wire/datagram.h"

enum request_step { REQUEST_QUEUED, REQUEST_SEND, REQUEST_SENDING, REQUEST_AWAIT };

/* What came of one datagram. */
enum outcome {
	OUTCOME_DONE,
	OUTCOME_DENIED, /* it came back with WKC 0 */
	OUTCOME_LOST,   /* it was sent and did not come back: the slave may have executed it */
	OUTCOME_UNSENT, /* it never left */
};

/* SM0: a mail is written in strokes, the last byte of the box in one of its own. */
enum writer_step { WRITER_IDLE, WRITER_FILL, WRITER_COMMIT };

struct box_writer {
	enum writer_step step;
	struct mailbox_request *owner; /* NULL: a farewell, or its request has ended */
	uint8_t mail[MAILBOX_BYTES];
	size_t fill_len; /* bytes before the last one of the box */
	size_t pos;      /* written of these */
	uint8_t counter;
	unsigned refusals;
	mono_t not_before;
	mono_t give_up; /* of a farewell */
	uint32_t serial;
};

/* SM1. */
enum reader_step {
	READER_IDLE,
	READER_READ,   /* it is full */
	READER_LOOK,   /* what a lost frame took out of it is asked for again: 0x080E now */
	READER_ASK,    /* toggle the repeat request */
	READER_REPEAT, /* until the slave has put it in again */
};

struct box_reader {
	enum reader_step step;
	uint8_t mail[MAILBOX_BYTES];
	size_t pos;           /* read so far */
	uint8_t is_taken;     /* the mail is whole and was handed over; the box is not free yet */
	uint8_t is_tail_lost; /* the frame with the last byte was lost */
	uint8_t is_repeated;  /* this mail comes from a repeat request */
	uint8_t activate;     /* 0x080E as it is to be */
	mono_t repeat_until;
	mono_t poll_at;
	span_t idle;
	mono_t hint_sent; /* frame of the newest hint */
	uint8_t is_full_hint;
	mono_t emptied_at; /* hints of frames before say nothing */
	uint8_t counter;   /* of the mail before */
	uint8_t has_mail;
	uint8_t is_counting;
	uint64_t hash; /* of the mail before */
	uint32_t serial;
};

enum { FAREWELL_BYTES = 64 };

struct box_slave {
	struct mailbox_slave_spec spec;
	int is_present;
	unsigned drain; /* stale mails that may still be dropped; 0: drained */
	struct box_writer writer;
	struct box_reader reader;
	struct mailbox_request *active[MAILBOX_TYPES];
	struct mailbox_request *queue;
	unsigned next_type; /* served first */
	unsigned awaited;   /* requests in REQUEST_AWAIT */
	mono_t sent_at;     /* the last mail */
	uint8_t farewell[FAREWELL_BYTES];
	size_t farewell_len;
	uint8_t farewell_type;
	struct mailbox_counters counters;
};

enum flight_kind {
	FLIGHT_POLL,
	FLIGHT_READ,
	FLIGHT_LOOK,
	FLIGHT_ASK,
	FLIGHT_REPEAT,
	FLIGHT_FILL,
	FLIGHT_COMMIT,
};

/* One datagram of the frame that is out. */
struct flight {
	uint16_t slave_pos;
	uint8_t kind;
	uint16_t len;
	uint32_t serial;
};

enum { FLIGHTS = 128 };

/* What the boxes ask of the requests, and tell them. */
struct box_hooks {
	/** The writer is free: compose the next mail, if there is one. */
	void (*feed)(struct mailbox_engine *mb, uint16_t pos, mono_t now);
	/** The mail in the writer is in the slave's box. */
	void (*sent)(struct mailbox_engine *mb, uint16_t pos, mono_t now);
	/** A whole mail of the slave. */
	void (*received)(struct mailbox_engine *mb, uint16_t pos,
			 const struct mailbox_header *header, const uint8_t *data, mono_t now);
	/** A mail of the slave is missing. */
	void (*gap)(struct mailbox_engine *mb, uint16_t pos);
	/** A mail whose length is beyond its box. */
	void (*malformed)(struct mailbox_engine *mb, uint16_t pos, uint8_t type);
};

struct mailbox_sink {
	void (*take)(void *ctx, uint16_t slave_pos, const uint8_t *data, size_t len);
	void *ctx;
};

struct mailbox_engine {
	struct mailbox_wire wire;
	struct box_hooks hooks;
	struct mailbox_sink sink[MAILBOX_TYPES];
	struct box_slave *slave[LIMIT_SLAVES]; /* NULL: none was ever set */
	uint16_t slave_end;                    /* positions from here on have none */
	uint16_t cursor;                       /* served first */
	uint32_t serial;
	uint8_t sequence; /* index byte */
	unsigned requests;
	struct flight flight[FLIGHTS];
	size_t flight_count;
	struct ecat_frame_builder fb;
	size_t frame_limit;
	uint8_t frame[LIMIT_FRAME_BYTES];
	uint8_t answer[LIMIT_FRAME_BYTES];
};

/* --- box.c --- */

void box_reset(struct mailbox_engine *mb, struct box_slave *sl, mono_t now);
/** Put the slave's next datagrams into the frame. 0; 1: there was no more room. */
int box_add(struct mailbox_engine *mb, uint16_t pos, mono_t now);
/** What came of one of them; @data is that of an answered one. */
void box_result(struct mailbox_engine *mb, const struct flight *flight, enum outcome outcome,
		const uint8_t *data, mono_t now);
/** @data_len bytes behind the header in writer.mail become the mail that is written next. */
void box_post(struct mailbox_engine *mb, struct box_slave *sl, uint8_t type, size_t data_len,
	      mono_t now);

#endif
