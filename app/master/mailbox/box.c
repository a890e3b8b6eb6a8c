/* SPDX-License-Identifier: MIT */
/*
 * The two boxes of one slave. Each pass puts at most one datagram of the reader and one of the
 * writer into the frame; what came of them moves the two state machines. A datagram that was lost
 * or not sent is sent again: all of them can be, see the strokes in mailbox.h.
 */
#include <string.h>

#include "mailbox/mailbox_internal.h"
#include "wire/esc_reg.h"

enum {
	SM_STATUS = 5, /* 0x0805, 0x080D */
	SM_ACTIVATE = 6,
	SM_PDI_CONTROL = 7,
	STATUS_FULL = 0x08,
	ACTIVATE_REPEAT = 0x02,
	HEAD_BYTES = 48, /* read first: nearly all answers fit */
	DRAIN_MAX = 16,
	DATAGRAM_BYTES = ECAT_DATAGRAM_HEADER_BYTES + ECAT_WKC_BYTES,
	FRAME_BYTES = ECAT_ETHERNET_BYTES + ECAT_FRAME_HEADER_BYTES,
};

/* While an answer is awaited: each pass at first, then every millisecond. After a mail that has no
 * answer of its own (an EoE fragment): every millisecond for as long. */
#define FRESH_NS (20 * NS_PER_MS)
#define AWAIT_NS NS_PER_MS
/* While none is: emergencies and EoE frames may come at any time. */
#define IDLE_FIRST_NS (10 * NS_PER_MS)
#define IDLE_LAST_NS (100 * NS_PER_MS)
#define REFUSED_LAST_NS (2 * NS_PER_MS)
#define REPEAT_NS NS_PER_S
/* No newer state in cyclic frames for so long: polled again; sooner while an answer is awaited. */
#define HINT_NS (20 * NS_PER_MS)
#define HINT_AWAIT_NS (4 * NS_PER_MS)

static uint16_t sm_register(unsigned sm, unsigned offset)
{
	return (uint16_t)(ESC_REG_SM + sm * ESC_SM_BYTES + offset);
}

void box_reset(struct mailbox_engine *mb, struct box_slave *sl, mono_t now)
{
	uint8_t counter = sl->writer.counter;
	struct box_reader *rd = &sl->reader;

	/* The counter goes on: a slave that still knows the last mail must not take the next for
	 * it. */
	sl->writer = (struct box_writer){ .counter = counter, .serial = ++mb->serial };
	sl->reader = (struct box_reader){ .hint_sent = rd->hint_sent,
					  .is_counting = 1,
					  .poll_at = now,
					  .idle = { IDLE_FIRST_NS },
					  .serial = ++mb->serial };
	sl->drain = DRAIN_MAX;
	sl->farewell_len = 0;
}

/* --- the frame --- */

static size_t room(const struct mailbox_engine *mb, size_t used)
{
	return mb->frame_limit > used + DATAGRAM_BYTES ? mb->frame_limit - used - DATAGRAM_BYTES
						       : 0;
}

/* Where the data goes; NULL: no room. */
static uint8_t *add(struct mailbox_engine *mb, const struct flight *flight, enum ecat_cmd cmd,
		    uint16_t station, uint16_t reg)
{
	uint8_t *data;

	if (mb->flight_count == FLIGHTS || room(mb, mb->fb.len) < flight->len) {
		return NULL;
	}
	data = ecat_frame_add(&mb->fb, cmd, mb->sequence, station, reg, flight->len);
	if (data != NULL) {
		mb->flight[mb->flight_count++] = *flight;
	}
	return data;
}

/* As much of @left bytes as a frame of its own could carry. */
static uint16_t stroke(const struct mailbox_engine *mb, size_t left)
{
	size_t most = room(mb, FRAME_BYTES);

	return (uint16_t)(left < most ? left : most);
}

/* --- reader --- */

static int is_hinted(const struct box_slave *sl, mono_t now)
{
	int64_t limit_ns = sl->awaited > 0 ? HINT_AWAIT_NS : HINT_NS;

	return sl->reader.hint_sent.ns != 0 && mono_sub(now, sl->reader.hint_sent).ns < limit_ns;
}

static int is_poll_due(const struct box_slave *sl, mono_t now)
{
	if (is_hinted(sl, now) && sl->drain == 0) {
		return 0;
	}
	return now.ns >= sl->reader.poll_at.ns;
}

static void begin_read(struct box_reader *rd)
{
	rd->is_full_hint = 0;
	rd->step = READER_READ;
	rd->pos = 0;
	rd->is_taken = 0;
	rd->is_tail_lost = 0;
}

static size_t mail_len(const struct box_reader *rd)
{
	return MAILBOX_HEADER_BYTES + (size_t)mailbox_header_get(rd->mail).data_len;
}

/* Where the next stroke of reading begins, and its length. */
static uint16_t next_read(const struct mailbox_engine *mb, struct box_slave *sl, size_t *ret_at)
{
	struct box_reader *rd = &sl->reader;
	size_t last = sl->spec.in_bytes - 1u;

	if (rd->is_taken) {
		*ret_at = last;
		return 1;
	}
	*ret_at = rd->pos;
	if (rd->pos == 0) {
		return stroke(mb, last < HEAD_BYTES ? last : HEAD_BYTES);
	}
	return stroke(mb, sl->spec.in_bytes - rd->pos);
}

static int add_reader(struct mailbox_engine *mb, uint16_t pos, mono_t now)
{
	struct box_slave *sl = mb->slave[pos];
	struct box_reader *rd = &sl->reader;
	struct flight fl = { .slave_pos = pos, .len = 1, .serial = rd->serial };
	uint16_t station = sl->spec.station_addr;
	uint8_t *data;
	size_t at = 0;

	if (rd->step == READER_IDLE && rd->is_full_hint && sl->drain == 0) {
		begin_read(rd);
	}
	switch (rd->step) {
	case READER_IDLE:
		if (!is_poll_due(sl, now)) {
			return 0;
		}
		fl.kind = FLIGHT_POLL;
		if (add(mb, &fl, ECAT_CMD_FPRD, station, sm_register(1, SM_STATUS)) == NULL) {
			return 1;
		}
		sl->counters.polls++;
		return 0;
	case READER_READ:
		fl.kind = FLIGHT_READ;
		fl.len = next_read(mb, sl, &at);
		return add(mb, &fl, ECAT_CMD_FPRD, station, (uint16_t)(sl->spec.in_start + at)) ==
		       NULL;
	case READER_LOOK:
		fl.kind = FLIGHT_LOOK;
		return add(mb, &fl, ECAT_CMD_FPRD, station, sm_register(1, SM_ACTIVATE)) == NULL;
	case READER_ASK:
		fl.kind = FLIGHT_ASK;
		data = add(mb, &fl, ECAT_CMD_FPWR, station, sm_register(1, SM_ACTIVATE));
		if (data != NULL) {
			*data = rd->activate;
		}
		return data == NULL;
	case READER_REPEAT:
		fl.kind = FLIGHT_REPEAT;
		fl.len = 3; /* status, activation, PDI control */
		return add(mb, &fl, ECAT_CMD_FPRD, station, sm_register(1, SM_STATUS)) == NULL;
	}
	return 0;
}

/* FNV-1a. */
static uint64_t hash_of(const uint8_t *mail, size_t len)
{
	uint64_t hash = 0xcbf29ce484222325u;

	for (size_t i = 0; i < len; i++) {
		hash = (hash ^ mail[i]) * 0x100000001b3u;
	}
	return hash;
}

/* A mail that came before, byte for byte and with its counter. Slaves that do not count are left
 * alone. */
static int is_seen(struct box_reader *rd, uint8_t counter, size_t len)
{
	uint64_t hash = hash_of(rd->mail, len);
	int is_same = rd->has_mail && counter != 0 && counter == rd->counter;
	int is_equal = is_same && hash == rd->hash;

	if (is_same && !is_equal) {
		rd->is_counting = 0;
	}
	rd->has_mail = 1;
	rd->counter = counter;
	rd->hash = hash;
	return is_equal && rd->is_counting;
}

/*
 * A lost frame took a mail out of the box, and the slave has put another one in since: that mail is
 * gone, its counter is missing.
 */
static int is_gap(const struct box_reader *rd, uint8_t counter)
{
	return (rd->is_tail_lost || rd->is_repeated) && rd->is_counting && rd->has_mail &&
	       counter != 0 && counter != rd->counter &&
	       counter != mailbox_counter_next(rd->counter);
}

static void take_mail(struct mailbox_engine *mb, uint16_t pos, mono_t now)
{
	struct box_slave *sl = mb->slave[pos];
	struct box_reader *rd = &sl->reader;
	struct mailbox_header header = mailbox_header_get(rd->mail);
	size_t len = mail_len(rd);

	rd->is_taken = 1;
	rd->poll_at = now;
	rd->idle = (span_t){ IDLE_FIRST_NS };
	sl->counters.received++;
	if (is_gap(rd, header.counter)) {
		sl->counters.lost++;
		mb->hooks.gap(mb, pos);
	} else {
		sl->counters.recovered += rd->is_repeated;
	}
	rd->is_repeated = 0;
	if (len > sl->spec.in_bytes) {
		sl->counters.malformed++;
		mb->hooks.malformed(mb, pos, header.type);
		return;
	}
	if (is_seen(rd, header.counter, len)) {
		sl->counters.repeated++;
		return;
	}
	if (sl->drain > 0) {
		sl->drain--;
		sl->counters.dropped++;
		return;
	}
	mb->hooks.received(mb, pos, &header, rd->mail + MAILBOX_HEADER_BYTES, now);
}

static void read_done(struct mailbox_engine *mb, uint16_t pos, const struct flight *fl,
		      const uint8_t *data, mono_t now)
{
	struct box_slave *sl = mb->slave[pos];
	struct box_reader *rd = &sl->reader;
	uint32_t serial = rd->serial;
	int is_end;

	if (rd->is_taken) { /* the last byte of the box: it is free */
		rd->step = READER_IDLE;
		rd->emptied_at = now;
		return;
	}
	memcpy(rd->mail + rd->pos, data, fl->len);
	rd->pos += fl->len;
	is_end = rd->pos == sl->spec.in_bytes;
	if (rd->pos < MAILBOX_HEADER_BYTES) {
		return;
	}
	if (is_end || mail_len(rd) <= rd->pos || mail_len(rd) > sl->spec.in_bytes) {
		take_mail(mb, pos, now);
	}
	if (is_end && rd->serial == serial) {
		rd->step = READER_IDLE;
		rd->emptied_at = now;
	}
}

/* The box is empty, but not by this datagram. */
static void read_denied(struct box_slave *sl, mono_t now)
{
	struct box_reader *rd = &sl->reader;

	if (!rd->is_tail_lost || rd->is_taken) {
		rd->step = READER_IDLE;
		return;
	}
	/* A lost frame has emptied it: the slave still has the mail. */
	rd->step = READER_LOOK;
	rd->repeat_until = mono_add(now, (span_t){ REPEAT_NS });
}

static void read_lost(struct box_slave *sl, const struct flight *fl)
{
	struct box_reader *rd = &sl->reader;

	if (rd->is_taken || rd->pos + fl->len == sl->spec.in_bytes) {
		rd->is_tail_lost = 1;
	}
}

/* Most answers come soon. */
static int is_fresh(const struct box_slave *sl, mono_t now)
{
	return mono_sub(now, sl->sent_at).ns < FRESH_NS;
}

static void poll_done(struct box_slave *sl, uint8_t status, mono_t now)
{
	struct box_reader *rd = &sl->reader;

	if (status & STATUS_FULL) {
		begin_read(rd);
		return;
	}
	sl->drain = 0;
	if (sl->awaited > 0 || is_fresh(sl, now)) {
		int is_each_pass = sl->awaited > 0 && is_fresh(sl, now);

		rd->poll_at = mono_add(now, (span_t){ is_each_pass ? 0 : AWAIT_NS });
		return;
	}
	rd->poll_at = mono_add(now, rd->idle);
	rd->idle.ns = rd->idle.ns * 2 < IDLE_LAST_NS ? rd->idle.ns * 2 : IDLE_LAST_NS;
}

static void repeat_done(struct box_slave *sl, const uint8_t *data, mono_t now)
{
	struct box_reader *rd = &sl->reader;
	uint8_t acknowledged = data[2];

	if (data[0] & STATUS_FULL) {
		begin_read(rd);
		rd->is_repeated = 1;
	} else if (!((acknowledged ^ rd->activate) & ACTIVATE_REPEAT) ||
		   now.ns >= rd->repeat_until.ns) {
		rd->step = READER_IDLE; /* it has nothing to repeat, or does not know how */
	}
}

static void reader_result(struct mailbox_engine *mb, const struct flight *fl, enum outcome outcome,
			  const uint8_t *data, mono_t now)
{
	struct box_slave *sl = mb->slave[fl->slave_pos];
	struct box_reader *rd = &sl->reader;

	if (outcome == OUTCOME_DENIED) {
		if (fl->kind == FLIGHT_READ) {
			read_denied(sl, now);
		} else {
			rd->step = READER_IDLE;
			rd->poll_at = mono_add(now, (span_t){ IDLE_FIRST_NS });
		}
		return;
	}
	if (outcome != OUTCOME_DONE) {
		if (fl->kind == FLIGHT_READ && outcome == OUTCOME_LOST) {
			read_lost(sl, fl);
		}
		return;
	}
	switch ((enum flight_kind)fl->kind) {
	case FLIGHT_POLL:
		poll_done(sl, data[0], now);
		return;
	case FLIGHT_READ:
		read_done(mb, fl->slave_pos, fl, data, now);
		return;
	case FLIGHT_LOOK:
		rd->activate = data[0] ^ ACTIVATE_REPEAT;
		rd->step = READER_ASK;
		return;
	case FLIGHT_ASK:
		rd->step = READER_REPEAT;
		return;
	case FLIGHT_REPEAT:
		repeat_done(sl, data, now);
		return;
	case FLIGHT_FILL:
	case FLIGHT_COMMIT:
		return;
	}
}

/* --- writer --- */

void box_post(struct mailbox_engine *mb, struct box_slave *sl, uint8_t type, size_t data_len,
	      mono_t now)
{
	struct box_writer *wr = &sl->writer;
	size_t len = MAILBOX_HEADER_BYTES + data_len;
	size_t last = sl->spec.out_bytes - 1u;

	wr->counter = mailbox_counter_next(wr->counter);
	mailbox_header_put(wr->mail, &(struct mailbox_header){ .data_len = (uint16_t)data_len,
							       .type = type,
							       .counter = wr->counter });
	/* What lies behind the mail is not sent; but the last byte of the box is. */
	wr->fill_len = len < last ? len : last;
	if (len <= last) {
		wr->mail[last] = 0;
	}
	wr->pos = 0;
	wr->refusals = 0;
	wr->not_before = now;
	wr->step = WRITER_FILL;
	wr->serial = ++mb->serial;
}

static int add_writer(struct mailbox_engine *mb, uint16_t pos, mono_t now)
{
	struct box_slave *sl = mb->slave[pos];
	struct box_writer *wr = &sl->writer;
	struct flight fl = { .slave_pos = pos, .len = 1 };
	size_t at = sl->spec.out_bytes - 1u;
	uint8_t *data;

	if (wr->step != WRITER_IDLE && wr->owner == NULL && now.ns >= wr->give_up.ns) {
		wr->step = WRITER_IDLE;
	}
	if (wr->step == WRITER_IDLE && sl->drain == 0) {
		mb->hooks.feed(mb, pos, now);
	}
	if (wr->step == WRITER_IDLE || now.ns < wr->not_before.ns) {
		return 0;
	}
	fl.serial = wr->serial;
	fl.kind = FLIGHT_COMMIT;
	if (wr->step == WRITER_FILL) {
		fl.kind = FLIGHT_FILL;
		at = wr->pos;
		fl.len = stroke(mb, wr->fill_len - wr->pos);
	}
	data = add(mb, &fl, ECAT_CMD_FPWR, sl->spec.station_addr,
		   (uint16_t)(sl->spec.out_start + at));
	if (data == NULL) {
		return 1;
	}
	memcpy(data, wr->mail + at, fl.len);
	return 0;
}

/* The box still has the last mail, or the slave does not answer. */
static void fill_denied(struct box_writer *wr, mono_t now)
{
	int64_t pause_ns = (int64_t)20000 << (wr->refusals < 10 ? wr->refusals : 10);

	wr->pos = 0;
	wr->refusals++;
	wr->not_before =
		mono_add(now, (span_t){ pause_ns < REFUSED_LAST_NS ? pause_ns : REFUSED_LAST_NS });
}

static void writer_result(struct mailbox_engine *mb, const struct flight *fl, enum outcome outcome,
			  mono_t now)
{
	struct box_writer *wr = &mb->slave[fl->slave_pos]->writer;

	if (outcome == OUTCOME_LOST || outcome == OUTCOME_UNSENT) {
		return;
	}
	if (fl->kind == FLIGHT_COMMIT) {
		/* Denied: a lost frame has done it before. Should the slave have reset its box
		 * instead, the answer will not come; written again the mail might count twice. */
		wr->step = WRITER_IDLE;
		mb->slave[fl->slave_pos]->sent_at = now;
		mb->slave[fl->slave_pos]->reader.poll_at = now;
		mb->hooks.sent(mb, fl->slave_pos, now);
		return;
	}
	if (outcome == OUTCOME_DENIED) {
		fill_denied(wr, now);
		return;
	}
	wr->pos += fl->len;
	if (wr->pos == wr->fill_len) {
		wr->step = WRITER_COMMIT;
	}
}

/* --- both --- */

int box_add(struct mailbox_engine *mb, uint16_t pos, mono_t now)
{
	return add_reader(mb, pos, now) || add_writer(mb, pos, now);
}

void box_result(struct mailbox_engine *mb, const struct flight *flight, enum outcome outcome,
		const uint8_t *data, mono_t now)
{
	const struct box_slave *sl = mb->slave[flight->slave_pos];
	int is_writers = flight->kind == FLIGHT_FILL || flight->kind == FLIGHT_COMMIT;

	if (flight->serial != (is_writers ? sl->writer.serial : sl->reader.serial) ||
	    (is_writers && sl->writer.step == WRITER_IDLE)) {
		return; /* the boxes were set anew, or the mail was withdrawn, meanwhile */
	}
	if (is_writers) {
		writer_result(mb, flight, outcome, now);
	} else {
		reader_result(mb, flight, outcome, data, now);
	}
}
