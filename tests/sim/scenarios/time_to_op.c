/* SPDX-License-Identifier: MIT */
/*
 * Where the time from power-on to OP goes, and what must hold from OP on however short it was:
 * SYNC0 of all slaves together. Frames tell the stages apart; the time is virtual.
 */
#include <string.h>

#include "base/bytes.h"
#include "base/clock.h"
#include "base/prng.h"
#include "harness/test.h"
#include "sim/harness/virtual_master.h"
#include "wire/al.h"
#include "wire/datagram.h"
#include "wire/esc_reg.h"

enum stage {
	STAGE_SCAN,   /* which devices there are */
	STAGE_SII,    /* their EEPROMs, mailboxes, PRE-OP, mapping */
	STAGE_CLOCKS, /* delays and offsets */
	STAGE_BURST,  /* static drift compensation */
	STAGE_LOCK,   /* the cycle runs: lock, and clocks that agree */
	STAGE_SYNC0,  /* programmed, started, verified */
	STAGE_SAFEOP,
	STAGE_OP,
	STAGES
};

static const char *const names[STAGES] = { "scan", "SII",   "clocks", "burst",
					   "lock", "SYNC0", "SAFEOP", "OP" };

enum {
	NEAR_FRAMES = 500, /* of the burst in a row */
	AGREE_CYCLES = 95, /* 20 looks, 5 ms apart */
	MEASURE_CYCLES = 1000,
	DIFF_MAGNITUDE = 0x7fffffff,
	BURST_MOST = 15000, /* dc.burst_frames */
};

#define DIFF_LIMIT_NS NS_PER_US /* dc.diff_limit */
#define NEAR_NS (DIFF_LIMIT_NS / 16)
/* As much as before the burst ended by measurement. */
#define SPREAD_LIMIT_NS 20

struct timeline {
	int64_t begin_ns;
	int64_t at_ns[STAGES]; /* when it began; 0: not yet */
	unsigned burst_frames;
	unsigned frames;    /* before the cycle */
	unsigned near;      /* frames of the burst in a row, up to now */
	unsigned near_then; /* when the slaves were asked one by one */
	unsigned agreeing;  /* cycles in a row, up to now */
	int64_t start_ns[LIMIT_SLAVES];
	unsigned started;
};

static void begin(struct timeline *tl, enum stage stage, int64_t now_ns)
{
	if (tl->at_ns[stage] == 0) {
		tl->at_ns[stage] = now_ns;
	}
}

/* The differences of all slaves ORed, as the frame brought them. */
static void take_differences(struct timeline *tl, const struct ecat_datagram *dg)
{
	int64_t most_ns = get_le32(dg->data) & DIFF_MAGNITUDE;

	tl->near = most_ns <= NEAR_NS ? tl->near + 1 : 0;
	tl->agreeing =
		tl->at_ns[STAGE_LOCK] != 0 && most_ns <= DIFF_LIMIT_NS ? tl->agreeing + 1 : 0;
}

/* SYNC0 is started only with a lock and clocks that agree, and in the future. */
static void take_start(struct virtual_master *vm, const struct ecat_datagram *dg)
{
	struct timeline *tl = vm->user;
	unsigned slave = dg->adp - 0x1001u;

	CHECK(slave < vm->bench->spec.slaves);
	if (dg->ado == ESC_REG_DC_START_TIME) {
		tl->start_ns[slave] = (int64_t)get_le64(dg->data);
	} else if (dg->data[0] != 0) {
		const struct esc *esc = segment_esc(vm->bench->segment, slave);
		int64_t now_ns = virtual_bench_now_ns(vm->bench);

		CHECK(tl->start_ns[slave] > (int64_t)esc_system_time(esc, now_ns));
		CHECK_EQ(atomic_load(&session_page(vm->session)->cycle.dc_state), DC_LOCKED);
		CHECK(tl->agreeing >= AGREE_CYCLES);
		tl->started++;
	}
}

static void take_request(struct timeline *tl, uint16_t state, int64_t now_ns)
{
	if (state == AL_SAFEOP) {
		begin(tl, STAGE_SAFEOP, now_ns);
	} else if (state == AL_OP) {
		begin(tl, STAGE_OP, now_ns);
	}
}

static void take_write(struct virtual_master *vm, const struct ecat_datagram *dg)
{
	struct timeline *tl = vm->user;
	int64_t now_ns = virtual_bench_now_ns(vm->bench);

	switch (dg->ado) {
	case ESC_REG_DC_START_TIME:
		begin(tl, STAGE_SYNC0, now_ns);
		take_start(vm, dg);
		break;
	case ESC_REG_DC_ACTIVATION:
		take_start(vm, dg);
		break;
	case ESC_REG_AL_CONTROL:
		take_request(tl, get_le16(dg->data), now_ns);
		break;
	default:
		break;
	}
}

static void take_datagram(struct virtual_master *vm, const struct ecat_datagram *dg)
{
	struct timeline *tl = vm->user;
	int64_t now_ns = virtual_bench_now_ns(vm->bench);

	if (dg->ado == ESC_REG_EEPROM_CONTROL) {
		begin(tl, STAGE_SII, now_ns);
	} else if (dg->cmd == ECAT_CMD_BWR && dg->ado == ESC_REG_DC_RECEIVE_TIME_PORT) {
		begin(tl, STAGE_CLOCKS, now_ns);
	} else if (dg->cmd == ECAT_CMD_FRMW && tl->at_ns[STAGE_LOCK] == 0) {
		begin(tl, STAGE_BURST, now_ns);
		tl->burst_frames++;
	} else if (dg->cmd == ECAT_CMD_BRD && dg->ado == ESC_REG_DC_SYSTEM_TIME_DIFF) {
		take_differences(tl, dg);
	} else if (dg->cmd == ECAT_CMD_FPRD && dg->ado == ESC_REG_DC_SYSTEM_TIME_DIFF &&
		   tl->near_then == 0) {
		tl->near_then = tl->near;
	} else if (dg->cmd == ECAT_CMD_FPWR) {
		take_write(vm, dg);
	}
}

static void take_frame(struct virtual_master *vm, const uint8_t *frame, size_t frame_len)
{
	struct timeline *tl = vm->user;
	uint8_t copy[LIMIT_FRAME_BYTES];
	struct ecat_datagram dg;
	size_t pos = 0;

	memcpy(copy, frame, frame_len);
	if (vm->cycle != NULL) {
		begin(tl, STAGE_LOCK, virtual_bench_now_ns(vm->bench));
	} else {
		tl->frames++;
	}
	while (ecat_frame_next(copy, frame_len, &pos, &dg) == 1) {
		take_datagram(vm, &dg);
	}
}

static double ms(int64_t ns)
{
	return (double)ns / 1e6;
}

static void print_timeline(const struct timeline *tl, unsigned slaves, int64_t op_ns)
{
	int64_t end_ns = tl->begin_ns + op_ns;

	printf("%2u slaves, ms:", slaves);
	for (unsigned i = 0; i < STAGES; i++) {
		int64_t next_ns = i + 1 < STAGES ? tl->at_ns[i + 1] : end_ns;

		printf(" %s %.1f,", names[i], ms(next_ns - tl->at_ns[i]));
	}
	printf(" all %.1f; %u frames before the cycle, %u of them of the burst\n", ms(op_ns),
	       tl->frames, tl->burst_frames);
}

static double random_ppm(struct prng *prng)
{
	return prng_unit(prng) * 200 - 100;
}

static struct virtual_bench b;
static struct virtual_master vm;
static struct timeline tl;

/* What makes a start hard: crystals, and a host that wakes late. */
enum host { HOST_CALM, HOST_BUSY };

static int start(unsigned slaves, uint64_t seed, enum host host, const char *const *settings)
{
	struct prng prng = { seed };
	struct virtual_spec spec = { .slaves = slaves, .seed = seed };

	for (unsigned i = 0; i < slaves; i++) {
		spec.ppm[i] = random_ppm(&prng);
	}
	spec.host_ppm = random_ppm(&prng);
	if (host == HOST_BUSY) {
		spec.wake_sigma_ns = 20 * NS_PER_US;
		spec.wake_spike_ns = 300 * NS_PER_US;
		spec.spikes_per_million = 5000;
	}
	virtual_bench_init(&b, &spec);
	virtual_master_init(&vm, &b, settings);
	tl = (struct timeline){ .begin_ns = virtual_bench_now_ns(&b) };
	tl.at_ns[STAGE_SCAN] = tl.begin_ns;
	vm.each_frame = take_frame;
	vm.user = &tl;
	return virtual_master_bring_up(&vm);
}

static void must_start(unsigned slaves, uint64_t seed, enum host host)
{
	if (start(slaves, seed, host, NULL) < 0) {
		test_fail(__FILE__, __LINE__, "%u slaves, seed %llu: %s", slaves,
			  (unsigned long long)seed, vm.failure.text);
	}
}

/* Virtual time says the same each time: these are no timings of a machine. */
TEST(time_to_op, is_short_with_2_16_and_64_slaves)
{
	static const struct {
		unsigned slaves;
		int64_t most_ns;
	} goals[] = { { 2, 500 * NS_PER_MS }, { 16, 550 * NS_PER_MS }, { 64, 850 * NS_PER_MS } };

	for (size_t n = 0; n < sizeof(goals) / sizeof(goals[0]); n++) {
		must_start(goals[n].slaves, 77 + n, HOST_CALM);
		print_timeline(&tl, goals[n].slaves, vm.op_ns);
		CHECK(vm.op_ns <= goals[n].most_ns);
		virtual_master_close(&vm);
	}
}

/* From OP on, and not after it has settled. */
static int64_t worst_spread_ns(unsigned slaves, uint64_t seeds, enum host host)
{
	int64_t worst_ns = 0;

	for (uint64_t seed = 1; seed <= seeds; seed++) {
		must_start(slaves, seed, host);
		CHECK(tl.near_then >= NEAR_FRAMES || tl.burst_frames > BURST_MOST);
		CHECK(tl.started >= slaves);
		virtual_bench_measure(&b);
		CHECK_EQ(virtual_master_run(&vm, MEASURE_CYCLES), SESSION_GOES_ON);
		CHECK(b.scope.compared >= MEASURE_CYCLES / 2);
		if (b.scope.spread_max_ns > worst_ns) {
			worst_ns = b.scope.spread_max_ns;
		}
		virtual_master_close(&vm);
	}
	printf("%2u slaves, %llu starts, %s host: SYNC0 apart %lld ns\n", slaves,
	       (unsigned long long)seeds, host == HOST_BUSY ? "busy" : "calm", (long long)worst_ns);
	return worst_ns;
}

TEST(time_to_op, sync0_is_together_from_op_on_with_any_crystals)
{
	CHECK(worst_spread_ns(2, 60, HOST_CALM) <= SPREAD_LIMIT_NS);
	CHECK(worst_spread_ns(16, 8, HOST_CALM) <= SPREAD_LIMIT_NS);
	CHECK(worst_spread_ns(64, 4, HOST_CALM) <= SPREAD_LIMIT_NS);
}

TEST(time_to_op, sync0_is_together_from_op_on_with_a_host_that_wakes_late)
{
	CHECK(worst_spread_ns(2, 60, HOST_BUSY) <= SPREAD_LIMIT_NS);
	CHECK(worst_spread_ns(16, 8, HOST_BUSY) <= SPREAD_LIMIT_NS);
	CHECK(worst_spread_ns(64, 4, HOST_BUSY) <= SPREAD_LIMIT_NS);
}

TEST(time_to_op, a_burst_has_at_most_its_frames_where_clocks_do_not_come_near)
{
	/* Nothing is near a limit of 10 ns, and the burst ends with its last frame. */
	static const char *const settings[] = { "dc.diff_limit=10ns", "dc.burst_frames=3000",
						NULL };
	static const char *const few[] = { "dc.burst_frames=100", NULL };

	start(16, 5, HOST_CALM, settings);
	CHECK(tl.burst_frames >= 3000);
	CHECK_EQ((tl.burst_frames - 3000) % NEAR_FRAMES, 0);
	virtual_master_close(&vm);

	start(2, 5, HOST_CALM, few);
	CHECK(tl.burst_frames >= 100 + NEAR_FRAMES);
	CHECK_EQ((tl.burst_frames - 100) % NEAR_FRAMES, 0);
	virtual_master_close(&vm);
}

/* take_start() counts the cycles in which the clocks agreed. */
TEST(time_to_op, clocks_are_watched_for_95_ms_however_soon_the_lock_is_there)
{
	static const char *const settings[] = { "dc.lock_cycles=5", NULL };

	for (uint64_t seed = 1; seed <= 5; seed++) {
		CHECK_EQ(start(2, seed, HOST_CALM, settings), 0);
		CHECK_EQ(tl.started, 2);
		virtual_master_close(&vm);
	}
}
