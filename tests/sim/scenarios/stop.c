/* SPDX-License-Identifier: MIT */
/*
 * An ordered stop takes less than a second of bus time, whatever the time-outs are and whatever is
 * broken; and a stop request ends every step of the bring-up.
 */
#include <errno.h>
#include <sys/socket.h>
#include <unistd.h>

#include "base/admin_protocol.h"
#include "harness/test.h"
#include "sim/harness/virtual_master.h"
#include "wire/al.h"

enum { SLAVES = 2, RUN_CYCLES = 1000 };

static struct virtual_bench b;
static struct virtual_master vm;

/* Stop; it must take less than a second, and reaches INIT in the slaves of @reachable (bits). */
static int stop_in_time(unsigned reachable)
{
	int64_t start_ns = virtual_bench_now_ns(&b);
	int r;

	session_stop_ask(vm.session);
	r = virtual_master_stop(&vm);
	CHECK(virtual_bench_now_ns(&b) - start_ns < NS_PER_S);
	for (unsigned i = 0; i < SLAVES; i++) {
		if ((reachable >> i & 1) != 0) {
			CHECK_EQ(virtual_bench_al_status(&b, i), AL_INIT);
		}
	}
	return r;
}

/* In OP for a second with @fault, then stopped. */
static int run_and_stop(const char *setting, const char *fault, unsigned reachable)
{
	int r;

	virtual_master_init_pair(&vm, &b, setting, 0);
	virtual_master_settle(&vm);
	if (fault != NULL) {
		virtual_bench_fault(&b, fault);
	}
	virtual_master_run(&vm, RUN_CYCLES);
	r = stop_in_time(reachable);
	virtual_master_close(&vm);
	return r;
}

TEST(stop, a_healthy_bus_is_in_init_within_a_second)
{
	CHECK_EQ(run_and_stop("bus.op_timeout=10s", NULL, 3), 0);
}

TEST(stop, a_slave_without_power_is_not_waited_for)
{
	CHECK(run_and_stop("bus.op_timeout=120s", "at=0s power-off slave=1", 1) < 0);
	CHECK_STR(vm.failure.text, "slave 1 (b): does not answer on the way to SAFE-OP");
}

TEST(stop, a_cable_that_is_out_is_not_waited_for)
{
	CHECK(run_and_stop("bus.op_timeout=120s", "at=0s cut slave=0", 0) < 0);
	CHECK_STR(vm.failure.text, "no frame returns on the way to SAFE-OP");
}

TEST(stop, frame_timeouts_of_a_slow_network_do_not_add_up)
{
	CHECK(run_and_stop("bus.frame_timeout=100ms", "at=0s cut slave=0", 0) < 0);
}

TEST(stop, a_dead_mailbox_with_a_request_in_it_is_not_waited_for)
{
	struct admin_request rq = { .magic = ADMIN_MAGIC,
				    .verb = ADMIN_SDO_READ,
				    .id = 1,
				    .slave_pos = 1,
				    .index = 0x1018,
				    .subindex = 1 };
	int fd;

	virtual_master_init_pair(&vm, &b, "bus.mailbox_timeout=60s", 0);
	virtual_master_settle(&vm);
	fd = virtual_master_connect(&vm);
	virtual_bench_fault(&b, "at=0s mailbox-stuck slave=1 for=100s");
	CHECK_EQ(send(fd, &rq, sizeof(rq), 0), sizeof(rq));
	virtual_master_run(&vm, RUN_CYCLES);
	CHECK(recv(fd, &rq, sizeof(rq), MSG_DONTWAIT | MSG_PEEK) < 0); /* it still waits */
	CHECK_EQ(stop_in_time(3), 0);
	close(fd);
	virtual_master_close(&vm);
}

/* A stop request @after_ns into the bring-up. */
static int64_t asked_at_ns;

static int64_t ask_later(int64_t after_ns, const char *setting, const char *fault)
{
	int64_t end_ns;

	virtual_master_init_pair(&vm, &b, setting, 0);
	if (fault != NULL) {
		virtual_bench_fault(&b, fault);
	}
	asked_at_ns = virtual_bench_now_ns(&b) + after_ns;
	vm.stop_at_ns = asked_at_ns;
	CHECK_EQ(virtual_master_bring_up(&vm), -ECANCELED);
	end_ns = virtual_bench_now_ns(&b);
	CHECK_EQ(vm.failure.code, EXIT_CODE_OK);
	CHECK_STR(vm.failure.text, "bring-up: stop requested before OP was reached");
	CHECK(end_ns >= asked_at_ns);
	return end_ns - asked_at_ns;
}

TEST(stop, a_scan_of_an_empty_wire_ends_at_once)
{
	CHECK(ask_later(0, "bus.scan_timeout=60s", "at=0s power-off slave=0") < NS_PER_S);
	virtual_master_close(&vm);
	CHECK(ask_later(20 * NS_PER_S, "bus.scan_timeout=60s", "at=0s power-off slave=0") <
	      NS_PER_S);
	virtual_master_close(&vm);
}

/* Every 20 ms of a bring-up: the slaves end in INIT. */
TEST(stop, every_step_of_the_bring_up_ends_at_once_and_in_init)
{
	const char *const burst = "dc.burst_frames=1000000";
	int64_t whole_ns;

	virtual_master_init_pair(&vm, &b, NULL, 0);
	CHECK_EQ(virtual_master_bring_up(&vm), 0);
	whole_ns = vm.op_ns;
	virtual_master_close(&vm);
	for (int64_t at_ns = 0; at_ns < whole_ns - NS_PER_MS; at_ns += 20 * NS_PER_MS) {
		CHECK(ask_later(at_ns, NULL, NULL) < NS_PER_S);
		for (unsigned i = 0; i < SLAVES; i++) {
			CHECK_EQ(virtual_bench_al_status(&b, i), AL_INIT);
		}
		virtual_master_close(&vm);
	}
	/* A clock that does not come near keeps the burst going. */
	CHECK(ask_later(2 * NS_PER_S, burst, "at=100ms drift slave=1 ppm=1000") < NS_PER_S);
	CHECK_EQ(atomic_load(&session_page(vm.session)->cycle.cycles), 0);
	CHECK_EQ(virtual_bench_al_status(&b, 1), AL_INIT);
	virtual_master_close(&vm);
}

TEST(stop, waiting_for_a_state_that_does_not_come_ends_at_once)
{
	CHECK(ask_later(10 * NS_PER_S, "bus.op_timeout=120s",
			"at=0s slow slave=1 state=safeop by=60s") < NS_PER_S);
	CHECK_EQ(virtual_bench_al_status(&b, 0), AL_INIT);
	virtual_master_close(&vm);
}
