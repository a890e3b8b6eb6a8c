/* SPDX-License-Identifier: MIT */
#include "bus/exchange.h"

#include <assert.h>
#include <errno.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

#include "base/bytes.h"
#include "base/slave_set.h"
#include "bus/exchange_dc.h"
#include "bus/exchange_frame.h"
#include "wire/datagram.h"
#include "wire/echo.h"

enum {
	PATH_WINDOW = 64, /* exchanges over which the shortest path is taken */
	HISTORY = 256, /* exchanges whose frames are kept, to tell a late frame from a duplicate */
	DC_DIFF_MAGNITUDE = 0x7fffffff,
};

static_assert(LIMIT_FRAMES <= 64, "a bit per frame in history[]");

/*
 * How long a frame's end is behind its start, but for its own length: wires, slaves, NIC. The
 * shortest of a window is not shorter than the way itself, and what the host adds to the others
 * does not keep the wire busy.
 */
struct path_time {
	int64_t ns; /* of the last window; of the first one so far, before it is full */
	int64_t shortest_ns;
	unsigned count;
	int has_window;
};

struct exchange {
	struct exchange_plan plan;
	struct line *line;
	struct transport transport;
	struct platform platform;
	unsigned frame_count;
	uint16_t sequence; /* of the exchange that runs or ran last */
	uint64_t run_count;
	uint64_t missing;          /* bit per frame of this exchange that is not back */
	uint64_t history[HISTORY]; /* by sequence: bit per frame that came back */
	struct dc_track dc;
	_Atomic int is_reference_doubted;                 /* [cycle] */
	_Atomic int is_reference_confirmed;               /* [service] sets, [cycle] takes */
	_Atomic uint64_t mailbox_word[LIMIT_SLAVES / 64]; /* [cycle] */
	_Atomic int64_t mailbox_sent_ns;                  /* [cycle] after the words; 0: none yet */
	_Atomic uint16_t chunk_seen[LIMIT_CHUNKS];        /* [cycle] working counters */
	_Atomic uint16_t seen[EXCHANGE_SEEN_KINDS];       /* [cycle] the same */
	struct path_time path;
	int64_t wire_ns;               /* of its frames */
	struct exchange_result result; /* result being built; keeps the counts of a ride for the
					  next one */
	struct exchange_frame *frame;  /* frame_count of them */
	uint8_t inputs[LIMIT_IMAGE_BYTES];
	uint8_t received[LIMIT_FRAME_BYTES];
};

static int plan_is_sound(const struct exchange_plan *plan)
{
	uint64_t sum = 0;
	unsigned last = 0;

	if (plan->chunk_count > LIMIT_CHUNKS || exchange_frame_count(plan) > LIMIT_FRAMES ||
	    plan->image_bytes > LIMIT_IMAGE_BYTES || plan->output_bytes > plan->image_bytes) {
		return 0;
	}
	for (unsigned i = 0; i < plan->chunk_count; i++) {
		/* Frames are filled in order, none is left out. */
		if (plan->chunk_bytes[i] == 0 || plan->chunk_frame[i] < last ||
		    plan->chunk_frame[i] > last + (i > 0)) {
			return 0;
		}
		last = plan->chunk_frame[i];
		sum += plan->chunk_bytes[i];
	}
	return sum == plan->image_bytes;
}

int exchange_create(const struct exchange_plan *plan, struct line *line,
		    struct exchange **ret_exchange)
{
	struct exchange *ex;

	if (!plan_is_sound(plan)) {
		return -EINVAL;
	}
	ex = calloc(1, sizeof(*ex));
	if (ex == NULL) {
		return -ENOMEM;
	}
	ex->plan = *plan;
	ex->line = line;
	ex->transport = *line_transport(line);
	ex->platform = *line_platform(line);
	for (unsigned i = 0; i < LIMIT_CHUNKS; i++) {
		atomic_init(&ex->chunk_seen[i], UINT16_MAX);
	}
	for (unsigned i = 0; i < EXCHANGE_SEEN_KINDS; i++) {
		atomic_init(&ex->seen[i], UINT16_MAX);
	}
	ex->frame_count = exchange_frame_count(plan);
	ex->frame = calloc(ex->frame_count, sizeof(ex->frame[0]));
	if (ex->frame == NULL) {
		free(ex);
		return -ENOMEM;
	}
	for (unsigned i = 0; i < ex->frame_count; i++) {
		int r = exchange_frame_build(plan, i, &ex->frame[i]);

		if (r < 0) {
			exchange_destroy(ex);
			return r;
		}
		ex->wire_ns += ecat_wire_time_ns(ex->frame[i].len);
	}
	*ret_exchange = ex;
	return 0;
}

void exchange_destroy(struct exchange *ex)
{
	if (ex != NULL) {
		free(ex->frame);
	}
	free(ex);
}

static mono_t now(const struct exchange *ex)
{
	return ex->platform.now(ex->platform.ctx);
}

/* --- out --- */

static void load_outputs(struct exchange *ex, struct exchange_frame *ef, const uint8_t *image)
{
	for (unsigned i = 0; i < ef->part_count; i++) {
		const struct exchange_part *part = &ef->part[i];
		uint32_t left = ex->plan.output_bytes - part->offset;

		if (part->offset < ex->plan.output_bytes) {
			memcpy(exchange_data(ef->bytes, part->at), image + part->offset,
			       left < part->len ? left : part->len);
		}
	}
}

static void load_dc(struct exchange *ex, struct exchange_frame *ef, mono_t at)
{
	int64_t payload_ns;

	ef->bytes[ef->dc] = dc_track_command(&ex->dc, at, &payload_ns);
	put_le64(exchange_data(ef->bytes, ef->dc), (uint64_t)payload_ns);
}

/* Send all frames. Returns how many went out. */
static unsigned send_frames(struct exchange *ex, const uint8_t *image)
{
	unsigned sent_count = 0;

	ex->missing = 0;
	for (unsigned i = 0; i < ex->frame_count; i++) {
		struct exchange_frame *ef = &ex->frame[i];
		int r;

		exchange_frame_number(ef, ex->sequence);
		load_outputs(ex, ef, image);
		if (i == 0) {
			ex->result.sent = now(ex);
		}
		if (ef->dc != 0) {
			load_dc(ex, ef, ex->result.sent);
		}
		ex->missing |= UINT64_C(1) << i;
		r = ex->transport.send(ex->transport.ctx, ef->bytes, ef->len);
		if (r < 0) {
			ex->result.send_error = r;
		} else {
			sent_count++;
		}
	}
	return sent_count;
}

/* --- back --- */

static void note_wkc(struct exchange *ex, enum exchange_seen which, size_t datagram)
{
	if (datagram != 0) {
		atomic_store_explicit(&ex->seen[which], exchange_wkc(ex->received, datagram),
				      memory_order_relaxed);
	}
}

uint16_t exchange_wkc_seen(const struct exchange *ex, enum exchange_seen which, unsigned chunk)
{
	if (which == EXCHANGE_SEEN_CHUNK) {
		return chunk < LIMIT_CHUNKS
			       ? atomic_load_explicit(&ex->chunk_seen[chunk], memory_order_relaxed)
			       : UINT16_MAX;
	}
	return atomic_load_explicit(&ex->seen[which], memory_order_relaxed);
}

static void keep_inputs(struct exchange *ex, const struct exchange_part *part)
{
	uint16_t wkc = exchange_wkc(ex->received, part->at);
	uint32_t skip = 0;

	atomic_store_explicit(&ex->chunk_seen[part->chunk], wkc, memory_order_relaxed);
	ex->result.wkc = (uint16_t)(ex->result.wkc + wkc);
	if (wkc != ex->plan.chunk_wkc[part->chunk]) {
		ex->result.status = EXCHANGE_WKC_LOW;
		slave_set_or(&ex->result.slaves_low, &ex->plan.chunk_slaves[part->chunk]);
		return;
	}
	if (part->offset < ex->plan.output_bytes) {
		skip = ex->plan.output_bytes - part->offset;
	}
	if (skip < part->len) {
		memcpy(ex->inputs + part->offset + skip,
		       exchange_data(ex->received, part->at) + skip, part->len - skip);
	}
}

static void keep_monitor(struct exchange *ex, const struct exchange_frame *ef)
{
	struct exchange_result *res = &ex->result;

	res->al_wkc = exchange_wkc(ex->received, ef->al);
	res->al_status = get_le16(exchange_data(ex->received, ef->al));
	if (exchange_wkc(ex->received, ef->diff) > 0) {
		res->dc_diff_ns =
			get_le32(exchange_data(ex->received, ef->diff)) & DC_DIFF_MAGNITUDE;
	}
}

/* Only whole: a slave whose FMMU was lost would seem to have no mail. */
static void keep_mailboxes(struct exchange *ex, const struct exchange_frame *ef)
{
	const uint8_t *data = exchange_data(ex->received, ef->mailboxes);
	uint32_t bytes = exchange_mailbox_bytes(&ex->plan);

	if (exchange_wkc(ex->received, ef->mailboxes) != ex->plan.mailbox_bits) {
		return;
	}
	for (uint32_t at = 0; at < bytes; at += 8) {
		uint8_t word[8] = { 0 };

		memcpy(word, data + at, bytes - at < 8 ? bytes - at : 8);
		atomic_store_explicit(&ex->mailbox_word[at / 8], get_le64(word),
				      memory_order_relaxed);
	}
	atomic_store_explicit(&ex->mailbox_sent_ns, ex->result.sent.ns, memory_order_release);
}

int exchange_mailboxes(const struct exchange *ex, struct exchange_mailboxes *ret)
{
	ret->sent.ns = atomic_load_explicit(&ex->mailbox_sent_ns, memory_order_acquire);
	for (size_t i = 0; i < LIMIT_SLAVES / 64; i++) {
		ret->word[i] = atomic_load_explicit(&ex->mailbox_word[i], memory_order_relaxed);
	}
	return ret->sent.ns != 0;
}

int exchange_doubts_reference(const struct exchange *ex)
{
	return atomic_load_explicit(&ex->is_reference_doubted, memory_order_acquire);
}

void exchange_confirm_reference(struct exchange *ex)
{
	atomic_store_explicit(&ex->is_reference_confirmed, 1, memory_order_release);
}

static void keep_dc_time(struct exchange *ex, const struct exchange_frame *ef)
{
	if (dc_track_is_doubted(&ex->dc)) {
		ex->dc.is_confirmed = atomic_exchange_explicit(&ex->is_reference_confirmed, 0,
							       memory_order_acquire);
	}
	ex->result.dc_time_ns = dc_track_answer(
		&ex->dc, ef->bytes[ef->dc], exchange_wkc(ex->received, ef->dc),
		(int64_t)get_le64(exchange_data(ex->received, ef->dc)), ex->result.sent);
	atomic_store_explicit(&ex->is_reference_doubted, dc_track_is_doubted(&ex->dc),
			      memory_order_release);
}

static void keep_frame(struct exchange *ex, unsigned number)
{
	const struct exchange_frame *ef = &ex->frame[number];

	for (unsigned i = 0; i < ef->part_count; i++) {
		keep_inputs(ex, &ef->part[i]);
	}
	note_wkc(ex, EXCHANGE_SEEN_DC, ef->dc);
	note_wkc(ex, EXCHANGE_SEEN_AL, ef->al);
	note_wkc(ex, EXCHANGE_SEEN_DIFF, ef->diff);
	note_wkc(ex, EXCHANGE_SEEN_MAILBOXES, ef->mailboxes);
	if (ef->dc != 0) {
		keep_dc_time(ex, ef);
	}
	if (ef->al != 0) {
		keep_monitor(ex, ef);
	}
	if (ef->mailboxes != 0) {
		keep_mailboxes(ex, ef);
	}
}

static void measure_path(struct path_time *path, int64_t ns)
{
	ns = ns > 0 ? ns : 0;
	if (path->count == 0 || ns < path->shortest_ns) {
		path->shortest_ns = ns;
	}
	path->count++;
	if (path->count == PATH_WINDOW || !path->has_window) {
		path->ns = path->shortest_ns;
	}
	if (path->count == PATH_WINDOW) {
		path->count = 0;
		path->has_window = 1;
	}
}

/* A frame of this exchange or an earlier one, by its sequence. 1 if it was waited for. */
static int sort_frame(struct exchange *ex, unsigned number, uint16_t sequence, mono_t at)
{
	unsigned age = (uint16_t)(ex->sequence - sequence);
	uint64_t *came = &ex->history[sequence % HISTORY];
	uint64_t bit = UINT64_C(1) << number;

	if (age >= ex->run_count) {
		ex->result.foreign++;
		return 0;
	}
	if (age < HISTORY && (*came & bit) != 0) {
		ex->result.doubled++;
		return 0;
	}
	if (age < HISTORY) {
		*came |= bit;
	}
	/* Outside exchange_run() no frame is pending: one that comes then is late by at least one
	 * cycle. */
	if (age == 0 && (ex->missing & bit) != 0) {
		ex->missing &= ~bit;
		keep_frame(ex, number);
		if (ex->missing == 0) {
			ex->result.round_trip = mono_sub(at, ex->result.sent);
			measure_path(&ex->path, ex->result.round_trip.ns - ex->wire_ns);
		}
		return 1;
	}
	ex->result.late++;
	if (age == 0) {
		age = 1;
	}
	if (age > ex->result.late_by) {
		ex->result.late_by = age;
	}
	return 0;
}

/* 1 if the frame was expected, 0 if not. */
static int take_frame(struct exchange *ex, size_t len, mono_t at)
{
	/* They come back in order: the first that is missing is the most likely one. */
	unsigned first = ex->missing != 0 ? (unsigned)__builtin_ctzll(ex->missing) : 0;

	for (unsigned n = 0; n < ex->frame_count; n++) {
		unsigned i = first + n < ex->frame_count ? first + n : first + n - ex->frame_count;
		uint16_t sequence;

		if (exchange_frame_matches(&ex->frame[i], ex->received, len, &sequence)) {
			return sort_frame(ex, i, sequence, at);
		}
		if (echo_is_unchanged(ex->frame[i].bytes, ex->frame[i].len, ex->received, len)) {
			line_note_unchanged(ex->line);
		}
	}
	if (!line_ride_answer(ex->line, ex->received, len)) {
		ex->result.foreign++;
	}
	return 0;
}

/*
 * The transport hands out what waits in its queue even past the deadline: a frame that waited
 * there while this thread did not run is not lost. So an unexpected frame must end the wait, or a
 * flood of them would block the cycle for ever.
 */
static int receive_one(struct exchange *ex, mono_t deadline)
{
	mono_t at = { 0 };
	int r = ex->transport.receive(ex->transport.ctx, ex->received, sizeof(ex->received),
				      deadline, &at);

	if (r < 0) {
		return r;
	}
	return take_frame(ex, (size_t)r, at) || at.ns < deadline.ns ? 0 : -EAGAIN;
}

/* Counts of a ride or an earlier receive are kept; the rest is reset. */
static void begin_result(struct exchange *ex)
{
	ex->result = (struct exchange_result){
		.status = EXCHANGE_OK,
		.wkc_expected = ex->plan.wkc_expected,
		.dc_diff_ns = -1,
		.round_trip = { -1 },
		.late = ex->result.late,
		.late_by = ex->result.late_by,
		.doubled = ex->result.doubled,
		.foreign = ex->result.foreign,
	};
	ex->sequence++;
	ex->run_count++;
	ex->history[ex->sequence % HISTORY] = 0;
}

static struct exchange_result end_result(struct exchange *ex)
{
	struct exchange_result res = ex->result;

	ex->missing = 0;
	ex->result.late = 0;
	ex->result.late_by = 0;
	ex->result.doubled = 0;
	ex->result.foreign = 0;
	return res;
}

struct exchange_result exchange_run(struct exchange *ex, uint8_t *image, mono_t deadline)
{
	uint32_t output_bytes = ex->plan.output_bytes;

	begin_result(ex);
	if (send_frames(ex, image) == 0) {
		deadline = ex->result.sent;
	}
	while (ex->missing != 0) {
		if (receive_one(ex, deadline) < 0) {
			ex->result.status = EXCHANGE_NO_FRAME;
			break;
		}
	}
	/* A chunk that is not good leaves in ex->inputs what it had last. */
	if (ex->result.status == EXCHANGE_OK ||
	    (ex->result.status == EXCHANGE_WKC_LOW && ex->plan.is_split)) {
		memcpy(image + output_bytes, ex->inputs + output_bytes,
		       ex->plan.image_bytes - output_bytes);
	}
	return end_result(ex);
}

/* Service frames that are off the wire before the cycle's next ones. */
static unsigned send_service_frames(struct exchange *ex, const struct exchange_window *window)
{
	unsigned count = 0;
	mono_t back_at = mono_add(now(ex), (span_t){ ex->path.ns });
	const uint8_t *frame;
	size_t len;

	while ((frame = line_ride_take(ex->line, mono_sub(window->wire_needed, back_at), &len)) !=
	       NULL) {
		int r = ex->transport.send(ex->transport.ctx, frame, len);

		if (r < 0) {
			line_ride_refused(ex->line, r);
		}
		back_at = mono_add(back_at, (span_t){ ecat_wire_time_ns(len) });
		count++;
	}
	return count;
}

unsigned exchange_ride(struct exchange *ex, const struct exchange_window *window)
{
	unsigned count;

	line_ride_advance(ex->line, window->period);
	count = send_service_frames(ex, window);
	while (line_ride_is_out(ex->line)) {
		if (receive_one(ex, window->listen_until) < 0) {
			break;
		}
	}
	return count;
}
