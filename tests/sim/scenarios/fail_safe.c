/* SPDX-License-Identifier: MIT */
/*
 * Outputs go to fail-safe in the cycle that sees why, whatever the service thread is busy with, and
 * a command is answered as effective only when it was.
 */
#include <errno.h>
#include <stdlib.h>

#include "base/event.h"
#include "base/prng.h"
#include "harness/test.h"
#include "sim/scenarios/output_watch.h"
#include "wire/al.h"

enum { PERIOD_NS = 1000000, PHASES = 100, OUTPUT_AL_ERROR_CODE = 0x001a };

static struct virtual_bench b;
static struct virtual_master vm;

static struct output_watch wire;

static struct admin_reply set_led(const char *channel, uint64_t raw)
{
	struct admin_request rq = { .magic = ADMIN_MAGIC, .verb = ADMIN_SET, .count = 1 };

	snprintf(rq.item[0].channel, sizeof(rq.item[0].channel), "%s", channel);
	rq.item[0].raw = raw;
	return virtual_master_ask(&vm, &rq);
}

/* In OP, the first slave's lamp on: the first bit of the image. */
static void open_live(unsigned slaves, uint64_t seed, const char *setting)
{
	const char *const settings[] = { "slaves[0].name=a", "slaves[1].name=b", setting, NULL };

	virtual_bench_init(
		&b, &(struct virtual_spec){ .slaves = slaves, .seed = seed, .ppm = { 30, -40 } });
	virtual_master_init(&vm, &b, settings);
	virtual_master_settle(&vm);
	output_watch_set(&vm, "a.led", 1);
	virtual_master_run(&vm, 20);
	virtual_master_forget(&vm);
}

static void close_all(void)
{
	virtual_master_close(&vm);
}

static const struct cycle_stats *stats(void)
{
	return &session_page(vm.session)->cycle;
}

static uint32_t state(void)
{
	return atomic_load(&session_page(vm.session)->bus_state);
}

static void wait_for_op(unsigned limit_ms)
{
	for (unsigned ms = 0; state() != BUS_OP || atomic_load(&stats()->is_fail_safe); ms += 10) {
		if (ms > limit_ms) {
			virtual_master_print_events(&vm, 20);
			test_fail(__FILE__, __LINE__, "not live again after %u ms", ms);
		}
		CHECK_EQ(virtual_master_run(&vm, 10), SESSION_GOES_ON);
	}
}

/* The newest event of @id; the test ends if there is none. */
static struct event last_event(enum event_id id)
{
	struct ring_reader *reader = NULL;
	struct event found = { .id = EVENT_NONE };
	struct event ev;
	char path[128];
	uint64_t lost;

	snprintf(path, sizeof(path), "%s/" CONFIG_RUN_EVENTS, vm.dir);
	CHECK_EQ(ring_reader_open(path, &reader), 0);
	ring_seek(reader, ring_oldest(reader));
	while (ring_read(reader, &ev, sizeof(ev), &lost) == RING_OK) {
		found = ev.id == id ? ev : found;
	}
	ring_reader_destroy(reader);
	CHECK_EQ(found.id, id);
	return found;
}

/* --- a slave leaves OP --- */

static int by_size(const void *a, const void *b2)
{
	int64_t x = *(const int64_t *)a;
	int64_t y = *(const int64_t *)b2;

	return x < y ? -1 : x > y;
}

static void ask_dead_mailbox(void)
{
	struct admin_request rq = { .magic = ADMIN_MAGIC,
				    .verb = ADMIN_SDO_READ,
				    .slave_pos = 1,
				    .index = 0x1018,
				    .subindex = 1 };

	CHECK(virtual_master_ask(&vm, &rq).result < 0);
}

/* From the fall of slave 0 out of OP to the first frame with fail-safe outputs, ns; slave 0 falls
 * @after_ns from now. */
static int64_t time_to_safe(int64_t after_ns, int with_sdo)
{
	char line[80];
	int64_t fall_ns;

	snprintf(line, sizeof(line), "at=%lldns al-error slave=0 code=0x%04x", (long long)after_ns,
		 OUTPUT_AL_ERROR_CODE);
	output_watch_begin(&wire, &vm);
	fall_ns = wire.since_ns + after_ns;
	virtual_bench_fault(&b, line);
	if (with_sdo) {
		virtual_bench_fault(&b, "at=0s mailbox-stuck slave=1 for=3s");
		ask_dead_mailbox();
	} else {
		virtual_master_run(&vm, (uint64_t)(after_ns / PERIOD_NS) + 10);
	}
	/* The outputs were live until then, and no longer than one frame after it was to be seen.
	 */
	CHECK(wire.live >= (uint64_t)(after_ns / PERIOD_NS) - 1);
	CHECK(wire.safe >= 5);
	CHECK(wire.first_al_ns > fall_ns);
	CHECK_EQ(wire.newest_live_ns, wire.first_al_ns);
	output_watch_end(&vm);
	return wire.first_safe_ns - fall_ns;
}

static void check_fail_safe_times(unsigned trials, int with_sdo)
{
	static int64_t took_ns[PHASES];
	struct prng prng = { with_sdo ? 7 : 3 };

	for (unsigned i = 0; i < trials; i++) {
		int64_t phase_ns = (int64_t)i * PERIOD_NS / trials +
				   (int64_t)prng_below(&prng, PERIOD_NS / trials);

		open_live(2, i + 1, NULL);
		took_ns[i] = time_to_safe(5 * PERIOD_NS + phase_ns, with_sdo);
		CHECK_EQ(atomic_load(&stats()->op_lost), 1);
		wait_for_op(3000);
		virtual_master_run(&vm, 30);
		CHECK_EQ(virtual_master_value(&vm, "a.led"), 1);
		close_all();
	}
	qsort(took_ns, trials, sizeof(took_ns[0]), by_size);
	printf("a slave leaves OP%s: fail-safe outputs on the wire after min %.3f, median %.3f, "
	       "max "
	       "%.3f ms (%u trials, period 1 ms)\n",
	       with_sdo ? " during an SDO to a dead mailbox" : "", (double)took_ns[0] * 1e-6,
	       (double)took_ns[trials / 2] * 1e-6, (double)took_ns[trials - 1] * 1e-6, trials);
	/* The frame that shows it is still a live one: never less than the way to the next. */
	CHECK(took_ns[0] > PERIOD_NS * 9 / 10);
	CHECK(took_ns[trials - 1] < 2 * PERIOD_NS + PERIOD_NS / 5);
}

TEST(sim_fail_safe, outputs_are_safe_two_cycles_after_a_slave_has_left_op)
{
	check_fail_safe_times(PHASES, 0);
}

TEST(sim_fail_safe, an_sdo_to_a_dead_mailbox_does_not_delay_fail_safe_outputs)
{
	check_fail_safe_times(8, 1);
}

TEST(sim_fail_safe, no_sample_is_good_from_the_cycle_on_that_shows_a_slave_out_of_op)
{
	struct event ev;

	open_live(2, 6, NULL);
	virtual_bench_fault(&b, "at=0s al-error slave=1 code=0x001a");
	CHECK_EQ(virtual_master_run(&vm, 2), SESSION_GOES_ON);
	CHECK_EQ(virtual_master_sample(&vm)->flags & SAMPLE_NOT_OP, SAMPLE_NOT_OP);
	CHECK_EQ(slave_set_count(&virtual_master_sample(&vm)->slaves_bad), 2);
	ev = last_event(EVENT_OP_LOST);
	CHECK_EQ(ev.arg[0], AL_OP | AL_SAFEOP | AL_ERROR);
	CHECK_EQ(ev.arg[1], 2);
	CHECK(ev.cycle + 2 > virtual_master_sample(&vm)->cycle);
	wait_for_op(1000);
	close_all();
}

TEST(sim_fail_safe, without_the_monitor_the_service_thread_still_makes_outputs_safe)
{
	open_live(2, 8, "bus.monitor=off");
	output_watch_begin(&wire, &vm);
	virtual_bench_fault(&b, "at=0s al-error slave=0 code=0x001a");
	virtual_master_run(&vm, 150);
	CHECK_EQ(atomic_load(&stats()->op_lost), 0);
	CHECK(wire.live > 2);
	CHECK(wire.safe > 2);
	output_watch_end(&vm);
	wait_for_op(1000);
	close_all();
}

/* --- another number of slaves --- */

TEST(sim_fail_safe, a_slave_without_power_is_missed_in_one_cycle)
{
	struct event ev;

	open_live(2, 9, NULL);
	output_watch_begin(&wire, &vm);
	virtual_bench_fault(&b, "at=0s power-off slave=1");
	virtual_master_run(&vm, 2);
	CHECK_EQ(virtual_master_sample(&vm)->flags & SAMPLE_NOT_OP, SAMPLE_NOT_OP);
	CHECK_EQ(atomic_load(&stats()->slaves_found), 1);
	ev = last_event(EVENT_SLAVE_COUNT);
	CHECK_EQ(ev.arg[0], 1);
	CHECK_EQ(ev.arg[1], 2);
	virtual_master_run(&vm, 2);
	CHECK(wire.live <= 2);
	CHECK(wire.safe >= 1);
	output_watch_end(&vm);
	virtual_bench_fault(&b, "at=0s power-on slave=1");
	wait_for_op(3000);
	CHECK_EQ(atomic_load(&stats()->slaves_found), 2);
	close_all();
}

TEST(sim_fail_safe, a_stranger_is_counted_in_one_cycle_and_leaves_our_outputs_alone)
{
	uint64_t steps;
	struct event ev;

	/* The third is taken out of the line before the master starts. */
	virtual_bench_init(&b, &(struct virtual_spec){ .slaves = 3, .seed = 12 });
	virtual_bench_fault(&b, "at=0s unplug slave=2");
	virtual_master_init(&vm, &b,
			    (const char *const[]){ "slaves[0].name=a", "slaves[1].name=b", NULL });
	virtual_master_settle(&vm);
	output_watch_set(&vm, "a.led", 1);
	CHECK_EQ(atomic_load(&stats()->slaves_found), 2);
	CHECK_EQ(atomic_load(&stats()->cycles_with_stranger), 0);
	virtual_master_run(&vm, 20);
	output_watch_begin(&wire, &vm);
	virtual_bench_fault(&b, "at=0s plug slave=2");
	steps = atomic_load(&stats()->cycles);
	virtual_master_run(&vm, 2);
	CHECK(atomic_load(&stats()->cycles_with_stranger) >= 1);
	ev = last_event(EVENT_SLAVE_COUNT);
	CHECK_EQ(ev.arg[0], 3);
	CHECK_EQ(ev.arg[1], 2);
	CHECK(wire.live >= 2);
	CHECK_EQ(wire.safe, 0);
	CHECK_EQ(atomic_load(&stats()->op_lost), 0);
	CHECK(steps > 0);
	close_all();
}

/* --- commands --- */

/* The sample of @cycle; the test ends if it has left the ring. */
static struct sample_header sample_of(uint64_t cycle)
{
	static _Alignas(8) uint8_t payload[sizeof(struct sample_header) + LIMIT_IMAGE_BYTES];
	struct ring_reader *reader = NULL;
	struct sample_header h = { .cycle = 0 };
	char path[128];
	uint64_t lost;

	snprintf(path, sizeof(path), "%s/" CONFIG_RUN_SAMPLES, vm.dir);
	CHECK_EQ(ring_reader_open(path, &reader), 0);
	ring_seek(reader, ring_oldest(reader));
	do {
		CHECK_EQ(ring_read(reader, payload, sizeof(payload), &lost), RING_OK);
		memcpy(&h, payload, sample_head_bytes(2));
	} while (h.cycle != cycle);
	ring_reader_destroy(reader);
	return h;
}

TEST(sim_fail_safe, a_command_names_the_first_cycle_whose_frame_came_back_with_its_value)
{
	struct admin_reply reply;
	uint64_t now;

	open_live(2, 14, NULL);
	virtual_bench_fault(&b, "at=0s for=30ms drop");
	now = atomic_load(&stats()->cycle_number);
	reply = set_led("b.led", 1);
	CHECK_EQ(reply.result, 0);
	CHECK(reply.cycle >= now + 29);
	CHECK(reply.cycle <= now + 33);
	CHECK_EQ(sample_of(reply.cycle).flags & SAMPLE_LOST, 0);
	CHECK_EQ(sample_of(reply.cycle - 1).flags & SAMPLE_LOST, SAMPLE_LOST);
	close_all();
}

TEST(sim_fail_safe, a_command_that_cannot_take_effect_is_refused_and_never_does)
{
	struct admin_reply reply;

	open_live(2, 15, "cycle.overrun=fail_safe");
	in_process_stall(b.host, 3 * PERIOD_NS);
	virtual_master_run(&vm, 20);
	CHECK_EQ(atomic_load(&stats()->is_fail_safe), 1);
	reply = set_led("b.led", 1);
	CHECK_EQ(reply.result, -ETIMEDOUT);
	CHECK(strstr(reply.text, "withdrawn") != NULL);
	/* The next entry to OP ends the latch of the overrun. */
	virtual_bench_fault(&b, "at=0s al-error slave=0 code=0x001a");
	virtual_master_run(&vm, 100);
	wait_for_op(1000);
	virtual_master_run(&vm, 20);
	CHECK_EQ(virtual_master_value(&vm, "a.led"), 1);
	CHECK_EQ(virtual_master_value(&vm, "b.led"), 0);
	close_all();
}

/* --- overrun --- */

TEST(sim_fail_safe, an_overrun_with_policy_stop_sends_fail_safe_values_first)
{
	open_live(2, 5, "cycle.overrun=stop");
	virtual_master_run(&vm, 50);
	in_process_stall(b.host, 3 * PERIOD_NS);
	output_watch_begin(&wire, &vm);
	CHECK_EQ(virtual_master_run(&vm, 20), -ETIME);
	CHECK(wire.live <= 1); /* the frame that was due when it was late */
	CHECK(wire.safe >= 3);
	output_watch_end(&vm);
	close_all();
}
