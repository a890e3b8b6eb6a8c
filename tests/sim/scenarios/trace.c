/* SPDX-License-Identifier: MIT */
/*
 * All that can be observed of a seeded run is the same to the last byte as it was when these hashes
 * were printed: frames of the master and back with their times, SYNC0 edges with theirs, what the
 * applications did at their PDIs and when, memory and state of each slave controller, the samples.
 * So a change that is to make the simulator faster is seen to change nothing else. A change that
 * is meant to change one of these (of the model, of the frames that the master sends) takes the
 * hashes that the failing test prints.
 */
#include "base/prng.h"
#include "devices/catalogue.h"
#include "devices/fb1111_piccolo.h"
#include "devices/plant.h"
#include "devices/wago_750_354.h"
#include "harness/test.h"
#include "segment/esc_internal.h"
#include "sim/harness/virtual_master.h"
#include "wire/esc_reg.h"

enum { CALM_CYCLES = 200, PEACE_CYCLES = 800, STEP_CYCLES = 12, WHOLE_EACH = 64, PPM_MAX = 80 };

#define HASH_START UINT64_C(0xcbf29ce484222325)
#define HASH_PRIME UINT64_C(0x100000001b3)

/* One hash for each kind, so that a difference says where it is. */
enum kind { FRAMES, EDGES, APPLICATIONS, CONTROLLERS, SAMPLES, KINDS };

static const char *const kinds[KINDS] = { "frames", "edges", "applications", "controllers",
					  "samples" };

struct trace {
	struct virtual_bench b;
	struct virtual_master vm;
	struct prng prng;
	uint64_t hash[KINDS];
	uint64_t frames;
	uint64_t edges;
	uint64_t cycles;
	int (*make)(int position, struct segment_slave_spec *ret_spec);
};

static struct trace tr;

static void add(enum kind kind, uint64_t value)
{
	tr.hash[kind] = (tr.hash[kind] ^ value) * HASH_PRIME;
	tr.hash[kind] ^= tr.hash[kind] >> 29;
}

static void add_bytes(enum kind kind, const uint8_t *bytes, size_t len)
{
	uint64_t word;

	for (; len >= sizeof(word); len -= sizeof(word), bytes += sizeof(word)) {
		memcpy(&word, bytes, sizeof(word));
		add(kind, word);
	}
	for (; len > 0; len--, bytes++) {
		add(kind, *bytes);
	}
}

/* --- what is observed --- */

static void add_frame(struct virtual_master *vm, const uint8_t *frame, size_t frame_len)
{
	add(FRAMES, (uint64_t)virtual_bench_now_ns(vm->bench));
	add(FRAMES, frame_len);
	add_bytes(FRAMES, frame, frame_len);
	tr.frames++;
}

static void add_edge(void *user, unsigned slave, int64_t t_ns, uint64_t system_time_ns)
{
	(void)user;
	add(EDGES, slave);
	add(EDGES, (uint64_t)t_ns);
	add(EDGES, system_time_ns);
	tr.edges++;
}

static void add_sync_managers(const struct esc *esc)
{
	for (unsigned n = 0; n < esc->features.sm_count; n++) {
		const struct esc_sm *sm = &esc->sm[n];

		add(CONTROLLERS, sm->completed);
		add(CONTROLLERS, (uint64_t)sm->is_full << 32 | (uint64_t)sm->is_reader_open << 24 |
					 (uint64_t)sm->is_writer_open << 16 | sm->newest);
	}
}

/* Registers that are made when they are read (AL and ECAT events, DL status, the clock's) are left
 * out: what they are made of is not. */
static void add_memory(struct esc *esc)
{
	esc_sm_to_registers(esc, ESC_REG_SM, ESC_LIMIT_SM * ESC_SM_BYTES);
	add_bytes(CONTROLLERS, esc->reg + ESC_REG_DL_STATUS + 2,
		  ESC_REG_ECAT_EVENT_REQUEST - ESC_REG_DL_STATUS - 2);
	add_bytes(CONTROLLERS, esc->reg + ESC_REG_RX_ERROR_COUNTER,
		  ESC_REG_DC_SYSTEM_TIME - ESC_REG_RX_ERROR_COUNTER);
	add_bytes(CONTROLLERS, esc->reg + ESC_REG_USER_RAM, sizeof(esc->reg) - ESC_REG_USER_RAM);
	add_bytes(CONTROLLERS, esc->ram, sizeof(esc->ram));
}

static void add_controller(struct esc *esc, int64_t now_ns)
{
	add(CONTROLLERS, (uint64_t)esc->al_event << 32 | esc->ecat_event);
	add(CONTROLLERS, esc_system_time(esc, now_ns));
	add(CONTROLLERS, (uint64_t)esc->clock.rate);
	add(CONTROLLERS, (uint64_t)esc->clock.speed_diff);
	add(CONTROLLERS, esc->sync.next_local_ns);
	add(CONTROLLERS, (uint64_t)esc->sync.next_true_ns);
	add(CONTROLLERS, esc->sync.edges);
	add(CONTROLLERS, (uint64_t)esc->watchdog_deadline_ns);
	add(CONTROLLERS, (uint64_t)esc->eeprom_busy_until_ns);
	add_sync_managers(esc);
	if (tr.cycles % WHOLE_EACH == 0) {
		add_memory(esc);
	}
}

/* The PDI's watchdog starts with each access, so it has the time of the last one. */
static void add_application(struct segment *segment, unsigned slave)
{
	const struct sim_device *dev = segment_device(segment, slave);
	char text[256] = "";

	add(APPLICATIONS, (uint64_t)segment_esc(segment, slave)->pdi_watchdog_deadline_ns);
	if (dev == NULL) {
		return;
	}
	if (tr.make == fb1111_piccolo_slave) {
		add(APPLICATIONS, (uint64_t)fb1111_piccolo_copy_ns(dev));
	}
	if (dev->ops->io_get != NULL) {
		dev->ops->io_get(dev, text, sizeof(text));
		add_bytes(APPLICATIONS, (const uint8_t *)text, strlen(text));
	}
	add(APPLICATIONS, (uint64_t)dev->ops->next_wake_ns(dev));
}

static void add_cycle(struct virtual_master *vm)
{
	int64_t now_ns = virtual_bench_now_ns(vm->bench);

	tr.cycles++;
	for (unsigned i = 0; i < vm->bench->spec.slaves; i++) {
		add_controller(segment_esc(vm->bench->segment, i), now_ns);
		add_application(vm->bench->segment, i);
	}
}

/* --- the runs --- */

static void open_run(unsigned slaves, virtual_slave_maker make, uint64_t seed)
{
	/* No wake latency of the kind that a logarithm makes: a C library may round it otherwise.
	 */
	struct virtual_spec spec = { .slaves = slaves,
				     .make = make,
				     .seed = seed,
				     .host_ppm = 12.5,
				     .wake_sigma_ns = -1,
				     .wake_spike_ns = 200 * NS_PER_US,
				     .spikes_per_million = 20000 };

	tr.prng.state = seed;
	tr.make = make;
	tr.frames = tr.edges = tr.cycles = 0;
	for (unsigned i = 0; i < KINDS; i++) {
		tr.hash[i] = HASH_START;
	}
	for (unsigned i = 0; i < slaves; i++) {
		spec.ppm[i] = (double)prng_below(&tr.prng, 2 * PPM_MAX) - PPM_MAX;
	}
	virtual_bench_init(&tr.b, &spec);
	tr.b.each_edge = add_edge;
	virtual_master_init(&tr.vm, &tr.b, NULL);
	tr.vm.each_frame = add_frame;
	tr.vm.each_sent = add_frame;
	tr.vm.each_cycle = add_cycle;
	if (virtual_master_bring_up(&tr.vm) < 0) {
		test_fail(__FILE__, __LINE__, "%s", tr.vm.failure.text);
	}
}

static void run(uint64_t cycles)
{
	CHECK_EQ(virtual_master_run(&tr.vm, cycles), SESSION_GOES_ON);
}

/* Each of these to some slave, with some cycles after it. */
static const struct {
	const char *action;
	const char *keys;
	enum { FRAME, OF_A_SLAVE, OF_THE_SAME } of;
} troubles[] = {
	{ "lose", "", FRAME },
	{ "drop", "", FRAME },
	{ "delay", "by=700us", FRAME },
	{ "double", "", FRAME },
	{ "hold", "", FRAME },
	{ "corrupt", "", FRAME },
	{ "truncate", "", FRAME },
	{ "sync0-lost", "count=2", OF_A_SLAVE },
	{ "drift", "ppm=60", OF_A_SLAVE },
	{ "watchdog", "", OF_A_SLAVE },
	{ "mailbox-stuck", "for=20ms", OF_A_SLAVE },
	{ "damage", "", OF_A_SLAVE },
	{ "cut", "", OF_A_SLAVE },
	{ "heal", "", OF_THE_SAME },
	{ "reset", "", OF_A_SLAVE },
	{ "power-off", "", OF_A_SLAVE },
	{ "power-on", "", OF_THE_SAME },
};

static void storm(void)
{
	unsigned slave = 0;

	for (size_t i = 0; i < sizeof(troubles) / sizeof(troubles[0]); i++) {
		char of[24] = "";
		char line[80];

		if (troubles[i].of == OF_A_SLAVE) {
			slave = (unsigned)prng_below(&tr.prng, tr.b.spec.slaves);
		}
		if (troubles[i].of != FRAME) {
			snprintf(of, sizeof(of), "slave=%u ", slave);
		}
		snprintf(line, sizeof(line), "at=0s %s %s%s", troubles[i].action, of,
			 troubles[i].keys);
		virtual_bench_fault(&tr.b, line);
		run(STEP_CYCLES);
	}
	if (tr.make == fb1111_piccolo_slave) {
		fb1111_piccolo_stall(segment_device(tr.b.segment, 1), virtual_bench_now_ns(&tr.b),
				     3 * NS_PER_MS);
	}
	run(PEACE_CYCLES);
}

static void check_hashes(const uint64_t *expected)
{
	int is_same = 1;

	add(SAMPLES, tr.vm.result.hash);
	add(SAMPLES, tr.vm.result.samples);
	printf("%u slaves, %" PRIu64 " frames, %" PRIu64 " edges:\n", tr.b.spec.slaves, tr.frames,
	       tr.edges);
	for (unsigned i = 0; i < KINDS; i++) {
		is_same &= tr.hash[i] == expected[i];
		printf("\t%s UINT64_C(0x%016" PRIx64 ")%s\n", kinds[i], tr.hash[i],
		       tr.hash[i] == expected[i] ? "" : ", it was another");
	}
#if defined(__x86_64__)
	if (!is_same) {
		test_fail(__FILE__, __LINE__, "the run is another: see the top of this file");
	}
#else
	(void)is_same; /* the compiler may put a multiplication and an addition together */
#endif
}

static void check_run(unsigned slaves, virtual_slave_maker make, const uint64_t *expected)
{
	open_run(slaves, make, 1000 + slaves);
	run(CALM_CYCLES);
	storm();
	virtual_master_stop(&tr.vm);
	check_hashes(expected);
	virtual_master_close(&tr.vm);
}

TEST(trace, of_2_boards_is_the_same)
{
	static const uint64_t expected[KINDS] = {
		UINT64_C(0x37230233c5714c27), UINT64_C(0xa67faea27b5a3c7c),
		UINT64_C(0x72d633b2fc8ee314), UINT64_C(0x9082fbc200494bd9),
		UINT64_C(0x42ced1adb4960efd),
	};

	check_run(2, fb1111_piccolo_slave, expected);
}

TEST(trace, of_16_boards_is_the_same)
{
	static const uint64_t expected[KINDS] = {
		UINT64_C(0xe2f36ec3f6699ed1), UINT64_C(0x3d22c02c9e04093e),
		UINT64_C(0x036bcf906b9eb58d), UINT64_C(0x350d2da48c4a790c),
		UINT64_C(0xa24d6e8b22073c2b),
	};

	check_run(16, fb1111_piccolo_slave, expected);
}

TEST(trace, of_64_boards_is_the_same)
{
	static const uint64_t expected[KINDS] = {
		UINT64_C(0x7a9a647774ea4403), UINT64_C(0x262a07e5ab328c44),
		UINT64_C(0xab729a26383fc5b2), UINT64_C(0x77cbe90d211066e2),
		UINT64_C(0x91a1a0f89d045863),
	};

	check_run(64, fb1111_piccolo_slave, expected);
}

/* Every slave of the catalogue, and boards behind them. */
static int make_mixed(int position, struct segment_slave_spec *ret_spec)
{
	static struct slave_model model; /* large */

	if ((size_t)position >= catalogue_count()) {
		return fb1111_piccolo_slave(position, ret_spec);
	}
	catalogue_read((size_t)position, &model);
	if (plant_is_name(model.name)) {
		return plant_by_name(position, model.name, ret_spec);
	}
	if (wago_750_354_is_name(model.name)) {
		return wago_750_354_by_name(position, model.name, ret_spec);
	}
	return catalogue_slave(&model, position, ret_spec);
}

TEST(trace, of_the_whole_catalogue_is_the_same)
{
	static const uint64_t expected[KINDS] = {
		UINT64_C(0x2febe52bfaa76ff3), UINT64_C(0x0c40c51edc5ca77b),
		UINT64_C(0x0fbc06d08be2f3f0), UINT64_C(0x318a4fdc9961cc69),
		UINT64_C(0xa7ff5529c48bd01c),
	};

	check_run((unsigned)catalogue_count() + 2, make_mixed, expected);
}
