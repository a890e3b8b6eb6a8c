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
 * Which thread may touch the slot's buffers in which state:
 *   FREE      service: request       WAITING   none, until the cycle takes it
 *   TAKING    cycle: reads request   OUT       none; the service may give up (-> FREE)
 *   ANSWERING cycle: writes answer   ANSWERED  service: reads answer (-> FREE)
 */
enum ride_state { RIDE_FREE, RIDE_WAITING, RIDE_TAKING, RIDE_OUT, RIDE_ANSWERING, RIDE_ANSWERED };

/* A service frame shares the wire with the cycle: it may wait for a few cycles of the longest
 * period. */
#define RIDE_PATIENCE_NS (100 * NS_PER_MS)

#define DEFAULT_TIMEOUT_NS (2 * NS_PER_MS)

/* A late answer to one try is not taken for the next, so that later tries wait longer. */
static const unsigned char timeout_factors[LINE_TRIES] = { 1, 5, 25 };

struct frame_buffer {
	size_t len;
	uint8_t bytes[LIMIT_FRAME_BYTES];
};

struct line {
	struct platform platform;
	struct transport transport;
	struct line_waiter waiter;   /* [service] */
	span_t timeout;              /* [service] */
	void (*attend)(void *ctx);   /* [service] */
	void *attend_ctx;            /* [service] */
	int is_riding;               /* [service] */
	uint64_t thrown_away;        /* [service] */
	uint64_t answered;           /* [service] direct mode */
	struct frame_buffer in;      /* [service] direct mode */
	_Atomic int state;           /* enum ride_state */
	struct frame_buffer request; /* as the state says */
	struct frame_buffer answer;  /* as the state says */
	struct frame_buffer out;     /* [cycle] the service frame on the wire */
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
	atomic_init(&line->state, RIDE_FREE);
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

uint64_t line_answered(const struct line *line)
{
	return line->answered;
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

static int give(const struct frame_buffer *from, uint8_t *ret_answer, size_t capacity)
{
	if (from->len > capacity) {
		return -EMSGSIZE;
	}
	memcpy(ret_answer, from->bytes, from->len);
	return (int)from->len;
}

static int transact_direct(struct line *line, const uint8_t *frame, size_t frame_len,
			   uint8_t *ret_answer, size_t capacity, span_t timeout)
{
	const struct transport *tp = &line->transport;
	mono_t deadline = mono_add(now(line), timeout);
	int error = tp->send(tp->ctx, frame, frame_len);

	/* Callers repeat in loops: a NIC that is down costs the same time as a lost frame. */
	while (error >= 0) {
		mono_t at = { 0 };
		int r = tp->receive(tp->ctx, line->in.bytes, sizeof(line->in.bytes), deadline, &at);

		if (r == -EAGAIN) {
			return -ETIMEDOUT;
		}
		if (r < 0) {
			error = r;
			break;
		}
		line->in.len = (size_t)r;
		if (echo_matches(frame, line->in.bytes, line->in.len, ECHO_INDEX_SAME)) {
			line->answered++;
			return give(&line->in, ret_answer, capacity);
		}
		line->thrown_away++;
		/* A flood of unexpected frames must not delay the deadline. */
		if (at.ns >= deadline.ns) {
			return -ETIMEDOUT;
		}
	}
	line->platform.sleep_until(line->platform.ctx, deadline);
	return error;
}

static int move_state(struct line *line, int from, int to)
{
	return atomic_compare_exchange_strong_explicit(&line->state, &from, to,
						       memory_order_acq_rel, memory_order_acquire);
}

/* Withdraw the frame. 0 if the answer came at that moment. The cycle holds the slot for one memcpy.
 */
static int withdraw(struct line *line)
{
	for (;;) {
		if (move_state(line, RIDE_WAITING, RIDE_FREE) ||
		    move_state(line, RIDE_OUT, RIDE_FREE)) {
			return 1;
		}
		if (atomic_load_explicit(&line->state, memory_order_acquire) == RIDE_ANSWERED) {
			return 0;
		}
	}
}

static int transact_riding(struct line *line, const uint8_t *frame, size_t frame_len,
			   uint8_t *ret_answer, size_t capacity, span_t timeout)
{
	mono_t deadline;
	int r;

	if (timeout.ns < RIDE_PATIENCE_NS) {
		timeout.ns = RIDE_PATIENCE_NS;
	}
	deadline = mono_add(now(line), timeout);
	memcpy(line->request.bytes, frame, frame_len);
	line->request.len = frame_len;
	atomic_store_explicit(&line->state, RIDE_WAITING, memory_order_release);
	while (atomic_load_explicit(&line->state, memory_order_acquire) != RIDE_ANSWERED) {
		if (now(line).ns < deadline.ns) {
			line->waiter.wait(line->waiter.ctx, deadline);
		} else if (withdraw(line)) {
			return -ETIMEDOUT;
		}
	}
	r = give(&line->answer, ret_answer, capacity);
	atomic_store_explicit(&line->state, RIDE_FREE, memory_order_release);
	return r;
}

int line_transact(struct line *line, const uint8_t *frame, size_t frame_len, uint8_t *ret_answer,
		  size_t capacity, span_t timeout)
{
	if (frame_len > LIMIT_FRAME_BYTES || !ecat_frame_is_valid(frame, frame_len)) {
		return -EINVAL;
	}
	get_on(line);
	if (line->is_riding) {
		return transact_riding(line, frame, frame_len, ret_answer, capacity, timeout);
	}
	return transact_direct(line, frame, frame_len, ret_answer, capacity, timeout);
}

void line_sleep(struct line *line, span_t span)
{
	mono_t until = mono_add(now(line), span);

	get_on(line);
	if (!line->is_riding) {
		line->platform.sleep_until(line->platform.ctx, until);
		return;
	}
	while (now(line).ns < until.ns) {
		line->waiter.wait(line->waiter.ctx, until);
	}
}

void line_ride_begin(struct line *line, struct line_waiter waiter)
{
	assert(waiter.wait != NULL);
	line->waiter = waiter;
	line->is_riding = 1;
}

void line_ride_end(struct line *line)
{
	line->is_riding = 0;
	line->out.len = 0;
	atomic_store_explicit(&line->state, RIDE_FREE, memory_order_release);
}

const uint8_t *line_ride_take(struct line *line, size_t *ret_len)
{
	if (!move_state(line, RIDE_WAITING, RIDE_TAKING)) {
		return NULL;
	}
	memcpy(line->out.bytes, line->request.bytes, line->request.len);
	line->out.len = line->request.len;
	atomic_store_explicit(&line->state, RIDE_OUT, memory_order_release);
	*ret_len = line->out.len;
	return line->out.bytes;
}

int line_ride_answer(struct line *line, const uint8_t *frame, size_t frame_len)
{
	if (line->out.len == 0 || frame_len > sizeof(line->answer.bytes) ||
	    !echo_matches(line->out.bytes, frame, frame_len, ECHO_INDEX_SAME)) {
		return 0;
	}
	/* A duplicate, or an answer that came too late, is recognised, too, and dropped. */
	if (move_state(line, RIDE_OUT, RIDE_ANSWERING)) {
		memcpy(line->answer.bytes, frame, frame_len);
		line->answer.len = frame_len;
		atomic_store_explicit(&line->state, RIDE_ANSWERED, memory_order_release);
	}
	return 1;
}

int line_ride_is_out(const struct line *line)
{
	return atomic_load_explicit(&line->state, memory_order_relaxed) == RIDE_OUT;
}
