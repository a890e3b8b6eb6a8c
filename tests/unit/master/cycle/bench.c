/* SPDX-License-Identifier: MIT */
#include "unit/master/cycle/bench.h"

#include <unistd.h>

#include "harness/test.h"
#include "wire/al.h"

struct world world;
struct cycle_stats stats;
struct config cfg;
struct board board;
struct exchange_plan plan;
struct ring_reader *reader;
struct cycle *cy;
_Thread_local int is_dc_reader;

struct exchange_result exchange_run(struct exchange *ex, uint8_t *image, mono_t deadline)
{
	struct exchange_result res = {
		.status = world.status,
		.wkc = world.status == EXCHANGE_OK ? 4 : 0,
		.slaves_low = { .word = { world.slaves_low } },
		.wkc_expected = 4,
		.sent = world.now,
		.round_trip = { world.status == EXCHANGE_NO_FRAME ? -1 : world.transit_ns },
		.late = world.late,
		.late_by = world.late,
		.doubled = world.doubled,
		.dc_diff_ns = world.dc_diff_ns,
		.al_status = world.al_status,
		.al_wkc = world.al_wkc,
	};

	(void)ex;
	world.seen_output = image[0];
	world.written = ring_newest(reader);
	if (world.status == EXCHANGE_NO_FRAME) {
		world.now = deadline;
		return res;
	}
	world.now.ns += world.hold_ns + world.transit_ns;
	world.hold_ns = 0;
	res.dc_time_ns = world.is_timeless ? 0 : world.now.ns + world.dc_offset_ns;
	if (world.conversions_from_dc) {
		world.counter[0] = (uint16_t)((world.now.ns + world.dc_offset_ns) / PERIOD_NS);
		world.counter[1] = (uint16_t)(world.counter[0] + 100);
	}
	if (world.status == EXCHANGE_OK || (world.slaves_low & 1) == 0) {
		image[1] = (uint8_t)world.counter[0];
		image[2] = (uint8_t)(world.counter[0] >> 8);
	}
	if (world.status == EXCHANGE_OK || (world.slaves_low & 2) == 0) {
		image[3] = (uint8_t)world.counter[1];
		image[4] = (uint8_t)(world.counter[1] >> 8);
	}
	return res;
}

unsigned exchange_ride(struct exchange *ex, const struct exchange_window *window)
{
	(void)ex;
	(void)window;
	return 0;
}

static mono_t world_now(void *ctx)
{
	(void)ctx;
	return is_dc_reader ? (mono_t){ 0 } : world.now;
}

static int64_t world_tai(void *ctx)
{
	(void)ctx;
	return world.now.ns;
}

static int world_sleep(void *ctx, mono_t deadline)
{
	(void)ctx;
	if (world.now.ns < deadline.ns) {
		world.now = deadline;
	}
	world.now.ns += world.late_ns;
	world.late_ns = 0;
	return 0;
}

const struct channel channels[BENCH_CHANNELS] = {
	{ .name = "a.led",
	  .direction = CHANNEL_OUTPUT,
	  .type = CHANNEL_BOOL,
	  .bit_len = 1,
	  .scale = 1 },
	{ .name = "a.counter", .type = CHANNEL_UINT, .bit_len = 16, .bit_offset = 8, .scale = 1 },
	{ .name = "b.counter", .type = CHANNEL_UINT, .bit_len = 16, .bit_offset = 24, .scale = 1 },
};
const struct slave_info slaves[BENCH_SLAVES] = {
	{ .name = "a", .slave_pos = 0, .counter_channel = 1, .is_dc_reference = 1 },
	{ .name = "b", .slave_pos = 1, .counter_channel = 2 },
};
static struct ring *samples;
static struct ring *events;
static struct ring_reader *event_reader;

static struct ring *make_ring(const char *kind, uint32_t payload_bytes, struct ring_reader **ret)
{
	struct ring *ring;
	char path[64];
	struct ring_spec spec = { .path = path,
				  .kind = kind,
				  .payload_bytes = payload_bytes,
				  .slot_count = 8192,
				  .period_ns = PERIOD_NS,
				  .file_mode = 0600 };

	snprintf(path, sizeof(path), "/dev/shm/ecdaq-test-%s-%d", kind, (int)getpid());
	CHECK_EQ(ring_create(&spec, &ring), 0);
	CHECK_EQ(ring_reader_open(path, ret), 0);
	unlink(path);
	return ring;
}

void stop(void)
{
	cycle_destroy(cy);
	ring_reader_destroy(reader);
	ring_reader_destroy(event_reader);
	ring_destroy(samples);
	ring_destroy(events);
	cy = NULL;
	reader = NULL;
	event_reader = NULL;
	samples = NULL;
	events = NULL;
}

void start(void)
{
	char error[256] = "";
	struct cycle_spec spec;

	stop();
	memset(&world, 0, sizeof(world));
	memset(&stats, 0, sizeof(stats));
	world.now.ns = 7000000000 + 123456;
	world.dc_offset_ns = 5000000000;
	world.transit_ns = 20000;
	world.dc_diff_ns = -1;
	world.al_status = AL_OP;
	world.al_wkc = BENCH_SLAVES;
	world.conversions_from_dc = 1;
	cfg.cycle_period_ns = PERIOD_NS;
	cfg.cycle_phase_percent = 50;
	cfg.cycle_receive_percent = 40;
	cfg.dc_lock_limit_ns = 10000;
	cfg.dc_lock_cycles = 200;
	cfg.dc_unlock_limit_ns = 50000;
	cfg.dc_slew_ns = 20000;
	cfg.dc_kp = 0.02;
	cfg.dc_ki = 0.0001;
	cfg.dc_diff_limit_ns = 1000;
	plan = (struct exchange_plan){ .image_bytes = IMAGE_BYTES,
				       .output_bytes = OUTPUT_BYTES,
				       .chunk_count = 1,
				       .wkc_expected = 4,
				       .slave_count = BENCH_SLAVES,
				       .monitor = 1,
				       .dc_reference = 0x1001 };
	board_init(&board);
	samples = make_ring("sample", sample_head_bytes(2) + IMAGE_BYTES, &reader);
	events = make_ring("event", sizeof(struct event), &event_reader);
	spec = (struct cycle_spec){
		.cfg = &cfg,
		.platform = { .now = world_now, .tai_ns = world_tai, .sleep_until = world_sleep },
		.plan = &plan,
		.slaves = slaves,
		.slave_count = 2,
		.channels = channels,
		.channel_count = 3,
		.samples = samples,
		.events = events,
		.stats = &stats,
		.boards = { [CYCLE_WRITER_LOCAL] = &board },
	};
	CHECK_EQ(cycle_create(&spec, &cy, error, sizeof(error)), 0);
}

void steps(unsigned n)
{
	for (unsigned i = 0; i < n; i++) {
		cycle_step(cy);
	}
}

void start_in_op(void)
{
	start();
	steps(1000);
	CHECK_EQ(stats.dc_state, DC_LOCKED);
	/* From the first wake to the lock; not less than the cycles it must be near. */
	CHECK(stats.dc_lock_ns >= cfg.dc_lock_cycles * (int64_t)PERIOD_NS);
	CHECK(stats.dc_lock_ns < 600 * (int64_t)PERIOD_NS);
	cycle_phase_set(cy, CYCLE_SYNCED);
	steps(10);
	cycle_phase_set(cy, CYCLE_OP);
	steps(1);
	/* The first is not good by definition; it is no test's business but its own. */
	CHECK_EQ(stats.samples_bad, BENCH_SLAVES);
	CHECK_EQ(stats.samples_good, 0);
	for (unsigned i = 0; i < BENCH_SLAVES; i++) {
		stats.slave_bad[i] = 0;
	}
	stats.samples_bad = 0;
	steps(10);
	CHECK_EQ(stats.samples_bad, 0);
	CHECK_EQ(stats.samples_good, 20);
	ring_seek(reader, ring_newest(reader));
}

void set_led(uint64_t raw)
{
	board_begin(&board);
	board_put(&board, 0, raw);
	board_commit(&board);
}

struct got next_sample(void)
{
	struct got got = { .h = { .cycle = 0 } };
	uint8_t payload[sizeof(got)];
	uint32_t head_bytes = sample_head_bytes(2);
	uint64_t lost;

	CHECK_EQ(ring_read(reader, payload, sizeof(payload), &lost), RING_OK);
	memcpy(&got.h, payload, head_bytes);
	memcpy(got.image, payload + head_bytes, sizeof(got.image));
	return got;
}

struct event next_event(enum event_id id)
{
	struct event ev;
	uint64_t lost;

	while (ring_read(event_reader, &ev, sizeof(ev), &lost) == RING_OK) {
		if (ev.id == id) {
			return ev;
		}
	}
	test_fail(__FILE__, __LINE__, "no event %d", (int)id);
}

unsigned count_events(enum event_id id)
{
	struct event ev;
	uint64_t lost;
	unsigned count = 0;

	while (ring_read(event_reader, &ev, sizeof(ev), &lost) == RING_OK) {
		count += ev.id == id;
	}
	return count;
}

void check_event(struct event ev, uint16_t slave_pos, int64_t value, int32_t arg0, int32_t arg1)
{
	CHECK_EQ(ev.slave_pos, slave_pos);
	CHECK_EQ(ev.value, value);
	CHECK_EQ(ev.arg[0], arg0);
	CHECK_EQ(ev.arg[1], arg1);
}
