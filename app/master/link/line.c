/* SPDX-License-Identifier: MIT */
#include "link/line.h"

#include <assert.h>
#include <errno.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

#include "base/limits.h"
#include "wire/datagram.h"
#include "wire/echo.h"

/*
 * Which thread may touch a slot's buffers in which state:
 *   FREE      service: request              WAITING   none, until the cycle takes it
 *   TAKING    cycle: reads request          OUT       none; the service may give up (-> FREE)
 *   ANSWERING cycle: writes answer          ANSWERED  service: reads answer (-> FREE)
 *   LOST, UNSENT (withdrawn), REFUSED (error is set): service (-> FREE)
 * In direct mode the service thread is both.
 */
enum slot_state {
	SLOT_FREE,
	SLOT_WAITING,
	SLOT_TAKING,
	SLOT_OUT,
	SLOT_ANSWERING,
	SLOT_ANSWERED,
	SLOT_LOST,
	SLOT_UNSENT,
	SLOT_REFUSED,
};

/* A few cycles of the longest period: with a working cycle, a frame that is within the limit has
 * been sent by then, and answered or lost. */
#define PATIENCE_NS (100 * NS_PER_MS)
#define CANCEL_CHECK_NS (10 * NS_PER_MS)
#define DEFAULT_TIMEOUT_NS (2 * NS_PER_MS)

enum {
	FIRST_INDEX = ECAT_ETHERNET_BYTES + ECAT_FRAME_HEADER_BYTES + 1,
	SLOT_SHIFT = 7, /* the bit of the first index that says which slot */
	INDEX_MASK = 0x7f,
};

static_assert(LINE_SLOTS <= 2, "one bit of the index says which slot");

/* A late answer to one try is not taken for the next, so that later tries wait longer. */
static const unsigned char timeout_factors[LINE_TRIES] = { 1, 5, 25 };

struct frame_buffer {
	size_t len;
	uint8_t bytes[LIMIT_FRAME_BYTES];
};

struct slot {
	_Atomic int state;           /* enum slot_state */
	uint8_t index;               /* [service] the caller's first index byte */
	mono_t give_up;              /* [service] */
	struct frame_buffer request; /* as the state says */
	struct frame_buffer answer;  /* as the state says */
	int error;                   /* as the state says */
	struct frame_buffer out;     /* [cycle] the frame on the wire */
	unsigned cycles_out;         /* [cycle] */
};

struct line {
	struct platform platform;
	struct transport transport;
	struct line_waiter waiter;      /* [service] */
	span_t timeout;                 /* [service] */
	void (*attend)(void *ctx);      /* [service] */
	void *attend_ctx;               /* [service] */
	int (*is_cancelled)(void *ctx); /* [service] */
	void *cancel_ctx;               /* [service] */
	int is_riding;                  /* [service] */
	size_t frame_limit;             /* [service] */
	uint64_t thrown_away;           /* [service] */
	uint64_t answered;              /* [service] direct mode */
	uint8_t in[LIMIT_FRAME_BYTES];  /* [service] direct mode */
	_Atomic uint64_t unchanged;     /* [owner of the transport] */
	struct slot slot[LINE_SLOTS];
	int64_t credit_ns;  /* [cycle] what service frames may still use */
	struct slot *taken; /* [cycle] last */
};

static _Thread_local struct line *bound;

int line_create(struct platform platform, struct transport transport, struct line **ret_line)
{
	struct line *line = calloc(1, sizeof(*line));

	if (line == NULL) {
		return -ENOMEM;
	}
	line->platform = platform;
	line->transport = transport;
	line->timeout = (span_t){ DEFAULT_TIMEOUT_NS };
	line->frame_limit = LIMIT_FRAME_BYTES;
	for (unsigned i = 0; i < LINE_SLOTS; i++) {
		atomic_init(&line->slot[i].state, SLOT_FREE);
	}
	*ret_line = line;
	return 0;
}

void line_destroy(struct line *line)
{
	if (line == NULL) {
		return;
	}
	if (bound == line) {
		bound = NULL;
	}
	if (line->transport.destroy != NULL) {
		line->transport.destroy(line->transport.ctx);
	}
	free(line);
}

const struct platform *line_platform(const struct line *line)
{
	return &line->platform;
}

const struct transport *line_transport(const struct line *line)
{
	return &line->transport;
}

uint64_t line_discarded(const struct line *line)
{
	return line->thrown_away;
}

uint64_t line_unchanged(const struct line *line)
{
	return atomic_load_explicit(&line->unchanged, memory_order_relaxed);
}

void line_note_unchanged(struct line *line)
{
	atomic_fetch_add_explicit(&line->unchanged, 1, memory_order_relaxed);
}

uint64_t line_answered(const struct line *line)
{
	return line->answered;
}

size_t line_frame_limit(const struct line *line)
{
	return line->frame_limit;
}

void line_frame_limit_set(struct line *line, size_t frame_len)
{
	line->frame_limit = frame_len < LIMIT_FRAME_BYTES ? frame_len : LIMIT_FRAME_BYTES;
}

void line_timeout_set(struct line *line, span_t timeout)
{
	line->timeout = timeout;
}

span_t line_timeout(const struct line *line, unsigned try)
{
	assert(try < LINE_TRIES);
	return (span_t){ line->timeout.ns * timeout_factors[try] };
}

void line_set_keepalive(struct line *line, void (*attend)(void *ctx), void *ctx)
{
	line->attend = attend;
	line->attend_ctx = ctx;
}

static void get_on(const struct line *line)
{
	if (line->attend != NULL) {
		line->attend(line->attend_ctx);
	}
}

void line_set_cancel(struct line *line, int (*is_cancelled)(void *ctx), void *ctx)
{
	line->is_cancelled = is_cancelled;
	line->cancel_ctx = ctx;
}

int line_is_cancelled(const struct line *line)
{
	return line->is_cancelled != NULL && line->is_cancelled(line->cancel_ctx);
}

void line_bind(struct line *line)
{
	bound = line;
}

struct line *line_bound(void)
{
	return bound;
}

static mono_t now(const struct line *line)
{
	return line->platform.now(line->platform.ctx);
}

/* --- a slot's states --- */

static int state_of(const struct slot *slot)
{
	return atomic_load_explicit(&slot->state, memory_order_acquire);
}

static void set_state(struct slot *slot, int state)
{
	atomic_store_explicit(&slot->state, state, memory_order_release);
}

static int move_state(struct slot *slot, int from, int to)
{
	return atomic_compare_exchange_strong_explicit(&slot->state, &from, to,
						       memory_order_acq_rel, memory_order_acquire);
}

/* Put the request on the wire's side. Context: owner of the transport. */
static void take(struct slot *slot)
{
	memcpy(slot->out.bytes, slot->request.bytes, slot->request.len);
	slot->out.len = slot->request.len;
	slot->cycles_out = 0;
	set_state(slot, SLOT_OUT);
}

/* Context: owner of the transport. The service does not look at error before REFUSED. */
static void refuse(struct slot *slot, int error)
{
	slot->error = error;
	move_state(slot, SLOT_OUT, SLOT_REFUSED);
}

enum offer { OFFER_FOREIGN, OFFER_STALE, OFFER_TAKEN };

/* Context: owner of the transport. */
static enum offer offer(struct line *line, const uint8_t *frame, size_t frame_len)
{
	for (unsigned i = 0; i < LINE_SLOTS; i++) {
		struct slot *sl = &line->slot[i];

		if (sl->out.len > 0 &&
		    echo_is_unchanged(sl->out.bytes, sl->out.len, frame, frame_len)) {
			line_note_unchanged(line);
			break;
		}
		if (sl->out.len == 0 || frame_len > sizeof(sl->answer.bytes) ||
		    !echo_matches(sl->out.bytes, frame, frame_len, ECHO_INDEX_SAME)) {
			continue;
		}
		/* A duplicate, or an answer that came too late. */
		if (!move_state(sl, SLOT_OUT, SLOT_ANSWERING)) {
			return OFFER_STALE;
		}
		memcpy(sl->answer.bytes, frame, frame_len);
		sl->answer.len = frame_len;
		set_state(sl, SLOT_ANSWERED);
		return OFFER_TAKEN;
	}
	return OFFER_FOREIGN;
}

static int is_settled(const struct slot *slot)
{
	int state = state_of(slot);

	return state == SLOT_FREE || state >= SLOT_ANSWERED;
}

/* Give up on the frame, if it waits or is out. The cycle holds the slot for one memcpy. */
static void withdraw(struct slot *slot)
{
	while (!is_settled(slot)) {
		if (move_state(slot, SLOT_WAITING, SLOT_UNSENT) ||
		    move_state(slot, SLOT_OUT, SLOT_LOST)) {
			break;
		}
	}
}

/* --- service thread --- */

static int give(struct slot *slot, uint8_t *ret_answer, size_t capacity)
{
	size_t len = slot->answer.len;

	if (len > capacity) {
		return -EMSGSIZE;
	}
	memcpy(ret_answer, slot->answer.bytes, len);
	ret_answer[FIRST_INDEX] = slot->index;
	return (int)len;
}

/* What came of the frame, and the slot is free again; -EAGAIN: not yet. */
static int result_of(struct slot *slot, uint8_t *ret_answer, size_t capacity)
{
	int r;

	switch (state_of(slot)) {
	case SLOT_FREE:
		return -ENOENT;
	case SLOT_ANSWERED:
		r = give(slot, ret_answer, capacity);
		break;
	case SLOT_LOST:
		r = -ETIMEDOUT;
		break;
	case SLOT_UNSENT:
		r = -ENOBUFS;
		break;
	case SLOT_REFUSED:
		r = slot->error;
		break;
	default:
		return -EAGAIN;
	}
	set_state(slot, SLOT_FREE);
	return r;
}

int line_submit(struct line *line, enum line_slot slot, const uint8_t *frame, size_t frame_len)
{
	const struct transport *tp = &line->transport;
	struct slot *sl = &line->slot[slot];
	int r;

	if (frame_len > LIMIT_FRAME_BYTES || !ecat_frame_is_valid(frame, frame_len)) {
		return -EINVAL;
	}
	if (line->is_riding && frame_len > line->frame_limit) {
		return -EMSGSIZE;
	}
	if (state_of(sl) != SLOT_FREE) {
		return -EBUSY;
	}
	memcpy(sl->request.bytes, frame, frame_len);
	sl->request.len = frame_len;
	sl->index = frame[FIRST_INDEX];
	sl->request.bytes[FIRST_INDEX] =
		(uint8_t)((sl->index & INDEX_MASK) | (unsigned)slot << SLOT_SHIFT);
	if (line->is_riding) {
		sl->give_up = mono_add(now(line), (span_t){ PATIENCE_NS });
		set_state(sl, SLOT_WAITING);
		return 0;
	}
	sl->give_up = mono_add(now(line), line->timeout);
	take(sl);
	r = tp->send(tp->ctx, sl->out.bytes, sl->out.len);
	if (r < 0) {
		refuse(sl, r);
	}
	return 0;
}

static mono_t next_check(const struct line *line, mono_t until)
{
	mono_t check = mono_add(now(line), (span_t){ CANCEL_CHECK_NS });

	return line->is_cancelled != NULL && check.ns < until.ns ? check : until;
}

/* 0 at @until, or -ECANCELED. */
static int sleep_until(struct line *line, mono_t until)
{
	do {
		if (line_is_cancelled(line)) {
			return -ECANCELED;
		}
		if (line->is_riding) {
			line->waiter.wait(line->waiter.ctx, until);
		} else {
			line->platform.sleep_until(line->platform.ctx, next_check(line, until));
		}
	} while (now(line).ns < until.ns);
	return 0;
}

/* Direct mode: one frame, for whichever slot it is, or until @until. */
static void receive_one(struct line *line, mono_t until)
{
	const struct transport *tp = &line->transport;
	mono_t at = { 0 };
	int r = tp->receive(tp->ctx, line->in, sizeof(line->in), until, &at);

	if (r >= 0 && offer(line, line->in, (size_t)r) == OFFER_TAKEN) {
		line->answered++;
	} else if (r >= 0) {
		line->thrown_away++;
	} else if (r != -EAGAIN) {
		/* Callers repeat in loops: a NIC that fails costs the same as a lost frame. */
		line->platform.sleep_until(line->platform.ctx, until);
	}
}

/*
 * Direct mode: until the frame of @slot is answered or given up. At least one look: the answer may
 * wait in the queue of a thread that did not run. A flood of other frames does not delay the end.
 */
static void receive(struct line *line, struct slot *slot)
{
	while (state_of(slot) == SLOT_OUT && !line_is_cancelled(line)) {
		receive_one(line, next_check(line, slot->give_up));
		if (now(line).ns >= slot->give_up.ns) {
			break;
		}
	}
	if (state_of(slot) == SLOT_REFUSED) {
		sleep_until(line, slot->give_up);
	}
}

int line_collect(struct line *line, enum line_slot slot, uint8_t *ret_answer, size_t capacity)
{
	struct slot *sl = &line->slot[slot];

	if (!line->is_riding) {
		receive(line, sl);
	}
	if (now(line).ns >= sl->give_up.ns) {
		withdraw(sl);
	}
	return result_of(sl, ret_answer, capacity);
}

int line_transact(struct line *line, const uint8_t *frame, size_t frame_len, uint8_t *ret_answer,
		  size_t capacity, span_t timeout)
{
	struct slot *sl = &line->slot[LINE_SUPERVISOR];
	int r;

	get_on(line);
	if (line_is_cancelled(line)) {
		return -ECANCELED;
	}
	r = line_submit(line, LINE_SUPERVISOR, frame, frame_len);
	if (r < 0) {
		return r;
	}
	if (!line->is_riding) {
		sl->give_up = mono_add(now(line), timeout);
	}
	while ((r = line_collect(line, LINE_SUPERVISOR, ret_answer, capacity)) == -EAGAIN) {
		if (!line->is_riding || line_is_cancelled(line)) {
			withdraw(sl);
			set_state(sl, SLOT_FREE);
			return -ECANCELED;
		}
		line->waiter.wait(line->waiter.ctx, sl->give_up);
	}
	return r;
}

int line_sleep(struct line *line, span_t span)
{
	mono_t until = mono_add(now(line), span);

	get_on(line);
	return sleep_until(line, until);
}

int line_pause(struct line *line, unsigned try)
{
	return try > 0 && line->is_riding ? line_sleep(line, line_timeout(line, try - 1)) : 0;
}

void line_ride_begin(struct line *line, struct line_waiter waiter)
{
	assert(waiter.wait != NULL);
	for (unsigned i = 0; i < LINE_SLOTS; i++) {
		withdraw(&line->slot[i]);
	}
	line->waiter = waiter;
	line->credit_ns = 0;
	line->is_riding = 1;
}

void line_ride_end(struct line *line)
{
	line->is_riding = 0;
	for (unsigned i = 0; i < LINE_SLOTS; i++) {
		withdraw(&line->slot[i]);
		line->slot[i].out.len = 0;
	}
}

/* --- cycle thread --- */

void line_ride_advance(struct line *line, span_t period)
{
	int64_t share_ns = period.ns * LINE_SHARE_PERCENT / 100;
	int64_t longest_ns = ecat_wire_time_ns(LIMIT_FRAME_BYTES);

	/* What one cycle does not use is kept for a long frame in a short period, and no more. */
	line->credit_ns += share_ns;
	if (line->credit_ns > share_ns + longest_ns) {
		line->credit_ns = share_ns + longest_ns;
	}
	for (unsigned i = 0; i < LINE_SLOTS; i++) {
		struct slot *sl = &line->slot[i];

		if (state_of(sl) == SLOT_OUT && ++sl->cycles_out >= LINE_LOST_CYCLES) {
			move_state(sl, SLOT_OUT, SLOT_LOST);
		}
	}
}

const uint8_t *line_ride_take(struct line *line, span_t room, size_t *ret_len)
{
	for (unsigned i = 0; i < LINE_SLOTS; i++) {
		struct slot *sl = &line->slot[i];
		int64_t need_ns;

		if (!move_state(sl, SLOT_WAITING, SLOT_TAKING)) {
			continue;
		}
		need_ns = ecat_wire_time_ns(sl->request.len);
		if (need_ns > room.ns || need_ns > line->credit_ns) {
			/* The next slot must not use up what this one waits for. */
			set_state(sl, SLOT_WAITING);
			return NULL;
		}
		line->credit_ns -= need_ns;
		line->taken = sl;
		take(sl);
		*ret_len = sl->out.len;
		return sl->out.bytes;
	}
	return NULL;
}

void line_ride_refused(struct line *line, int error)
{
	refuse(line->taken, error);
}

int line_ride_answer(struct line *line, const uint8_t *frame, size_t frame_len)
{
	return offer(line, frame, frame_len) != OFFER_FOREIGN;
}

int line_ride_is_out(const struct line *line)
{
	for (unsigned i = 0; i < LINE_SLOTS; i++) {
		if (atomic_load_explicit(&line->slot[i].state, memory_order_relaxed) == SLOT_OUT) {
			return 1;
		}
	}
	return 0;
}
