/* SPDX-License-Identifier: MIT */
/* The whole cycle against a scripted exchange: its reaction to what the bus returns. */
#include "cycle/cycle.h"

#include <errno.h>
#include <pthread.h>
#include <sched.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <unistd.h>

#include "base/event.h"
#include "harness/test.h"

#define PERIOD_NS 1000000

/* Image: output byte, then a 16-bit counter of each of two slaves. */
enum { IMAGE_BYTES = 5, OUTPUT_BYTES = 1 };

static struct {
	mono_t now;
	int64_t late_ns; /* of the next wake */
	uint16_t counter[2];
	enum exchange_status status;
	int64_t dc_offset_ns; /* DC time minus host time */
	int64_t transit_ns;
	int64_t hold_ns; /* between the sending and the wire, in no round trip */
	int is_timeless; /* the reference's time in the frame is implausible */
	uint64_t slaves_low;
	unsigned late;
	unsigned doubled;
	uint8_t seen_output;
	uint64_t written;             /* samples in the ring when the last frame was sent */
	uint64_t conversions_from_dc; /* 1: counters follow the DC time as real slaves do */
} world;

static struct cycle_stats stats;
static struct config cfg;
static struct board board;
static struct ring_reader *reader;

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
		.dc_diff_ns = -1,
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

/* In the thread that only reads the DC time, whose host clock is always 0. */
static _Thread_local int is_dc_reader;

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

static const struct channel channels[] = {
	{ .name = "a.led",
	  .direction = CHANNEL_OUTPUT,
	  .type = CHANNEL_BOOL,
	  .bit_len = 1,
	  .scale = 1 },
	{ .name = "a.counter", .type = CHANNEL_UINT, .bit_len = 16, .bit_offset = 8, .scale = 1 },
	{ .name = "b.counter", .type = CHANNEL_UINT, .bit_len = 16, .bit_offset = 24, .scale = 1 },
};
static const struct slave_info slaves[] = {
	{ .name = "a", .slave_pos = 0, .counter_channel = 1 },
	{ .name = "b", .slave_pos = 1, .counter_channel = 2 },
};
static struct exchange_plan plan;
static struct ring *samples;
static struct ring *events;
static struct ring_reader *event_reader;
static struct cycle *cy;

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

/* What the last start() made; nothing before the first. */
static void stop(void)
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

static void start(void)
{
	char error[256] = "";
	struct cycle_spec spec;

	stop();
	memset(&world, 0, sizeof(world));
	memset(&stats, 0, sizeof(stats));
	world.now.ns = 7000000000 + 123456;
	world.dc_offset_ns = 5000000000;
	world.transit_ns = 20000;
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
	plan = (struct exchange_plan){ .image_bytes = IMAGE_BYTES,
				       .output_bytes = OUTPUT_BYTES,
				       .chunk_count = 1,
				       .wkc_expected = 4,
				       .slave_count = 2,
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

static void steps(unsigned n)
{
	for (unsigned i = 0; i < n; i++) {
		cycle_step(cy);
	}
}

static void start_in_op(void)
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
	steps(10);
	CHECK_EQ(stats.samples_bad, 0);
	CHECK_EQ(stats.samples_good, 20);
	ring_seek(reader, ring_newest(reader));
}

struct got {
	struct sample_header h;
	uint8_t image[IMAGE_BYTES];
};

static struct got next_sample(void)
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

/* The next event of @id; the test ends if there is none. */
static struct event next_event(enum event_id id)
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

static unsigned count_events(enum event_id id)
{
	struct event ev;
	uint64_t lost;
	unsigned count = 0;

	while (ring_read(event_reader, &ev, sizeof(ev), &lost) == RING_OK) {
		count += ev.id == id;
	}
	return count;
}

static void check_event(struct event ev, uint16_t slave_pos, int64_t value, int32_t arg0,
			int32_t arg1)
{
	CHECK_EQ(ev.slave_pos, slave_pos);
	CHECK_EQ(ev.value, value);
	CHECK_EQ(ev.arg[0], arg0);
	CHECK_EQ(ev.arg[1], arg1);
}

TEST(cycle, every_sample_is_numbered_by_its_sync0_edge_and_good)
{
	uint64_t first = 0;

	start_in_op();
	steps(100);
	for (unsigned i = 0; i < 100; i++) {
		struct got s = next_sample();

		first = i == 0 ? s.h.cycle : first;
		CHECK_EQ(s.h.cycle, first + i);
		CHECK_EQ(s.h.dc_time_ns % PERIOD_NS, 0);
		CHECK_EQ((uint16_t)(s.h.dc_time_ns / PERIOD_NS), s.image[1] | s.image[2] << 8);
		CHECK_EQ(s.h.slaves_bad.word[0], 0);
		CHECK_EQ(s.h.flags & ~(uint32_t)SAMPLE_FAIL_SAFE, 0);
		CHECK(llabs(s.h.frame_dc_ns - s.h.dc_time_ns - PERIOD_NS / 2) < 25000);
	}
}

TEST(cycle, a_lost_frame_costs_one_bad_sample_a_slave_and_no_overrun)
{
	struct got s;

	start_in_op();
	world.status = EXCHANGE_NO_FRAME;
	steps(1);
	world.status = EXCHANGE_OK;
	steps(5);
	CHECK_EQ(stats.frames_lost, 1);
	CHECK_EQ(stats.samples_bad, 2);
	CHECK_EQ(stats.samples_bad_unexplained, 0);
	CHECK_EQ(stats.overruns, 0);
	CHECK_EQ(stats.cycles_skipped, 0);
	s = next_sample();
	CHECK_EQ(s.h.flags & SAMPLE_LOST, SAMPLE_LOST);
	CHECK_EQ(s.h.slaves_bad.word[0], 3);
	CHECK_EQ(s.h.round_trip_ns, -1);
	CHECK_EQ(next_sample().h.slaves_bad.word[0], 0);
	check_event(next_event(EVENT_FRAME_LOST), EVENT_NO_SLAVE, (int64_t)s.h.cycle, 1, 0);
	CHECK_EQ(count_events(EVENT_FRAME_LOST), 0);
}

TEST(cycle, a_long_loss_is_an_event_at_the_first_and_each_power_of_two)
{
	uint64_t first;

	start_in_op();
	world.status = EXCHANGE_NO_FRAME;
	steps(9);
	first = next_sample().h.cycle;
	for (int row = 1; row <= 8; row *= 2) {
		check_event(next_event(EVENT_FRAME_LOST), EVENT_NO_SLAVE, (int64_t)first + row - 1,
			    row, 0);
	}
	CHECK_EQ(count_events(EVENT_FRAME_LOST), 0);
}

TEST(cycle, a_sample_carries_the_phase_error_of_its_frame)
{
	struct got s;

	start_in_op();
	steps(1);
	CHECK(abs(next_sample().h.phase_error_ns) < 200);
	world.transit_ns += 7000;
	steps(1);
	s = next_sample();
	CHECK(abs(s.h.phase_error_ns - 7000) < 200);
	CHECK_EQ(s.h.phase_error_ns,
		 s.h.frame_dc_ns - s.h.dc_time_ns - PERIOD_NS / 2 - s.h.wake_latency_ns);
	CHECK(histogram_max_magnitude(&stats.phase) >= 6800);
}

TEST(cycle, a_wake_three_periods_late_leaves_three_skipped_samples_and_keeps_the_phase)
{
	uint64_t cycle;

	start_in_op();
	steps(1);
	cycle = next_sample().h.cycle;
	world.late_ns = 3 * PERIOD_NS + 100000;
	steps(3);
	for (unsigned i = 1; i <= 6; i++) {
		struct got s = next_sample();

		CHECK_EQ(s.h.cycle, cycle + i);
		CHECK_EQ((s.h.flags & SAMPLE_SKIPPED) != 0, i <= 3);
		CHECK_EQ(s.h.slaves_bad.word[0], i <= 3 ? 3 : 0);
	}
	CHECK_EQ(stats.overruns, 1);
	CHECK_EQ(stats.cycles_skipped, 3);
	CHECK_EQ(stats.samples_bad, 6);
	CHECK_EQ(stats.samples_bad_unexplained, 0);
}

TEST(cycle, a_stall_too_long_for_placeholders_jumps_the_numbers_by_exactly_the_stall)
{
	uint64_t cycle;

	start_in_op();
	steps(1);
	cycle = next_sample().h.cycle;
	world.late_ns = 5000 * (int64_t)PERIOD_NS;
	steps(2);
	CHECK_EQ(next_sample().h.cycle, cycle + 5001);
	CHECK_EQ(next_sample().h.slaves_bad.word[0], 0);
	check_event(next_event(EVENT_NUMBERING_JUMP), EVENT_NO_SLAVE, (int64_t)cycle + 5001, 5000,
		    0);
	CHECK_EQ(count_events(EVENT_NUMBERING_JUMP), 0);
}

TEST(cycle, a_counter_that_does_not_advance_makes_the_sample_of_that_slave_alone_bad)
{
	struct got s;

	start_in_op();
	world.conversions_from_dc = 0;
	world.counter[0]++;
	steps(1);
	s = next_sample();
	CHECK_EQ(s.h.slaves_bad.word[0], 2);
	CHECK_EQ(s.h.flags & SAMPLE_BAD_COUNTER, SAMPLE_BAD_COUNTER);
	CHECK_EQ(stats.samples_bad_unexplained, 1);
	CHECK_EQ(stats.slave_bad[1], 1);
	CHECK_EQ(stats.slave_bad[0], 0);
	check_event(next_event(EVENT_COUNTER_BAD), 1, (int64_t)s.h.cycle, world.counter[1],
		    world.counter[1] + 1);
	world.counter[0]++;
	world.counter[1]++;
	steps(1);
	CHECK_EQ(next_sample().h.slaves_bad.word[0], 0);
}

TEST(cycle, a_late_or_doubled_frame_is_counted_and_flagged)
{
	struct got s;

	start_in_op();
	world.late = 1;
	world.doubled = 1;
	steps(1);
	s = next_sample();
	CHECK_EQ(s.h.flags & SAMPLE_LATE, SAMPLE_LATE);
	CHECK_EQ(s.h.flags & SAMPLE_DOUBLED, SAMPLE_DOUBLED);
	CHECK_EQ(stats.frames_late, 1);
	CHECK_EQ(stats.frames_doubled, 1);
	CHECK_EQ(s.h.slaves_bad.word[0], 0);
	check_event(next_event(EVENT_FRAME_LATE), EVENT_NO_SLAVE, (int64_t)s.h.cycle, 1, 0);
	check_event(next_event(EVENT_FRAME_DOUBLED), EVENT_NO_SLAVE, (int64_t)s.h.cycle, 0, 0);
}

TEST(cycle, a_frame_that_passes_while_the_slaves_convert_is_not_taken)
{
	struct got s;

	start_in_op();
	world.transit_ns = 540000;
	steps(1);
	world.transit_ns = 20000;
	CHECK_EQ(next_sample().h.flags & SAMPLE_SKIPPED, SAMPLE_SKIPPED);
	s = next_sample();
	CHECK_EQ(s.h.flags & SAMPLE_LATE, SAMPLE_LATE);
	CHECK_EQ(s.h.slaves_bad.word[0], 3);
	CHECK_EQ(stats.samples_bad_unexplained, 0);
	steps(1);
	CHECK_EQ(next_sample().h.slaves_bad.word[0], 0);
}

TEST(cycle, a_low_working_counter_is_bad_and_not_explained_away)
{
	start_in_op();
	world.status = EXCHANGE_WKC_LOW;
	steps(2);
	world.status = EXCHANGE_OK;
	steps(1);
	CHECK_EQ(stats.wkc_low, 2);
	CHECK_EQ(stats.samples_bad, 4);
	CHECK_EQ(stats.samples_bad_unexplained, 4);
	CHECK_EQ(next_sample().h.flags & SAMPLE_WKC_LOW, SAMPLE_WKC_LOW);
}

TEST(cycle, an_output_goes_out_in_op_only_and_is_answered_with_its_cycle)
{
	uint64_t sequence;
	struct got s;

	start();
	steps(1000);
	board_begin(&board);
	board_put(&board, 0, 1);
	sequence = board_commit(&board);
	steps(5);
	CHECK_EQ(world.seen_output & 1, 0);
	cycle_phase_set(cy, CYCLE_OP);
	steps(2);
	CHECK_EQ(world.seen_output & 1, 1);
	CHECK_EQ(board.taken_sequence, sequence);
	board_begin(&board);
	board_put(&board, 0, 0);
	board_commit(&board);
	ring_seek(reader, ring_newest(reader));
	steps(3);
	do {
		s = next_sample();
	} while (s.image[0] & 1);
	CHECK_EQ(board.taken_cycle, s.h.cycle);
	board_begin(&board);
	board_put(&board, 0, 1);
	board_commit(&board);
	steps(2);
	CHECK_EQ(world.seen_output & 1, 1);
	cycle_phase_set(cy, CYCLE_SAFE);
	steps(2);
	CHECK_EQ(world.seen_output & 1, 0);
	CHECK_EQ(stats.is_fail_safe, 1);
}

TEST(cycle, a_missing_output_is_reported_in_one_line)
{
	char error[256] = "";
	struct cycle_spec spec = { .cfg = &cfg,
				   .plan = &plan,
				   .channels = channels,
				   .channel_count = 3,
				   .slaves = slaves,
				   .slave_count = 2 };

	start();
	cfg.output_count = 1;
	cfg.output[0] = (struct config_output){ .channel = "a.lamp", .line = 12 };
	snprintf(cfg.path, sizeof(cfg.path), "x.yaml");
	CHECK_EQ(cycle_create(&spec, &cy, error, sizeof(error)), -22);
	CHECK_STR(error, "x.yaml:12: outputs: a.lamp: no such output channel");
	cfg.output[0] = (struct config_output){ .channel = "a.led", .fail_safe = 3, .line = 13 };
	CHECK_EQ(cycle_create(&spec, &cy, error, sizeof(error)), -22);
	CHECK_STR(error, "x.yaml:13: outputs: a.led: the channel cannot hold its fail_safe value");
	cfg.output_count = 0;
	cfg.path[0] = '\0';
}

TEST(cycle, a_silent_owner_loses_its_output_after_its_timeout_in_cycles)
{
	unsigned cycles = 0;

	cfg.output_count = 1;
	cfg.output[0] = (struct config_output){
		.channel = "a.led", .min = 0, .max = 1, .timeout_ns = 20 * PERIOD_NS
	};
	start();
	cfg.output_count = 0;
	steps(300);
	cycle_phase_set(cy, CYCLE_OP);
	board_begin(&board);
	board_put(&board, 0, 1);
	board_commit(&board);
	steps(3);
	CHECK_EQ(world.seen_output & 1, 1);
	while (world.seen_output & 1) {
		steps(1);
		CHECK(++cycles < 30);
	}
	CHECK(cycles >= 18 && cycles <= 22);
}

TEST(cycle, events_of_one_kind_are_limited_but_the_counters_are_not)
{
	struct event ev;
	uint64_t lost;
	unsigned count = 0;

	start_in_op();
	world.late = 1;
	steps(500);
	while (ring_read(event_reader, &ev, sizeof(ev), &lost) == RING_OK) {
		count += ev.id == EVENT_FRAME_LATE;
	}
	CHECK_EQ(stats.frames_late, 500);
	CHECK(count >= 20 && count <= 40);
}

TEST(cycle, going_to_fail_safe_is_an_event_only_when_outputs_were_live)
{
	start_in_op();
	CHECK_EQ(count_events(EVENT_OUTPUT_FAIL_SAFE), 0);
	cycle_phase_set(cy, CYCLE_SAFE);
	steps(3);
	CHECK_EQ(count_events(EVENT_OUTPUT_FAIL_SAFE), 1);
}

TEST(cycle, the_overrun_policy_counts_in_op_only)
{
	cfg.cycle_overrun = CONFIG_OVERRUN_FAIL_SAFE;
	start();
	world.late_ns = 3 * PERIOD_NS;
	steps(500);
	cycle_phase_set(cy, CYCLE_OP);
	board_begin(&board);
	board_put(&board, 0, 1);
	board_commit(&board);
	steps(3);
	CHECK_EQ(world.seen_output & 1, 1);
	world.late_ns = 3 * PERIOD_NS;
	steps(2);
	CHECK_EQ(world.seen_output & 1, 0);
	CHECK_EQ(count_events(EVENT_OUTPUT_FAIL_SAFE), 1);
	cfg.cycle_overrun = CONFIG_OVERRUN_COUNT;
}

TEST(cycle, a_late_frame_goes_out_before_the_skipped_samples_are_written)
{
	uint64_t newest;

	start_in_op();
	newest = ring_newest(reader);
	world.late_ns = 500 * (int64_t)PERIOD_NS;
	steps(1);
	CHECK_EQ(world.written, newest);
	CHECK_EQ(ring_newest(reader), newest + 501);
	for (unsigned i = 0; i < 501; i++) {
		struct got s = next_sample();

		CHECK_EQ(s.h.flags & SAMPLE_SKIPPED, i < 500 ? SAMPLE_SKIPPED : 0);
		CHECK_EQ(s.h.round_trip_ns, i < 500 ? -1 : world.transit_ns);
	}
}

TEST(cycle, an_overrun_with_policy_stop_sends_fail_safe_values_before_the_end)
{
	unsigned safe = 0;
	int r;

	cfg.cycle_overrun = CONFIG_OVERRUN_STOP;
	start_in_op();
	board_begin(&board);
	board_put(&board, 0, 1);
	board_commit(&board);
	steps(3);
	CHECK_EQ(world.seen_output & 1, 1);
	world.late_ns = 3 * PERIOD_NS;
	steps(1);
	while (!cycle_has_stopped(cy, &r)) {
		world.late_ns = 2 * PERIOD_NS; /* and it goes on being late */
		steps(1);
		CHECK_EQ(world.seen_output & 1, 0);
		CHECK(++safe < 100);
	}
	CHECK_EQ(safe, 4);
	CHECK_EQ(r, -ETIME);
	cfg.cycle_overrun = CONFIG_OVERRUN_COUNT;
}

TEST(cycle, a_stall_found_at_the_wake_and_again_by_the_frame_is_one_overrun)
{
	start_in_op();
	world.late_ns = 2 * PERIOD_NS + 400000;
	world.transit_ns = 200000;
	steps(1);
	world.transit_ns = 20000;
	CHECK_EQ(stats.overruns, 1);
	CHECK_EQ(stats.cycles_skipped, 3);
	steps(3);
	CHECK_EQ(stats.overruns, 1);
}

TEST(cycle, a_late_frame_that_is_held_past_the_next_edge_moves_the_deadline_with_the_number)
{
	start_in_op();
	world.late_ns = 2 * PERIOD_NS + 480000;
	world.hold_ns = 100000;
	steps(1);
	CHECK_EQ(stats.cycles_skipped, 3);
	CHECK_EQ(stats.overruns, 1);
	steps(200);
	CHECK_EQ(stats.cycles_skipped, 3);
	CHECK_EQ(stats.frames_late, 0);
	CHECK_EQ(stats.samples_bad, 2 * 3);
}

TEST(cycle, a_number_behind_the_edges_is_corrected_once_and_the_deadline_stays)
{
	uint64_t cycle;

	start_in_op();
	steps(1);
	cycle = next_sample().h.cycle;
	world.dc_offset_ns += PERIOD_NS; /* one edge on, in the same phase: this master was not late
					  */
	steps(50);
	CHECK_EQ(stats.overruns, 1);
	CHECK_EQ(stats.cycles_skipped, 1);
	for (unsigned i = 1; i <= 51; i++) {
		struct got s = next_sample();

		CHECK_EQ(s.h.cycle, cycle + i);
		CHECK_EQ((s.h.flags & SAMPLE_SKIPPED) != 0, i == 1);
		CHECK_EQ(s.h.slaves_bad.word[0], i == 1 ? 3 : 0);
	}
	CHECK_EQ(stats.samples_bad, 2);
}

TEST(cycle, a_number_behind_by_three_edges_and_a_wake_late_by_two_are_corrected_together)
{
	int64_t step_ns;
	uint64_t skipped;

	start_in_op();
	world.dc_offset_ns += 3 * PERIOD_NS;
	world.late_ns = 2 * PERIOD_NS;
	steps(1);
	skipped = stats.cycles_skipped;
	CHECK_EQ(skipped, 5);
	CHECK_EQ(stats.overruns, 1);
	step_ns = world.now.ns;
	steps(20);
	CHECK_EQ(stats.cycles_skipped, skipped);
	CHECK(llabs(world.now.ns - step_ns - 20 * (int64_t)PERIOD_NS) < 100000);
}

/* Master and slaves were delayed together: the frame is back, its time too far off to be plausible.
 */
TEST(cycle, a_frame_without_a_time_is_late_and_never_taken_for_the_current_one)
{
	start_in_op();
	steps(10);
	world.is_timeless = 1;
	world.late_ns = 22 * PERIOD_NS + 40000;
	world.dc_offset_ns += 3 * PERIOD_NS;
	steps(1);
	world.is_timeless = 0;
	steps(20);
	CHECK_EQ(stats.samples_bad_unexplained, 0);
	CHECK_EQ(stats.frames_late, 1);
	CHECK(stats.samples_bad > 0);
	CHECK_EQ(stats.samples_good, 2 * (10 + 10 + 20));
}

TEST(cycle, of_a_split_image_only_the_slave_that_is_not_there_is_bad)
{
	struct got s;

	start_in_op();
	plan.is_split = 1;
	board_begin(&board);
	board_put(&board, 0, 1);
	board_commit(&board);
	world.status = EXCHANGE_WKC_LOW;
	world.slaves_low = 2;
	steps(10);
	CHECK_EQ(stats.slave_bad[0], 0);
	CHECK_EQ(stats.slave_bad[1], 10);
	CHECK_EQ(stats.samples_bad, 10);
	s = next_sample();
	CHECK_EQ(s.h.slaves_bad.word[0], 2);
	CHECK_EQ(s.h.flags & SAMPLE_WKC_LOW, SAMPLE_WKC_LOW);
	cycle_slaves_set(cy, &(struct slave_set){ { 1 } }); /* the service thread knows now */
	steps(100);
	CHECK_EQ(stats.slave_bad[0], 0);
	CHECK_EQ(stats.slave_bad[1], 10);
	CHECK_EQ(stats.slave_good[0], stats.slave_good[1] + 110);
	CHECK_EQ(world.seen_output & 1, 1);
	CHECK_EQ(stats.is_fail_safe, 0);
	world.status = EXCHANGE_OK;
	world.slaves_low = 0;
	cycle_slaves_set(cy, &(struct slave_set){ { 3 } }); /* and it is back, its counter anywhere
							     */
	steps(100);
	CHECK_EQ(stats.samples_bad, 10);
	ring_seek(reader, ring_newest(reader));
	steps(1);
	CHECK_EQ(next_sample().h.slaves_bad.word[0], 0);
}

TEST(cycle, a_frame_outside_its_window_is_late_though_a_slave_of_a_split_image_is_missing)
{
	uint64_t unexplained;
	struct got s;

	start_in_op();
	plan.is_split = 1;
	world.status = EXCHANGE_WKC_LOW;
	world.slaves_low = 2;
	steps(10);
	CHECK_EQ(stats.frames_late, 0);
	ring_seek(reader, ring_newest(reader));
	CHECK_EQ(stats.slave_bad[0], 0);
	unexplained = stats.samples_bad_unexplained;
	/* The frame is back, its DC time not plausible. */
	world.is_timeless = 1;
	steps(1);
	world.is_timeless = 0;
	CHECK_EQ(stats.frames_late, 1);
	CHECK_EQ(stats.slave_bad[0], 1);
	CHECK_EQ(stats.samples_bad_unexplained, unexplained);
	s = next_sample();
	CHECK_EQ(s.h.flags & SAMPLE_LATE, SAMPLE_LATE);
	CHECK_EQ(s.h.slaves_bad.word[0], 3);
}

TEST(cycle, outputs_of_a_slave_that_is_not_in_op_are_at_fail_safe)
{
	start_in_op();
	plan.is_split = 1;
	board_begin(&board);
	board_put(&board, 0, 1);
	board_commit(&board);
	steps(3);
	CHECK_EQ(world.seen_output & 1, 1);
	cycle_slaves_set(cy, &(struct slave_set){ { 2 } });
	steps(2);
	CHECK_EQ(world.seen_output & 1, 0);
	cycle_slaves_set(cy, &(struct slave_set){ { 3 } });
	steps(2);
	CHECK_EQ(world.seen_output & 1, 1);
}

enum { DC_READS = 2000 };

struct dc_reads {
	_Atomic unsigned done;
	_Atomic int64_t least_ns; /* DC time minus host time */
	_Atomic int64_t most_ns;
};

static void *read_dc_time(void *arg)
{
	struct dc_reads *reads = arg;
	int64_t least_ns = INT64_MAX;
	int64_t most_ns = INT64_MIN;

	is_dc_reader = 1;
	for (unsigned n = 0; n < DC_READS; sched_yield()) {
		int64_t dc_ns;

		if (cycle_dc_now(cy, &dc_ns) == 0) {
			least_ns = dc_ns < least_ns ? dc_ns : least_ns;
			most_ns = dc_ns > most_ns ? dc_ns : most_ns;
			n++;
		}
	}
	atomic_store(&reads->least_ns, least_ns);
	atomic_store(&reads->most_ns, most_ns);
	atomic_store(&reads->done, 1);
	return NULL;
}

TEST(cycle_thread, the_dc_time_read_by_another_thread_belongs_to_its_host_time)
{
	struct dc_reads reads = { 0 };
	pthread_t thread;

	start_in_op();
	CHECK_EQ(pthread_create(&thread, NULL, read_dc_time, &reads), 0);
	while (!atomic_load(&reads.done)) {
		cycle_step(cy);
	}
	pthread_join(thread, NULL);
	/* One cycle is 1 ms: a time of one cycle with the host time of another is that far off. */
	CHECK(llabs(atomic_load(&reads.least_ns) - world.dc_offset_ns) < PERIOD_NS / 4);
	CHECK(llabs(atomic_load(&reads.most_ns) - world.dc_offset_ns) < PERIOD_NS / 4);
	stop();
}
