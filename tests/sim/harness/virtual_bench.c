/* SPDX-License-Identifier: MIT */
#include "sim/harness/virtual_bench.h"

#include "base/bytes.h"
#include "base/prng.h"
#include "devices/catalogue.h"
#include "devices/fb1111_piccolo.h"
#include "harness/test.h"
#include "wire/datagram.h"
#include "wire/esc_reg.h"

enum {
	DEFAULT_SLAVES = 2,
	TRANSMIT_NS = 4000, /* through the host's NIC, one way */
	DEFAULT_SIGMA_NS = 3000,
	DEFAULT_PERIOD_NS = 1000000,
};

static int64_t slot_of(const struct virtual_scope *sc, int64_t system_time_ns)
{
	return (system_time_ns + sc->period_ns / 2) / sc->period_ns;
}

/* With the edges of other slaves in its slot, of which the first and the last are enough. */
static void compare(struct virtual_scope *sc, const struct virtual_slot *with, int64_t t_ns)
{
	int64_t before_ns = t_ns - with->first_ns;
	int64_t after_ns = with->last_ns - t_ns;
	int64_t spread_ns = before_ns > after_ns ? before_ns : after_ns;

	sc->compared += with->slaves;
	if (spread_ns > sc->spread_max_ns) {
		sc->spread_max_ns = spread_ns;
	}
}

static void take_edge(struct virtual_scope *sc, int64_t slot, int64_t t_ns)
{
	struct virtual_slot *s = &sc->newest[slot % VIRTUAL_EDGES];

	if (s->slot != slot) {
		*s = (struct virtual_slot){ .slot = slot, .first_ns = t_ns, .last_ns = t_ns };
	} else if (sc->is_measuring && s->slaves > 0) {
		compare(sc, s, t_ns);
	}
	s->first_ns = t_ns < s->first_ns ? t_ns : s->first_ns;
	s->last_ns = t_ns > s->last_ns ? t_ns : s->last_ns;
	s->slaves++;
}

static void on_edge(void *ctx, unsigned slave, int64_t t_ns, uint64_t system_time_ns)
{
	struct virtual_bench *b = ctx;
	struct virtual_scope *sc = &b->scope;
	int64_t slot = slot_of(sc, (int64_t)system_time_ns);
	int64_t *past_slot = &sc->past_slot[slave][slot % VIRTUAL_EDGES];

	if (b->each_edge != NULL) {
		b->each_edge(b->user, slave, t_ns, system_time_ns);
	}
	sc->edge_ns[slave] = t_ns;
	sc->system_ns[slave] = system_time_ns;
	sc->edges[slave]++;
	/* A slave that has two edges in one slot is not compared with itself. */
	if (*past_slot != slot) {
		take_edge(sc, slot, t_ns);
	}
	*past_slot = slot;
	sc->past_ns[slave][slot % VIRTUAL_EDGES] = t_ns;
}

int virtual_bench_slave(const char *name, int position, struct segment_slave_spec *ret_spec)
{
	static struct slave_model model; /* large */

	CHECK_EQ(catalogue_find(name, &model), 0);
	return catalogue_slave(&model, position, ret_spec);
}

static void make_segment(struct virtual_bench *b)
{
	static struct segment_slave_spec slaves[LIMIT_SLAVES];
	struct prng prng = { b->spec.seed ^ UINT64_C(0x5e9) };
	virtual_slave_maker make = b->spec.make != NULL ? b->spec.make : fb1111_piccolo_slave;

	for (unsigned n = 0; n < b->spec.slaves; n++) {
		CHECK_EQ(make((int)n, &slaves[n]), 0);
		slaves[n].ppm = b->spec.ppm[n];
		slaves[n].clock_start_ns = prng_below(&prng, UINT64_C(1) << 52);
	}
	CHECK_EQ(segment_create(slaves, b->spec.slaves, 0, &b->segment), 0);
	segment_sync0_to(b->segment, on_edge, b);
}

void virtual_bench_init(struct virtual_bench *bench, const struct virtual_spec *spec)
{
	struct in_process_spec host = {
		.seed = spec->seed,
		.host_ppm = spec->host_ppm,
		.tai_start_ns = spec->tai_start_ns,
		.wake_sigma_ns = spec->wake_sigma_ns,
		.wake_spike_ns = spec->wake_spike_ns,
		.spikes_per_million = spec->spikes_per_million,
		.transmit_ns = TRANSMIT_NS,
	};

	memset(bench, 0, sizeof(*bench));
	bench->spec = *spec;
	if (bench->spec.slaves == 0) {
		bench->spec.slaves = DEFAULT_SLAVES;
	}
	if (spec->tai_start_ns <= 0) {
		host.tai_start_ns = spec->tai_start_ns == 0 ? VIRTUAL_TAI_START_NS : 0;
	}
	if (spec->wake_sigma_ns <= 0) {
		host.wake_sigma_ns = spec->wake_sigma_ns == 0 ? DEFAULT_SIGMA_NS : 0;
	}
	bench->scope.period_ns = DEFAULT_PERIOD_NS;
	make_segment(bench);
	bench->faults = fault_plan_create(spec->seed, 0);
	CHECK(bench->faults != NULL);
	host.segment = bench->segment;
	host.faults = bench->faults;
	CHECK_EQ(in_process_create(&host, &bench->host), 0);
}

void virtual_bench_done(struct virtual_bench *bench)
{
	in_process_destroy(bench->host);
	fault_plan_destroy(bench->faults);
	segment_destroy(bench->segment);
}

int64_t virtual_bench_now_ns(const struct virtual_bench *bench)
{
	struct platform pf = in_process_platform(bench->host);

	return in_process_true_ns(bench->host, pf.now(pf.ctx));
}

void virtual_bench_fault(struct virtual_bench *bench, const char *line)
{
	char error[256] = "";

	fault_plan_restart(bench->faults, virtual_bench_now_ns(bench));
	if (fault_plan_add(bench->faults, line, bench->spec.slaves, error, sizeof(error)) < 0) {
		test_fail(__FILE__, __LINE__, "fault \"%s\": %s", line, error);
	}
}

int64_t virtual_bench_edge_ns(const struct virtual_bench *bench, unsigned slave, int64_t dc_time_ns)
{
	const struct virtual_scope *sc = &bench->scope;
	int64_t slot = slot_of(sc, dc_time_ns);

	return sc->past_slot[slave][slot % VIRTUAL_EDGES] == slot
		       ? sc->past_ns[slave][slot % VIRTUAL_EDGES]
		       : 0;
}

void virtual_bench_write(struct virtual_bench *bench, uint16_t station, uint16_t address,
			 uint8_t value)
{
	static const uint8_t source[6] = { 0x10 };
	uint8_t frame[ECAT_FRAME_MAX_BYTES];
	struct ecat_frame_builder fb;
	uint8_t *data;
	int64_t back_ns;

	ecat_frame_begin(&fb, frame, source);
	data = ecat_frame_add(&fb, ECAT_CMD_FPWR, 0, station, address, 1);
	CHECK(data != NULL);
	*data = value;
	CHECK_EQ(segment_frame(bench->segment, virtual_bench_now_ns(bench), frame,
			       ecat_frame_end(&fb), &back_ns),
		 0);
}

unsigned virtual_bench_al_status(const struct virtual_bench *bench, unsigned slave)
{
	return get_le16(segment_esc(bench->segment, slave)->reg + ESC_REG_AL_STATUS);
}

void virtual_bench_measure(struct virtual_bench *bench)
{
	bench->scope.spread_max_ns = 0;
	bench->scope.compared = 0;
	bench->scope.is_measuring = 1;
}
