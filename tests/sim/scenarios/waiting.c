/* SPDX-License-Identifier: MIT */
/* A bus that does not come to OP, or is not to: it stays as far as it came and serves requests. */
#include <errno.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include "base/bytes.h"
#include "harness/test.h"
#include "sim/harness/virtual_master.h"
#include "wire/al.h"

enum { SLAVES = 2 };

static struct virtual_bench b;
static struct virtual_master vm;

static const struct status_page *page(void)
{
	return session_page(vm.session);
}

static struct admin_reply ask_state(uint16_t slave_pos, unsigned state)
{
	struct admin_request rq = { .magic = ADMIN_MAGIC,
				    .verb = ADMIN_STATE,
				    .slave_pos = slave_pos,
				    .argument = { state } };

	return virtual_master_ask(&vm, &rq);
}

static struct admin_reply rescan(void)
{
	struct admin_request rq = { .magic = ADMIN_MAGIC, .verb = ADMIN_RESCAN };

	return virtual_master_ask(&vm, &rq);
}

static int can_read_an_object(void)
{
	struct admin_request rq = {
		.magic = ADMIN_MAGIC, .verb = ADMIN_SDO_READ, .index = 0x1018, .subindex = 1
	};
	struct admin_reply reply = virtual_master_ask(&vm, &rq);

	return reply.result == 0 && get_le32(reply.data) == page()->slave[0].info.vendor;
}

TEST(waiting, a_slave_that_refuses_op_leaves_the_bus_in_safeop_with_the_reason)
{
	virtual_master_init_pair(&vm, &b, NULL, 1);
	virtual_bench_fault(&b, "at=0s refuse slave=1 state=op code=0x001d");
	CHECK(virtual_master_bring_up(&vm) < 0);
	CHECK_EQ(vm.failure.code, EXIT_CODE_STATE);
	CHECK_EQ(session_is_waiting(vm.session), 1);
	CHECK_EQ(page()->bus_state, BUS_SAFEOP);
	CHECK_EQ(page()->bus_target, BUS_OP);
	CHECK_EQ(page()->is_waiting, 1);
	CHECK(strstr(page()->message, "slave 1 (b): refuses OP and is in SAFE-OP") != NULL);
	CHECK(strstr(page()->message, "0x001d") != NULL);
	CHECK_EQ(virtual_master_run(&vm, 500), SESSION_GOES_ON);
	CHECK_EQ(virtual_bench_al_status(&b, 1) & AL_STATE_MASK, AL_SAFEOP);
	CHECK(can_read_an_object());
	/* The cause is removed, and the operator says so. */
	virtual_bench_fault(&b, "at=0s obey slave=1");
	CHECK_EQ(rescan().result, 0);
	CHECK_EQ(page()->bus_state, BUS_OP);
	CHECK_EQ(page()->is_waiting, 0);
	CHECK_STR(page()->message, "");
	CHECK_EQ(virtual_bench_al_status(&b, 1), AL_OP);
	CHECK_EQ(virtual_master_stop(&vm), 0);
	virtual_master_close(&vm);
}

TEST(waiting, a_rescan_that_fails_again_is_answered_with_the_reason)
{
	struct admin_reply reply;

	virtual_master_init_pair(&vm, &b, NULL, 1);
	virtual_bench_fault(&b, "at=0s refuse slave=1 state=safeop code=0x001e");
	CHECK(virtual_master_bring_up(&vm) < 0);
	CHECK_EQ(page()->bus_state, BUS_PREOP);
	reply = rescan();
	CHECK(reply.result < 0);
	CHECK(strstr(reply.text, "slave 1 (b): refuses SAFE-OP") != NULL);
	CHECK_EQ(session_is_waiting(vm.session), 1);
	virtual_master_close(&vm);
}

TEST(waiting, a_bus_without_a_slave_waits_and_is_brought_up_when_one_is_there)
{
	virtual_master_init_pair(&vm, &b, "bus.scan_timeout=1s", 1);
	virtual_bench_fault(&b, "at=0s power-off slave=0");
	CHECK(virtual_master_bring_up(&vm) < 0);
	CHECK_EQ(session_is_waiting(vm.session), 1);
	CHECK_EQ(page()->bus_state, BUS_DOWN);
	CHECK_EQ(page()->slave_count, 0);
	CHECK(strstr(page()->message, "no slave answers") != NULL);
	CHECK_EQ(virtual_master_run(&vm, 100), SESSION_GOES_ON);
	virtual_bench_fault(&b, "at=0s power-on slave=0");
	CHECK_EQ(rescan().result, 0);
	CHECK_EQ(page()->bus_state, BUS_OP);
	virtual_master_close(&vm);
}

TEST(waiting, without_leave_to_wait_everything_is_taken_down)
{
	virtual_bench_init(&b, &(struct virtual_spec){ .slaves = SLAVES, .seed = 5 });
	virtual_master_init(&vm, &b, NULL);
	virtual_bench_fault(&b, "at=0s refuse slave=1 state=op code=0x001d");
	CHECK(virtual_master_bring_up(&vm) < 0);
	CHECK_EQ(session_is_waiting(vm.session), 0);
	CHECK_EQ(page()->bus_state, BUS_DOWN);
	CHECK_EQ(virtual_bench_al_status(&b, 0), AL_INIT);
	virtual_master_close(&vm);
}

TEST(waiting, the_target_is_the_state_where_the_bus_stays)
{
	static const struct {
		const char *setting;
		unsigned al;
		enum bus_state state;
	} targets[] = { { "bus.target=init", AL_INIT, BUS_INIT },
			{ "bus.target=preop", AL_PREOP, BUS_PREOP },
			{ "bus.target=safeop", AL_SAFEOP, BUS_SAFEOP },
			{ "bus.target=op", AL_OP, BUS_OP } };

	for (size_t i = 0; i < sizeof(targets) / sizeof(targets[0]); i++) {
		virtual_master_init_pair(&vm, &b, targets[i].setting, 1);
		CHECK_EQ(virtual_master_bring_up(&vm), 0);
		CHECK_EQ(virtual_master_run(&vm, 1000), SESSION_GOES_ON);
		CHECK_EQ(page()->bus_state, targets[i].state);
		CHECK_EQ(page()->bus_target, targets[i].state);
		CHECK_EQ(page()->is_waiting, 0);
		for (unsigned k = 0; k < SLAVES; k++) {
			CHECK_EQ(virtual_bench_al_status(&b, k), targets[i].al);
			CHECK_EQ(page()->slave[k].al_state, targets[i].al);
		}
		CHECK_EQ(targets[i].al == AL_INIT || can_read_an_object(), 1);
		CHECK_EQ(virtual_master_stop(&vm), 0);
		CHECK_EQ(virtual_bench_al_status(&b, 1), AL_INIT);
		virtual_master_close(&vm);
	}
}

TEST(waiting, all_slaves_are_led_to_the_state_that_a_client_asks_for)
{
	static const unsigned way[] = { AL_OP, AL_PREOP, AL_SAFEOP, AL_INIT, AL_OP };

	virtual_master_init_pair(&vm, &b, "bus.target=preop", 1);
	CHECK_EQ(virtual_master_bring_up(&vm), 0);
	for (size_t i = 0; i < sizeof(way) / sizeof(way[0]); i++) {
		CHECK_EQ(ask_state(ADMIN_ALL_SLAVES, way[i]).result, 0);
		CHECK_EQ(virtual_bench_al_status(&b, 0), way[i]);
		CHECK_EQ(virtual_bench_al_status(&b, 1), way[i]);
		CHECK_EQ(virtual_master_run(&vm, 300), SESSION_GOES_ON);
		CHECK_EQ(virtual_bench_al_status(&b, 1), way[i]);
	}
	CHECK_EQ(ask_state(ADMIN_ALL_SLAVES, AL_BOOT).result, -EINVAL);
	CHECK_EQ(page()->bus_state, BUS_OP);
	virtual_master_close(&vm);
}

TEST(waiting, one_slave_changes_its_state_unless_the_bus_is_in_operation)
{
	struct admin_reply reply;

	virtual_master_init_pair(&vm, &b, "bus.target=preop", 1);
	CHECK_EQ(virtual_master_bring_up(&vm), 0);
	reply = ask_state(1, AL_INIT);
	CHECK_EQ(reply.result, 0);
	CHECK_EQ(reply.data[0], AL_INIT);
	CHECK_EQ(virtual_bench_al_status(&b, 1), AL_INIT);
	CHECK_EQ(virtual_bench_al_status(&b, 0), AL_PREOP);
	CHECK_EQ(virtual_master_run(&vm, 200), SESSION_GOES_ON);
	CHECK_EQ(page()->slave[1].al_state, AL_INIT);
	CHECK_EQ(ask_state(1, AL_PREOP).result, 0);
	reply = ask_state(1, AL_OP); /* INIT or PRE-OP to OP is no transition */
	CHECK_EQ(reply.result, -EIO);
	CHECK(strstr(reply.text, "slave 1 (b): refuses OP and is in PRE-OP") != NULL);
	CHECK_EQ(ask_state(7, AL_PREOP).result, -ENODEV);
	CHECK_EQ(ask_state(ADMIN_ALL_SLAVES, AL_OP).result, 0);
	reply = ask_state(1, AL_PREOP);
	CHECK_EQ(reply.result, -EPERM);
	CHECK_EQ(rescan().result, -EPERM);
	CHECK_EQ(virtual_bench_al_status(&b, 1), AL_OP);
	virtual_master_close(&vm);
}

TEST(waiting, an_error_of_before_is_not_taken_for_a_refusal_of_a_slow_slave)
{
	virtual_master_init_pair(&vm, &b, "bus.target=preop", 1);
	CHECK_EQ(virtual_master_bring_up(&vm), 0);
	CHECK_EQ(ask_state(1, AL_INIT).result, 0);
	CHECK_EQ(ask_state(1, AL_SAFEOP).result, -EIO);
	CHECK_EQ(virtual_bench_al_status(&b, 1), AL_INIT | AL_ERROR);
	virtual_bench_fault(&b, "at=0s slow slave=1 state=preop by=20ms");
	CHECK_EQ(ask_state(1, AL_PREOP).result, 0);
	CHECK_EQ(virtual_bench_al_status(&b, 1), AL_PREOP);
	virtual_master_close(&vm);
}

/* user.md 3 of the first review: OP was shown of slaves that were gone. */
TEST(waiting, no_state_is_shown_of_slaves_whose_frames_do_not_come_back)
{
	virtual_master_init_pair(&vm, &b, NULL, 1);
	virtual_master_settle(&vm);
	CHECK_EQ(virtual_master_run(&vm, 200), SESSION_GOES_ON);
	CHECK_EQ(page()->slave[1].al_state, AL_OP);
	virtual_bench_fault(&b, "at=0s cut slave=0");
	CHECK_EQ(virtual_master_run(&vm, 100), SESSION_GOES_ON);
	CHECK_EQ(page()->slave[0].al_state, 0);
	CHECK_EQ(page()->slave[1].al_state, 0);
	CHECK_EQ(page()->bus_state, BUS_RECOVERING);
	virtual_master_close(&vm);
	/* The same on a bus that is held. */
	virtual_master_init_pair(&vm, &b, "bus.target=preop", 1);
	CHECK_EQ(virtual_master_bring_up(&vm), 0);
	CHECK_EQ(virtual_master_run(&vm, 200), SESSION_GOES_ON);
	CHECK_EQ(page()->slave[1].al_state, AL_PREOP);
	virtual_bench_fault(&b, "at=0s cut slave=0");
	CHECK_EQ(virtual_master_run(&vm, 400), SESSION_GOES_ON);
	CHECK_EQ(page()->slave[1].al_state, 0);
	virtual_master_close(&vm);
}

/* A request that was sent before the bring-up is answered in the middle of it. */
TEST(waiting, a_stop_through_the_socket_ends_a_scan_of_a_minute)
{
	struct sockaddr_un address = { .sun_family = AF_UNIX };
	struct admin_request rq = { .magic = ADMIN_MAGIC,
				    .verb = ADMIN_STATE,
				    .id = 1,
				    .slave_pos = ADMIN_ALL_SLAVES,
				    .argument = { AL_OP } };
	struct admin_reply reply;
	int64_t start_ns;
	int fd = socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0);

	virtual_master_init_pair(&vm, &b, "bus.scan_timeout=60s", 1);
	virtual_bench_fault(&b, "at=0s power-off slave=0");
	snprintf(address.sun_path, sizeof(address.sun_path), "%s/" CONFIG_RUN_ADMIN, vm.dir);
	CHECK_EQ(connect(fd, (const struct sockaddr *)&address, sizeof(address)), 0);
	CHECK_EQ(send(fd, &rq, sizeof(rq), 0), sizeof(rq));
	rq = (struct admin_request){ .magic = ADMIN_MAGIC, .verb = ADMIN_STOP, .id = 2 };
	CHECK_EQ(send(fd, &rq, sizeof(rq), 0), sizeof(rq));
	start_ns = virtual_bench_now_ns(&b);
	CHECK_EQ(virtual_master_bring_up(&vm), -ECANCELED);
	CHECK(virtual_bench_now_ns(&b) - start_ns < NS_PER_S);
	CHECK_EQ(recv(fd, &reply, sizeof(reply), MSG_DONTWAIT), sizeof(reply));
	CHECK_EQ(reply.id, 1);
	CHECK_EQ(reply.result, -EBUSY);
	CHECK_EQ(recv(fd, &reply, sizeof(reply), MSG_DONTWAIT), sizeof(reply));
	CHECK_EQ(reply.id, 2);
	CHECK_EQ(reply.result, 0);
	close(fd);
	virtual_master_close(&vm);
}
