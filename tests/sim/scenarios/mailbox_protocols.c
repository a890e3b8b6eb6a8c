/* SPDX-License-Identifier: MIT */
/* Every mailbox protocol in OP beside the cycle: no cycle is disturbed, every transfer ends well.
 */
#include <errno.h>

#include "daemon/session_internal.h"
#include "devices/catalogue.h"
#include "devices/fb1111_piccolo.h"
#include "harness/test.h"
#include "mailbox/mailbox.h"
#include "sim/harness/virtual_master.h"
#include "wire/al.h"
#include "wire/esc_reg.h"
#include "wire/foe.h"

enum {
	DRIVE = 1,
	ALL_PROTOCOLS = 0x3f,
	FILE_BYTES = 20000,
	TABLE = 0x8001, /* P-0-0001 */
	TABLE_BYTES = 1204,
	PING_BYTES = 1500,
	REQUESTS = 6,
};

static struct virtual_bench b;
static struct virtual_master vm;
static uint8_t file[FILE_BYTES];
static uint8_t table[TABLE_BYTES];
static uint8_t frame[PING_BYTES];
static uint8_t object[64];
static uint8_t echo[64];

/* A board, and a drive that serves every protocol. */
static int make(int position, struct segment_slave_spec *ret_spec)
{
	static struct slave_model model;

	if (position != DRIVE) {
		return fb1111_piccolo_slave(position, ret_spec);
	}
	CHECK_EQ(catalogue_find("akd", &model), 0);
	model.sii.mailbox_protocols |= ALL_PROTOCOLS;
	return catalogue_slave(&model, position, ret_spec);
}

static void make_requests(struct mailbox_request *rq)
{
	rq[0] = (struct mailbox_request){ .protocol = &foe_protocol,
					  .with.foe = { .operation = FOE_WRITE, .name = "a.bin" },
					  .buffer = file,
					  .capacity = FILE_BYTES };
	rq[1] = (struct mailbox_request){
		.protocol = &soe_protocol,
		.with.soe = { .operation = SOE_READ, .elements = SOE_ELEMENT_VALUE, .idn = TABLE },
		.buffer = table,
		.capacity = TABLE_BYTES
	};
	rq[2] = (struct mailbox_request){ .protocol = &eoe_protocol,
					  .with.eoe = { .operation = EOE_FRAGMENT },
					  .buffer = frame,
					  .capacity = PING_BYTES };
	rq[3] = (struct mailbox_request){ .protocol = &aoe_protocol,
					  .with.aoe = { .command = AOE_READ,
							.group = AOE_GROUP_SDO,
							.offset = aoe_sdo_offset(0x1018, 1) },
					  .buffer = object,
					  .capacity = sizeof(object) };
	rq[4] = (struct mailbox_request){ .protocol = &voe_protocol,
					  .with.voe = { .vendor = 1, .len = sizeof(echo) },
					  .buffer = echo,
					  .capacity = sizeof(echo) };
	rq[5] = (struct mailbox_request){
		.protocol = &coe_protocol,
		.with.coe = { .operation = COE_UPLOAD, .index = 0x1018, .subindex = 2 },
		.buffer = object + 32,
		.capacity = 32
	};
}

static void submit(struct mailbox_request *rq)
{
	rq->slave_pos = DRIVE;
	rq->timeout = (span_t){ 2 * NS_PER_S };
	rq->result = 0;
	CHECK_EQ(mailbox_submit(bus_mailbox(vm.session->bus), rq), 0);
}

TEST(sim_mailbox_protocols, all_of_them_in_op_disturb_no_cycle)
{
	enum { ROUNDS = 3, CYCLES = 4000 };
	struct mailbox_request rq[REQUESTS];
	int64_t phase_idle_ns;

	virtual_bench_init(&b, &(struct virtual_spec){ .slaves = 2, .make = make, .seed = 11 });
	virtual_master_init(&vm, &b, NULL);
	virtual_master_settle(&vm);
	virtual_master_run(&vm, CYCLES);
	phase_idle_ns = vm.result.phase_max_ns;
	virtual_master_forget(&vm);
	for (unsigned round = 0; round < ROUNDS; round++) {
		make_requests(rq);
		for (unsigned i = 0; i < REQUESTS; i++) {
			submit(&rq[i]);
		}
		CHECK_EQ(virtual_master_run(&vm, CYCLES), SESSION_GOES_ON);
		for (unsigned i = 0; i < REQUESTS; i++) {
			CHECK_EQ(rq[i].result, 0);
		}
		CHECK_EQ(rq[0].len, FILE_BYTES);
		CHECK_EQ(rq[1].len, TABLE_BYTES);
		CHECK_EQ(rq[3].len, 4);
		CHECK_EQ(rq[4].len, sizeof(echo));
	}
	virtual_master_check_undisturbed(&vm, (uint64_t)ROUNDS * CYCLES);
	CHECK(vm.result.phase_max_ns <= phase_idle_ns + 2000);
	virtual_master_close(&vm);
}

TEST(sim_mailbox_protocols, all_of_them_are_served_in_safe_op)
{
	static const char *const settings[] = { "bus.target=safeop", NULL };
	struct mailbox_request rq[REQUESTS];

	virtual_bench_init(&b, &(struct virtual_spec){ .slaves = 2, .make = make, .seed = 13 });
	virtual_master_init(&vm, &b, settings);
	CHECK_EQ(virtual_master_bring_up(&vm), 0);
	CHECK_EQ(atomic_load(&session_page(vm.session)->bus_state), BUS_SAFEOP);
	make_requests(rq);
	for (unsigned i = 0; i < REQUESTS; i++) {
		submit(&rq[i]);
	}
	CHECK_EQ(virtual_master_run(&vm, 4000), SESSION_GOES_ON);
	for (unsigned i = 0; i < REQUESTS; i++) {
		CHECK_EQ(rq[i].result, 0);
	}
	CHECK_EQ(rq[0].len, FILE_BYTES);
	CHECK_EQ(rq[1].len, TABLE_BYTES);
	CHECK_EQ(rq[2].len, PING_BYTES);
	CHECK_EQ(rq[3].len, 4);
	CHECK_EQ(rq[4].len, sizeof(echo));
	CHECK_EQ(rq[5].len, 4);
	CHECK_EQ(segment_esc(b.segment, DRIVE)->reg[ESC_REG_AL_STATUS], AL_SAFEOP);
	virtual_master_close(&vm);
}

TEST(sim_mailbox_protocols, a_slave_that_is_busy_for_ever_disturbs_neither_cycle_nor_the_others)
{
	enum { CYCLES = 6000 };
	struct mailbox_request rq[REQUESTS];
	struct sim_device *dev;

	virtual_bench_init(&b, &(struct virtual_spec){ .slaves = 2, .make = make, .seed = 12 });
	virtual_master_init(&vm, &b, NULL);
	virtual_master_settle(&vm);
	dev = segment_device(b.segment, DRIVE);
	CHECK_EQ(dev->ops->io_set(dev, "foe.busy", "-1"), 0);
	make_requests(rq);
	rq[0].with.foe.busy_limit = (span_t){ NS_PER_S };
	for (unsigned i = 0; i < REQUESTS; i++) {
		submit(&rq[i]);
	}
	CHECK_EQ(virtual_master_run(&vm, CYCLES), SESSION_GOES_ON);
	CHECK_EQ(rq[0].result, -ETIMEDOUT);
	for (unsigned i = 1; i < REQUESTS; i++) {
		CHECK_EQ(rq[i].result, 0);
	}
	virtual_master_check_undisturbed(&vm, CYCLES);
	virtual_master_close(&vm);
}
