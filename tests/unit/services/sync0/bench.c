/* SPDX-License-Identifier: MIT */
#include "unit/services/sync0/bench.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "base/clock.h"
#include "harness/test.h"

static void on_result(void *ctx, const struct sync0_result *r)
{
	struct bench *b = ctx;

	CHECK(b->results < BENCH_RESULTS);
	b->result[b->results++] = *r;
}

static void on_event(void *ctx, const struct event *ev)
{
	struct bench *b = ctx;

	CHECK(b->events < BENCH_EVENTS);
	b->event[b->events++] = *ev;
}

static void on_deviation(void *ctx, size_t line, int64_t ns)
{
	struct bench *b = ctx;

	(void)line;
	b->deviation_squares += (double)ns * (double)ns;
	b->deviations++;
}

struct bench *bench_create(void)
{
	struct bench *b = calloc(1, sizeof(*b));

	CHECK(b != NULL);
	b->prng.state = 5;
	b->pair_noise_ns = 5000;
	b->spec = (struct checker_spec){
		.period_ns = BENCH_PERIOD_NS,
		.window_ns = 1000 * BENCH_PERIOD_NS,
		.lost_ns = 100 * BENCH_PERIOD_NS,
		.since_ns = BENCH_MONO0_NS,
		.grid = CHECKER_GRID_MASTER,
		.line_count = BENCH_LINES,
		.line = { { .slave_pos = 0 }, { .slave_pos = 3 } },
		.limits = { .drift_ppb = 200000,
			    .rate_ppb = 20000,
			    .jitter_ns = 20000,
			    .phase_ns = 100000,
			    .skew_ns = 2000 },
		.noise = { .is_known = 1, .sd_ns = 930, .p99_ns = 5200, .max_ns = 12900 },
		.result = on_result,
		.event = on_event,
		.deviation = on_deviation,
		.ctx = b,
	};
	return b;
}

void bench_start(struct bench *b)
{
	CHECK_EQ(checker_create(&b->spec, &b->checker), 0);
}

void bench_destroy(struct bench *b)
{
	checker_destroy(b->checker);
	free(b);
}

int64_t bench_mono_ns(const struct bench *b, int64_t dc_ns)
{
	int64_t since = dc_ns - BENCH_DC0_NS;

	return BENCH_MONO0_NS + since - (int64_t)((double)since * b->dc_ppm * 1e-6) +
	       b->host_step_ns;
}

static int64_t between(struct prng *prng, int64_t low, int64_t high)
{
	return low + (int64_t)prng_below(prng, (uint64_t)(high - low));
}

int64_t bench_pi_noise_ns(struct prng *prng)
{
	double u = prng_unit(prng);
	double sum = 0;

	if (u < 4e-5) {
		return between(prng, 11000, 12900);
	}
	if (u < 0.0155) {
		return between(prng, 4600, 5700);
	}
	for (int i = 0; i < 4; i++) {
		sum += prng_unit(prng);
	}
	return (int64_t)((sum - 2) * (u < 0.12 ? 190 : 59));
}

static void give_cycle(struct bench *b)
{
	int64_t due_ns = BENCH_DC0_NS + b->cycle * BENCH_PERIOD_NS;
	int64_t frame_ns = due_ns + BENCH_PERIOD_NS / 2;
	struct checker_cycle cy = {
		.cycle = b->cycle + b->number_step,
		.due_dc_ns = due_ns,
		.frame_dc_ns = frame_ns,
		.frame_mono_ns = bench_mono_ns(b, frame_ns),
		.frame_latency_ns = b->pair_noise_ns,
		.dc_diff_ns = 12,
		.is_judged = 1,
	};

	if (b->pair_noise_ns > 0) {
		cy.frame_mono_ns += between(&b->prng, -b->pair_noise_ns, b->pair_noise_ns);
	}
	checker_cycle(b->checker, &cy);
}

static void give_edge(struct bench *b, unsigned line, int64_t due_ns)
{
	double run_ns = (double)b->cycle * (double)BENCH_PERIOD_NS * -b->line_ppm[line] * 1e-6;
	int64_t dc_ns = due_ns + b->line_ns[line] + llround(run_ns);
	struct edge edge = { .mono_ns = bench_mono_ns(b, dc_ns), .line = (uint16_t)line };

	if (b->noise == BENCH_PI) {
		edge.mono_ns += bench_pi_noise_ns(&b->prng);
	}
	edge.seqno = b->seqno[line] + 1;
	switch (b->alter == NULL ? BENCH_GIVE : b->alter(b, line, b->cycle, &edge)) {
	case BENCH_NO_PULSE:
		return;
	case BENCH_DROP:
		break;
	case BENCH_GIVE:
		checker_edge(b->checker, &edge);
		break;
	}
	b->seqno[line] = edge.seqno;
}

/* The pulses that are due in this cycle: at multiples of the slave's own SYNC0 cycle. */
static void give_edges(struct bench *b, unsigned line)
{
	int64_t due_ns = BENCH_DC0_NS + b->cycle * BENCH_PERIOD_NS;
	int64_t cycle_ns = b->cycle_ns[line] > 0 ? b->cycle_ns[line] : BENCH_PERIOD_NS;

	for (int64_t at_ns = due_ns + mod_floor(-due_ns, cycle_ns);
	     at_ns < due_ns + BENCH_PERIOD_NS; at_ns += cycle_ns) {
		give_edge(b, line, at_ns);
	}
}

void bench_run(struct bench *b, int64_t cycles)
{
	for (int64_t end = b->cycle + cycles; b->cycle < end; b->cycle++) {
		for (unsigned line = 0; line < b->spec.line_count; line++) {
			give_edges(b, line);
		}
		if (b->spec.grid == CHECKER_GRID_MASTER) {
			give_cycle(b);
		}
		if (b->cycle % 10 == 0) {
			checker_advance(
				b->checker,
				bench_mono_ns(b, BENCH_DC0_NS + b->cycle * BENCH_PERIOD_NS));
		}
	}
}

unsigned bench_count(const struct bench *b, enum event_id id, struct event *ret)
{
	unsigned n = 0;

	for (unsigned i = 0; i < b->events; i++) {
		if (b->event[i].id != id) {
			continue;
		}
		if (n++ == 0 && ret != NULL) {
			*ret = b->event[i];
		}
	}
	return n;
}

uint64_t bench_missing(const struct bench *b, unsigned line)
{
	uint64_t n = 0;

	for (unsigned i = 0; i < b->results; i++) {
		n += b->result[i].line == line ? b->result[i].missing : 0;
	}
	return n;
}

uint64_t bench_extra(const struct bench *b, unsigned line)
{
	uint64_t n = 0;

	for (unsigned i = 0; i < b->results; i++) {
		n += b->result[i].line == line ? b->result[i].extra : 0;
	}
	return n;
}

void bench_show(const struct bench *b)
{
	char text[256];

	for (unsigned i = 0; i < b->events; i++) {
		event_format(&b->event[i], text, sizeof(text));
		printf("%s\n", text);
	}
}
