/* SPDX-License-Identifier: MIT */
#include "sim/scenarios/output_watch.h"

#include "base/bytes.h"
#include "harness/test.h"
#include "wire/al.h"
#include "wire/datagram.h"
#include "wire/esc_reg.h"

static void note(struct output_activity *act, int64_t now_ns)
{
	act->first_ns = act->count == 0 ? now_ns : act->first_ns;
	act->newest_ns = now_ns;
	act->count++;
}

static void read_outputs(struct output_watch *watch, const struct ecat_datagram *dg, int64_t now_ns)
{
	if ((dg->data[0] & 1) != 0) {
		watch->live++;
		watch->newest_live_ns = watch->first_safe_ns == 0 ? now_ns : watch->newest_live_ns;
		return;
	}
	watch->safe++;
	watch->first_safe_ns = watch->first_safe_ns == 0 ? now_ns : watch->first_safe_ns;
}

static void read_datagram(struct output_watch *watch, const struct ecat_datagram *dg,
			  int64_t now_ns)
{
	int is_addressed = dg->cmd == ECAT_CMD_FPRD || dg->cmd == ECAT_CMD_FPWR;

	if (dg->cmd == ECAT_CMD_LRW) {
		read_outputs(watch, dg, now_ns);
	} else if (dg->cmd == ECAT_CMD_BRD && dg->ado == ESC_REG_AL_STATUS) {
		watch->first_al_ns = get_le16(dg->data) != AL_OP && watch->first_al_ns == 0
					     ? now_ns
					     : watch->first_al_ns;
	} else if (is_addressed && dg->ado >= ESC_REG_EEPROM_CONFIG &&
		   dg->ado <= ESC_REG_EEPROM_DATA && get_le16(dg->wkc) > 0) {
		note(&watch->eeprom, now_ns);
	} else if (is_addressed && dg->adp == watch->mailbox_station &&
		   dg->ado >= ESC_REG_PROCESS_RAM && get_le16(dg->wkc) > 0) {
		note(&watch->mailbox, now_ns);
	}
}

static void read_frame(struct virtual_master *vm, const uint8_t *frame, size_t len)
{
	int64_t now_ns = virtual_bench_now_ns(vm->bench);
	struct ecat_datagram dg;
	uint8_t copy[1600];
	size_t pos = 0;

	CHECK(len <= sizeof(copy));
	memcpy(copy, frame, len);
	while (ecat_frame_next(copy, len, &pos, &dg) == 1) {
		read_datagram(vm->user, &dg, now_ns);
	}
}

void output_watch_begin(struct output_watch *watch, struct virtual_master *vm)
{
	*watch = (struct output_watch){ .since_ns = virtual_bench_now_ns(vm->bench),
					.mailbox_station = watch->mailbox_station };
	vm->user = watch;
	vm->each_frame = read_frame;
}

void output_watch_end(struct virtual_master *vm)
{
	vm->each_frame = NULL;
}

void output_watch_set(struct virtual_master *vm, const char *channel, uint64_t raw)
{
	struct admin_request rq = { .magic = ADMIN_MAGIC, .verb = ADMIN_SET, .count = 1 };

	snprintf(rq.item[0].channel, sizeof(rq.item[0].channel), "%s", channel);
	rq.item[0].raw = raw;
	CHECK_EQ(virtual_master_ask(vm, &rq).result, 0);
}
