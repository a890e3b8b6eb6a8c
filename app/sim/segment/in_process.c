/* SPDX-License-Identifier: MIT */
#include "segment/in_process.h"

#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/limits.h"
#include "base/prng.h"

enum { IN_FLIGHT_MAX = 64, /* as a word has bits */ NS_A_BYTE = 80, PREAMBLE_AND_GAP_BYTES = 24 };

struct flight {
	mono_t arrives;
	uint64_t order;
	size_t len;
	uint8_t bytes[LIMIT_FRAME_BYTES];
};

struct in_process {
	struct in_process_spec spec;
	struct prng prng;
	mono_t now;
	int64_t stall_ns;
	int64_t tai_step_ns;
	uint64_t sent;
	uint64_t used; /* bit n: flight n is one */
	struct flight flight[IN_FLIGHT_MAX];
};

int in_process_create(const struct in_process_spec *spec, struct in_process **ret)
{
	struct in_process *ip = calloc(1, sizeof(*ip));

	if (ip == NULL) {
		return -ENOMEM;
	}
	ip->spec = *spec;
	ip->prng.state = spec->seed;
	ip->now.ns = NS_PER_S; /* a monotonic clock does not start at 0 */
	*ret = ip;
	return 0;
}

void in_process_destroy(struct in_process *ip)
{
	free(ip);
}

int64_t in_process_true_ns(const struct in_process *ip, mono_t now)
{
	return now.ns + (int64_t)((double)now.ns * ip->spec.host_ppm * 1e-6);
}

static mono_t host_time(const struct in_process *ip, int64_t true_ns)
{
	double rate = ip->spec.host_ppm * 1e-6;
	mono_t guess = { true_ns - (int64_t)((double)true_ns * (rate / (1.0 + rate))) };

	/* The inverse, to the ns: the host sees a thing when its clock is past it. */
	while (in_process_true_ns(ip, (mono_t){ guess.ns - 1 }) >= true_ns) {
		guess.ns--;
	}
	while (in_process_true_ns(ip, guess) < true_ns) {
		guess.ns++;
	}
	return guess;
}

static mono_t ip_now(void *ctx)
{
	return ((struct in_process *)ctx)->now;
}

static int64_t ip_tai_ns(void *ctx)
{
	const struct in_process *ip = ctx;

	return ip->spec.tai_start_ns + ip->tai_step_ns + ip->now.ns;
}

static int64_t wake_latency_ns(struct in_process *ip)
{
	const struct in_process_spec *s = &ip->spec;
	double u = 1.0 - prng_unit(&ip->prng);
	double v = prng_unit(&ip->prng);
	double normal = sqrt(-2.0 * log(u)) * cos(6.283185307179586 * v);
	int64_t ns = (int64_t)fabs(normal * (double)s->wake_sigma_ns);

	if (s->wake_spike_ns > 0 && prng_below(&ip->prng, 1000000) < s->spikes_per_million) {
		ns += (int64_t)prng_below(&ip->prng, (uint64_t)s->wake_spike_ns);
	}
	return ns;
}

static int ip_sleep_until(void *ctx, mono_t deadline)
{
	struct in_process *ip = ctx;

	if (deadline.ns > ip->now.ns) {
		ip->now = deadline;
	}
	ip->now.ns += wake_latency_ns(ip) + ip->stall_ns;
	ip->stall_ns = 0;
	segment_advance(ip->spec.segment, in_process_true_ns(ip, ip->now));
	return 0;
}

static void put_in_flight(struct in_process *ip, const uint8_t *frame, size_t len, mono_t arrives)
{
	struct flight *f;
	unsigned i;

	if (ip->used == UINT64_MAX) {
		return; /* a wire holds no more: it is lost */
	}
	i = (unsigned)__builtin_ctzll(~ip->used);
	ip->used |= UINT64_C(1) << i;
	f = &ip->flight[i];
	f->arrives = arrives;
	f->order = ip->sent;
	f->len = len;
	memcpy(f->bytes, frame, len);
}

/* What was held back comes with the next frame. */
static void release_held(struct in_process *ip)
{
	for (uint64_t left = ip->used; left != 0; left &= left - 1) {
		struct flight *f = &ip->flight[__builtin_ctzll(left)];

		if (f->arrives.ns == INT64_MAX) {
			f->arrives = ip->now;
		}
	}
}

static int ip_send(void *ctx, const uint8_t *frame, size_t frame_len)
{
	struct in_process *ip = ctx;
	struct fault_verdict v = { .is_dropped = 0 };
	uint8_t copy[LIMIT_FRAME_BYTES];
	int64_t out_ns = in_process_true_ns(ip, ip->now) + ip->spec.transmit_ns;
	int64_t back_ns;
	mono_t arrives;

	if (frame_len > sizeof(copy)) {
		return -EMSGSIZE;
	}
	memcpy(copy, frame, frame_len);
	ip->sent++;
	if (ip->spec.faults != NULL) {
		release_held(ip);
		v = fault_plan_judge(ip->spec.faults, ip->spec.segment, out_ns, frame_len);
	}
	out_ns += v.transit_ns;
	back_ns = out_ns;
	if (v.is_dropped) {
		return 0;
	}
	if (!v.is_mirrored &&
	    segment_frame(ip->spec.segment, out_ns, copy, frame_len, &back_ns) < 0) {
		return 0;
	}
	if (v.is_lost) {
		return 0;
	}
	if (v.corrupt_at > 0) {
		copy[v.corrupt_at] ^= v.corrupt_xor;
	}
	back_ns += (int64_t)(frame_len + PREAMBLE_AND_GAP_BYTES) * NS_A_BYTE + ip->spec.transmit_ns;
	arrives = v.is_held ? (mono_t){ INT64_MAX } : host_time(ip, back_ns + v.delay_ns);
	put_in_flight(ip, copy, v.truncate_to > 0 ? v.truncate_to : frame_len, arrives);
	if (v.is_doubled && !v.is_held) {
		put_in_flight(ip, copy, frame_len, mono_add(arrives, (span_t){ 10000 }));
	}
	return 0;
}

static struct flight *next_arrival(struct in_process *ip)
{
	struct flight *best = NULL;

	for (uint64_t left = ip->used; left != 0; left &= left - 1) {
		struct flight *f = &ip->flight[__builtin_ctzll(left)];

		if (best == NULL || f->arrives.ns < best->arrives.ns ||
		    (f->arrives.ns == best->arrives.ns && f->order < best->order)) {
			best = f;
		}
	}
	return best;
}

static int ip_receive(void *ctx, uint8_t *frame, size_t capacity, mono_t deadline, mono_t *ret_at)
{
	struct in_process *ip = ctx;
	struct flight *f = next_arrival(ip);
	size_t len;

	if (f == NULL || f->arrives.ns > (deadline.ns > ip->now.ns ? deadline.ns : ip->now.ns)) {
		if (deadline.ns > ip->now.ns) {
			ip->now = deadline;
		}
		return -EAGAIN;
	}
	if (f->arrives.ns > ip->now.ns) {
		ip->now = f->arrives;
	}
	len = f->len < capacity ? f->len : capacity;
	memcpy(frame, f->bytes, len);
	ip->used &= ~(UINT64_C(1) << (f - ip->flight));
	if (ret_at != NULL) {
		*ret_at = ip->now;
	}
	return (int)len;
}

static int ip_is_up(void *ctx)
{
	return segment_is_up(((struct in_process *)ctx)->spec.segment, SEGMENT_PRIMARY);
}

static void ip_destroy(void *ctx)
{
	(void)ctx;
}

struct platform in_process_platform(struct in_process *ip)
{
	return (struct platform){
		.now = ip_now, .tai_ns = ip_tai_ns, .sleep_until = ip_sleep_until, .ctx = ip
	};
}

struct transport in_process_transport(struct in_process *ip)
{
	return (struct transport){ .send = ip_send,
				   .receive = ip_receive,
				   .is_up = ip_is_up,
				   .destroy = ip_destroy,
				   .ctx = ip };
}

void in_process_step_tai(struct in_process *ip, int64_t step_ns)
{
	ip->tai_step_ns += step_ns;
}

void in_process_stall(struct in_process *ip, int64_t late_ns)
{
	ip->stall_ns += late_ns;
}

unsigned in_process_in_flight(const struct in_process *ip)
{
	return (unsigned)__builtin_popcountll(ip->used);
}
