/* SPDX-License-Identifier: MIT */
/* Service frames between the cycles' frames: they never delay the next of those. */
#include <errno.h>
#include <stdlib.h>

#include "harness/test.h"
#include "link/line.h"
#include "sim/harness/virtual_master.h"
#include "wire/datagram.h"

enum {
	SLAVES = 16,
	PERIOD_US = 250,
	LATE_EVERY = 50, /* cycles */
	LATE_NS = 100000,
	CYCLES = 10000,
	MAILBOX_BYTES = 1024,
};

static struct virtual_bench b;
static struct virtual_master vm;

static struct {
	int is_busy; /* the mailbox slot is never empty */
	unsigned step;
	unsigned to_next; /* cycles until the one after a late one */
	unsigned answered;
	unsigned failed;
	int64_t late_ns; /* worst phase error of late cycles */
	int64_t next_ns; /* worst phase error of those after them */
} seen;

static void keep_slot_busy(struct line *line)
{
	static const uint8_t source[6] = { 0x10, 0x10, 0x10, 0x10, 0x10, 0x10 };
	uint8_t frame[LIMIT_FRAME_BYTES];
	struct ecat_frame_builder fb;
	int r = line_collect(line, LINE_MAILBOX, frame, sizeof(frame));

	if (r == -EAGAIN) {
		return;
	}
	seen.answered += r > 0;
	seen.failed += r < 0 && r != -ENOENT;
	ecat_frame_begin(&fb, frame, source);
	ecat_frame_add(&fb, ECAT_CMD_FPRD, 1, 0x1001, 0x1000, MAILBOX_BYTES);
	CHECK_EQ(line_submit(line, LINE_MAILBOX, frame, ecat_frame_end(&fb)), 0);
}

static struct sample_header newest(const struct virtual_master *master)
{
	static uint8_t payload[sizeof(struct sample_header) + LIMIT_IMAGE_BYTES];
	struct sample_header h;

	CHECK_EQ(ring_peek_newest(master->samples, payload, sizeof(payload)), RING_OK);
	memcpy(&h, payload, offsetof(struct sample_header, slaves_bad));
	return h;
}

static void each_cycle(struct virtual_master *master)
{
	struct sample_header h = newest(master);
	int64_t period_ns = PERIOD_US * NS_PER_US;
	int64_t off_ns =
		h.frame_dc_ns > 0 ? llabs((int64_t)h.frame_dc_ns % period_ns - period_ns / 2) : 0;

	if (seen.is_busy) {
		keep_slot_busy(line_bound());
	}
	if (seen.to_next == 2) {
		seen.late_ns = off_ns > seen.late_ns ? off_ns : seen.late_ns;
	} else if (seen.to_next == 1) {
		seen.next_ns = off_ns > seen.next_ns ? off_ns : seen.next_ns;
	}
	seen.to_next -= seen.to_next > 0;
	if (++seen.step % LATE_EVERY == 0) {
		in_process_stall(master->bench->host, LATE_NS);
		seen.to_next = 2;
	}
}

static void run_with_late_wakes(int is_busy)
{
	const char *const settings[] = { "cycle.period=250us", "bus.datagrams=one", NULL };

	memset(&seen, 0, sizeof(seen));
	virtual_bench_init(&b, &(struct virtual_spec){ .slaves = SLAVES, .seed = 5 });
	virtual_master_init(&vm, &b, settings);
	virtual_master_settle(&vm);
	seen.is_busy = is_busy;
	vm.each_cycle = each_cycle;
	virtual_master_run(&vm, CYCLES);
	CHECK_EQ(atomic_load(&session_page(vm.session)->cycle.frames_lost), 0);
	virtual_master_close(&vm);
}

TEST(sim_service_frames, a_full_mailbox_slot_does_not_delay_the_frame_after_a_late_wake)
{
	int64_t idle_ns;

	run_with_late_wakes(0);
	idle_ns = seen.next_ns;
	CHECK(seen.late_ns > LATE_NS / 2);
	CHECK(idle_ns > 0 && idle_ns < 15000); /* the session's own service frames */
	run_with_late_wakes(1);
	printf("frame after a late wake: off by %lld ns at most, %lld ns with %u service frames\n",
	       (long long)idle_ns, (long long)seen.next_ns, seen.answered);
	CHECK_EQ(seen.failed, 0);
	CHECK(seen.answered > CYCLES / 3);
	CHECK(seen.next_ns <= idle_ns + 2000);
}
