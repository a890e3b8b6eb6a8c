/* SPDX-License-Identifier: MIT */
/*
 * The time to fail-safe outputs while the service thread is as busy as it can be, all at the same
 * time: an SDO to a mailbox that does not answer, an FoE transfer to another slave, a read of that
 * slave's whole EEPROM, and the identification of a device that was plugged in.
 */
#include <sys/socket.h>
#include <unistd.h>

#include "base/bytes.h"
#include "base/prng.h"
#include "daemon/session_internal.h"
#include "devices/fb1111_piccolo.h"
#include "harness/test.h"
#include "mailbox/mailbox.h"
#include "sim/scenarios/output_watch.h"
#include "wire/foe.h"
#include "wire/sii.h"

enum {
	PERIOD_NS = 1000000,
	BUSES = 70,
	FALLS = 3, /* of each: every slave once, a second fall is not recovered at once */
	TRIALS = BUSES * FALLS,
	SLAVES = 4,
	DEAF = 1,
	DRIVE = 2,
	GUEST = 3, /* not there at the bring-up */
	DRIVE_STATION = 0x1001 + DRIVE,
	FILE_BYTES = 1 << 20,
	POLL_CYCLES = 110, /* the service thread looks at the bus once in less */
	BACK_MS = 1000,
};

/* The frame that shows the fall is at most one period behind it, the first with fail-safe outputs
 * one more. Beside that: the way of a frame, and what the host wakes up later than in the cycle
 * before. */
#define LIMIT_NS (2 * PERIOD_NS + 60000)

static struct virtual_bench b;
static struct virtual_master vm;
static struct output_watch watch;
static uint8_t file[FILE_BYTES];
static uint8_t object[8];
static struct mailbox_request foe;
static struct mailbox_request sdo;
static int admin;

static int make(int position, struct segment_slave_spec *ret_spec)
{
	return position == DRIVE ? virtual_bench_slave("akd", position, ret_spec)
				 : fb1111_piccolo_slave(position, ret_spec);
}

static void submit(struct mailbox_request *rq)
{
	rq->timeout = (span_t){ 3 * NS_PER_S };
	rq->result = 0;
	CHECK_EQ(mailbox_submit(bus_mailbox(vm.session->bus), rq), 0);
}

static void open_bus(uint64_t seed)
{
	static const char *const settings[] = { "slaves[0].name=a", "slaves[1].name=b",
						"slaves[2].name=drive", NULL };

	virtual_bench_init(
		&b, &(struct virtual_spec){
			    .slaves = SLAVES, .make = make, .seed = seed, .ppm = { 30, -40, 20 } });
	put_le32(segment_esc(b.segment, GUEST)->sii + SII_VENDOR_BYTE, UINT32_MAX);
	virtual_bench_fault(&b, "at=0s unplug slave=3");
	virtual_master_init(&vm, &b, settings);
	virtual_master_settle(&vm);
	output_watch_set(&vm, "a.led", 1);
}

static void close_bus(void)
{
	close(admin);
	mailbox_cancel(bus_mailbox(vm.session->bus), &foe);
	mailbox_cancel(bus_mailbox(vm.session->bus), &sdo);
	virtual_master_close(&vm);
}

static void make_busy(void)
{
	static const struct admin_request read_sii = { .magic = ADMIN_MAGIC,
						       .verb = ADMIN_SII_READ,
						       .slave_pos = DRIVE };

	foe = (struct mailbox_request){ .protocol = &foe_protocol,
					.slave_pos = DRIVE,
					.with.foe = { .operation = FOE_WRITE, .name = "a.bin" },
					.buffer = file,
					.capacity = sizeof(file) };
	sdo = (struct mailbox_request){
		.protocol = &coe_protocol,
		.slave_pos = DEAF,
		.with.coe = { .operation = COE_UPLOAD, .index = 0x1018, .subindex = 1 },
		.buffer = object,
		.capacity = sizeof(object)
	};
	virtual_bench_fault(&b, "at=0s mailbox-stuck slave=1");
	submit(&foe);
	submit(&sdo);
	admin = virtual_master_connect(&vm);
	CHECK_EQ(send(admin, &read_sii, sizeof(read_sii), 0), sizeof(read_sii));
	virtual_bench_fault(&b, "at=0s plug slave=3");
	virtual_master_run(&vm, 50);
}

static void check_live(void)
{
	const struct cycle_stats *st = &session_page(vm.session)->cycle;

	for (unsigned ms = 0; atomic_load(&st->is_fail_safe); ms++) {
		if (ms == BACK_MS) {
			virtual_master_print_events(&vm, 20);
			test_fail(__FILE__, __LINE__, "outputs not live again after %u ms", ms);
		}
		CHECK_EQ(virtual_master_run(&vm, 1), SESSION_GOES_ON);
	}
}

/* It began before the fall and went on behind the first fail-safe frame. */
static void check_busy(const struct output_activity *act, int64_t fall_ns)
{
	CHECK(act->count > 0);
	CHECK(act->first_ns < fall_ns);
	CHECK(act->newest_ns > watch.first_safe_ns);
}

/* From a slave's fall out of OP, at any moment of a cycle, to the first frame with fail-safe
 * outputs. */
static int64_t fall(unsigned slave, struct prng *prng)
{
	int64_t after_ns =
		POLL_CYCLES * PERIOD_NS + (int64_t)prng_below(prng, POLL_CYCLES * PERIOD_NS);
	struct admin_reply reply;
	char line[80];

	check_live();
	output_watch_begin(&watch, &vm);
	snprintf(line, sizeof(line), "at=%lldns al-error slave=%u code=0x001a", (long long)after_ns,
		 slave);
	virtual_bench_fault(&b, line);
	virtual_master_run(&vm, (uint64_t)(after_ns / PERIOD_NS) + POLL_CYCLES);
	output_watch_end(&vm);
	CHECK(watch.live >= (uint64_t)(after_ns / PERIOD_NS) - 1);
	CHECK(watch.safe > 0);
	CHECK(watch.newest_live_ns < watch.first_safe_ns);
	check_busy(&watch.mailbox, watch.since_ns + after_ns);
	check_busy(&watch.eeprom, watch.since_ns + after_ns);
	while (recv(admin, &reply, sizeof(reply), MSG_DONTWAIT) > 0) {
		CHECK_EQ(reply.kind, ADMIN_REPLY_PROGRESS); /* the read goes on */
	}
	CHECK(mailbox_is_running(&foe));
	CHECK(mailbox_is_running(&sdo));
	return watch.first_safe_ns - (watch.since_ns + after_ns);
}

static int by_size(const void *a, const void *b2)
{
	int64_t x = *(const int64_t *)a;
	int64_t y = *(const int64_t *)b2;

	return x < y ? -1 : x > y;
}

TEST(sim_fail_safe_busy, sdo_foe_eeprom_and_a_new_device_at_once_do_not_delay_safe_outputs)
{
	static int64_t took_ns[TRIALS];
	struct prng prng = { 20 };

	watch.mailbox_station = DRIVE_STATION;
	for (unsigned bus = 0; bus < BUSES; bus++) {
		open_bus(bus + 1);
		make_busy();
		for (unsigned i = 0; i < FALLS; i++) {
			took_ns[bus * FALLS + i] = fall((bus + i) % FALLS, &prng);
		}
		close_bus();
	}
	qsort(took_ns, TRIALS, sizeof(took_ns[0]), by_size);
	printf("a slave leaves OP during an SDO to a dead mailbox, an FoE transfer, an EEPROM read "
	       "and the identification of a new device: fail-safe outputs on the wire after min "
	       "%.3f, "
	       "median %.3f, 99 %% %.3f, max %.3f ms (%d trials, period 1 ms)\n",
	       (double)took_ns[0] * 1e-6, (double)took_ns[TRIALS / 2] * 1e-6,
	       (double)took_ns[TRIALS * 99 / 100] * 1e-6, (double)took_ns[TRIALS - 1] * 1e-6,
	       TRIALS);
	/* The frame that shows it is still a live one: never less than the way to the next. */
	CHECK(took_ns[0] > PERIOD_NS * 9 / 10);
	CHECK(took_ns[TRIALS - 1] <= LIMIT_NS);
}
