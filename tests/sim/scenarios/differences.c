/* SPDX-License-Identifier: MIT */
/* What is configured against what is found, asked through the admin socket, in every state. */
#include <stdio.h>

#include "base/difference.h"
#include "harness/test.h"
#include "sim/harness/virtual_master.h"

static struct virtual_bench b;
static struct virtual_master vm;

/* Kinds, slaves or outputs, positions: "5:1@-; ". The first ones are in ret. */
static const char *ask(struct difference *ret, size_t room)
{
	static char text[256];
	struct virtual_transfer tr = { .data = NULL };
	struct admin_request rq = { .magic = ADMIN_MAGIC, .verb = ADMIN_COMPARE };
	struct admin_reply reply = virtual_master_transfer(&vm, &rq, &tr);
	size_t used = 0;

	CHECK_EQ(reply.result, 0);
	CHECK_EQ(tr.answer_len % sizeof(struct difference), 0);
	text[0] = '\0';
	for (size_t i = 0; i < tr.answer_len / sizeof(struct difference); i++) {
		struct difference diff;

		memcpy(&diff, tr.answer + i * sizeof(diff), sizeof(diff));
		used += (size_t)snprintf(text + used, sizeof(text) - used, "%u:%d@%d; ", diff.kind,
					 (int16_t)diff.item, (int16_t)diff.position);
		if (i < room) {
			ret[i] = diff;
		}
	}
	return text;
}

static void open_bench(const char *const *settings)
{
	virtual_bench_init(&b, &(struct virtual_spec){ .slaves = 2, .seed = 5 });
	virtual_master_init_waiting(&vm, &b, settings);
}

TEST(differences, a_bus_in_op_that_fits_has_none)
{
	static const char *const settings[] = { "slaves[0].name=a", "slaves[1].name=b",
						"bus.presence=exact", "outputs[0].channel=b.led",
						NULL };

	open_bench(settings);
	virtual_master_settle(&vm);
	CHECK_STR(ask(NULL, 0), "");
	virtual_master_check_undisturbed(&vm, 1);
	virtual_master_close(&vm);
}

TEST(differences, all_are_reported_while_the_bus_waits)
{
	static const char *const settings[] = { "slaves[0].name=a",
						"slaves[0].serial=4711",
						"slaves[1].name=b",
						"slaves[2].name=c",
						"slaves[2].product=0x1234",
						"slaves[3].name=d",
						"slaves[3].optional=true",
						"bus.presence=exact",
						"outputs[0].channel=b.led",
						"outputs[1].channel=x.led",
						NULL };
	struct difference diff[5];

	open_bench(settings);
	CHECK(virtual_master_bring_up(&vm) < 0);
	CHECK_EQ(session_is_waiting(vm.session), 1);
	CHECK_STR(ask(diff, 5), "4:0@0; 1:2@-1; 2:3@-1; 7:1@-1; 8:-1@-1; ");
	CHECK_STR(diff[0].property, "serial");
	CHECK_STR(diff[0].expected, "4711");
	CHECK_STR(diff[1].name, "c");
	CHECK_STR(diff[3].found, "no slave of this name");
	CHECK_EQ(strncmp(diff[4].found, "1 cannot be compared", 20), 0);
	virtual_master_close(&vm);
}

TEST(differences, an_output_that_does_not_exist_is_reported_in_pre_op)
{
	static const char *const settings[] = { "slaves[0].name=a", "outputs[0].channel=a.nope",
						"outputs[1].channel=a.adc", NULL };
	struct difference diff[2];

	open_bench(settings);
	CHECK(virtual_master_bring_up(&vm) < 0);
	CHECK_STR(ask(diff, 2), "7:0@-1; 7:1@-1; ");
	CHECK_STR(diff[0].found, "no channel of this name");
	CHECK_STR(diff[1].found, "an input channel");
	virtual_master_close(&vm);
}

static void list_pdo(size_t at, uint16_t slave_pos, uint16_t index)
{
	vm.cfg.pdo[at] = (struct config_pdo){ .slave_pos = slave_pos, .index = index };
	snprintf(vm.cfg.pdo[at].pdo, sizeof(vm.cfg.pdo[at].pdo), "0x%04x", index);
	vm.cfg.pdo_count = at + 1;
}

TEST(differences, pdos_that_were_not_mapped_yet_are_said_not_to_be_compared)
{
	static const char *const preop[] = { "slaves[0].name=a", "slaves[1].name=b",
					     "bus.target=preop", NULL };
	static const char *const op[] = { "slaves[0].name=a", "slaves[1].name=b", NULL };
	struct difference diff[1];

	open_bench(preop);
	list_pdo(0, 0, 0x1600);
	list_pdo(1, 0, 0x1a00);
	list_pdo(2, 1, 0x1a00);
	CHECK_EQ(virtual_master_bring_up(&vm), 0);
	CHECK_STR(ask(diff, 1), "8:-1@-1; ");
	CHECK_STR(diff[0].name, "slaves[].pdos");
	CHECK_STR(diff[0].found, "2 cannot be compared: process data are mapped on the way from "
				 "PRE-OP to SAFE-OP");
	CHECK(difference_is_note(&diff[0]));
	virtual_master_close(&vm);
	open_bench(op);
	list_pdo(0, 0, 0x1600);
	virtual_master_settle(&vm);
	CHECK_STR(ask(NULL, 0), "");
	virtual_master_close(&vm);
}

TEST(differences, without_any_slave_all_are_missing)
{
	static const char *const settings[] = { "slaves[0].name=a", "slaves[1].name=b",
						"bus.scan_timeout=1s", NULL };

	open_bench(settings);
	virtual_bench_fault(&b, "at=0s power-off slave=0");
	CHECK(virtual_master_bring_up(&vm) < 0);
	CHECK_STR(ask(NULL, 0), "1:0@-1; 1:1@-1; ");
	virtual_master_close(&vm);
}

TEST(differences, a_slave_that_is_lost_in_op_is_one)
{
	static const char *const settings[] = { "slaves[0].name=a", "slaves[1].name=b", NULL };

	open_bench(settings);
	virtual_master_settle(&vm);
	virtual_bench_fault(&b, "at=0s power-off slave=1");
	CHECK_EQ(virtual_master_run(&vm, 2000), SESSION_GOES_ON);
	CHECK_STR(ask(NULL, 0), "6:1@1; ");
	virtual_master_close(&vm);
}
