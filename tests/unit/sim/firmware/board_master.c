/* SPDX-License-Identifier: MIT */
/* The master's side of the board. */
#include "base/bytes.h"
#include "board.h"
#include "harness/test.h"
#include "wire/al.h"
#include "wire/esc_reg.h"

enum { SM0 = 0x1000, SM1 = 0x1080, SM2 = 0x1100, TYPE_COE = 3 };

static void set_sm(struct board *b, unsigned sm, uint16_t start, uint16_t len, uint8_t control)
{
	uint8_t *reg = b->memory + ESC_REG_SM + 8 * sm;

	put_le16(reg, start);
	put_le16(reg + 2, len);
	reg[4] = control;
	reg[6] = 1;
	b->al_event |= 0x0010;
}

void board_master_mailbox_sms(struct board *b)
{
	set_sm(b, 0, SM0, 128, 0x26);
	set_sm(b, 1, SM1, 128, 0x22);
}

void board_master_process_data(struct board *b)
{
	set_sm(b, 2, SM2, 9, 0x64);
	set_sm(b, 3, 0x1180, 13, 0x20);
}

void board_master_sync0(struct board *b, uint32_t cycle_ns)
{
	b->memory[ESC_REG_DC_CYCLIC_CONTROL] = 0;
	b->memory[ESC_REG_DC_ACTIVATION] = 3;
	put_le32(b->memory + ESC_REG_DC_SYNC0_CYCLE, cycle_ns);
}

void board_master_give_sync(struct board *b)
{
	b->memory[ESC_REG_DC_CYCLIC_CONTROL] = 1;
	b->memory[ESC_REG_DC_ACTIVATION] = 0;
}

uint16_t board_al_status(const struct board *b)
{
	return get_le16(b->memory + ESC_REG_AL_STATUS);
}

uint16_t board_al_code(const struct board *b)
{
	return get_le16(b->memory + ESC_REG_AL_STATUS_CODE);
}

uint16_t board_master_request(struct board *b, uint16_t control)
{
	put_le16(b->memory + ESC_REG_AL_CONTROL, control);
	b->al_event |= 0x0001;
	board_run(b, 3000);
	return board_al_status(b);
}

void board_master_outputs(struct board *b, uint8_t led, uint64_t oneshot_ns)
{
	b->memory[SM2] = led;
	put_le64(b->memory + SM2 + 1, oneshot_ns);
	b->memory[ESC_REG_WATCHDOG_STATUS_PD] = 1;
	b->al_event |= 0x0400;
}

void board_master_watchdog_expires(struct board *b)
{
	b->memory[ESC_REG_WATCHDOG_STATUS_PD] = 0;
}

void board_set_dc_time(struct board *b, uint64_t now_ns)
{
	put_le64(b->memory + ESC_REG_DC_SYSTEM_TIME, now_ns);
}

static void lead_from_preop(struct board *b, enum piccolo_state state)
{
	if (state == PICCOLO_PREOP) {
		return;
	}
	CHECK_EQ(board_master_request(b, AL_SAFEOP), AL_SAFEOP);
	if (state == PICCOLO_SAFEOP) {
		return;
	}
	board_master_outputs(b, 0, 0);
	if (b->fw.mode == PICCOLO_PERIODIC) {
		board_sync0(b, 1000000);
	}
	CHECK_EQ(board_master_request(b, AL_OP), AL_OP);
}

static void lead_to_preop(struct board *b)
{
	board_init(b);
	board_start(b);
	board_master_mailbox_sms(b);
	CHECK_EQ(board_master_request(b, AL_PREOP), AL_PREOP);
	board_master_process_data(b);
}

void board_lead_to(struct board *b, enum piccolo_state state)
{
	lead_to_preop(b);
	board_master_sync0(b, 1000000);
	lead_from_preop(b, state);
}

void board_lead_to_oneshot(struct board *b, enum piccolo_state state)
{
	lead_to_preop(b);
	board_master_give_sync(b);
	CHECK_EQ(board_sdo_write(b, 0x8000, 1, PICCOLO_ONESHOT, 1), 0);
	lead_from_preop(b, state);
}

/* --- mailbox --- */

void board_mailbox_put(struct board *b, uint8_t type, uint8_t counter, const uint8_t *data,
		       size_t len)
{
	uint8_t *box = b->memory + SM0;

	CHECK(!b->is_sm0_full);
	memset(box, 0xaa, 128);
	put_le16(box, (uint16_t)len);
	put_le16(box + 2, 0);
	box[4] = 0;
	box[5] = (uint8_t)(type | counter << 4);
	memcpy(box + 6, data, len > 122 ? 122 : len);
	b->is_sm0_full = 1;
	b->al_event |= 0x0100;
}

int board_mailbox_take(struct board *b, uint8_t *ret_mailbox)
{
	for (unsigned i = 0; i < 500 && !b->is_sm1_full; i++) {
		board_run(b, 100);
	}
	if (!b->is_sm1_full) {
		return -1;
	}
	memcpy(ret_mailbox, b->memory + SM1, 128);
	b->is_sm1_full = 0;
	return 0;
}

static void exchange(struct board *b, const uint8_t *request, size_t len, uint8_t *answer)
{
	b->master_counter = b->master_counter % 7 + 1;
	board_mailbox_put(b, TYPE_COE, (uint8_t)b->master_counter, request, len);
	CHECK_EQ(board_mailbox_take(b, answer), 0);
	CHECK_EQ(answer[5] & 0x0f, TYPE_COE);
}

static uint32_t abort_of(const uint8_t *coe)
{
	if (coe[2] != 0x80) {
		return 0;
	}
	CHECK_EQ(coe[1] >> 4, 2); /* slave-facts: an abort is service 2 */
	return get_le32(coe + 6);
}

uint32_t board_sdo_read(struct board *b, uint16_t index, uint8_t subindex, uint8_t *ret_data,
			size_t *ret_len)
{
	uint8_t request[10] = { 0x00, 0x20, 0x40, 0, 0, subindex };
	uint8_t answer[128];
	const uint8_t *coe = answer + 6;
	uint32_t abort;

	put_le16(request + 3, index);
	exchange(b, request, sizeof(request), answer);
	CHECK_EQ(get_le16(coe + 3), index);
	CHECK_EQ(coe[5], subindex);
	abort = abort_of(coe);
	if (abort != 0) {
		return abort;
	}
	CHECK_EQ(coe[1] >> 4, 3);
	CHECK_EQ(coe[2] & 0xe1, 0x41);
	if (coe[2] & 0x02) {
		*ret_len = 4u - (coe[2] >> 2 & 3u);
		CHECK_EQ(get_le16(answer), 10);
		memcpy(ret_data, coe + 6, *ret_len);
	} else {
		*ret_len = get_le32(coe + 6);
		CHECK_EQ(get_le16(answer), 10 + *ret_len);
		memcpy(ret_data, coe + 10, *ret_len);
	}
	return 0;
}

uint32_t board_sdo_write(struct board *b, uint16_t index, uint8_t subindex, uint32_t value,
			 size_t len)
{
	uint8_t request[10] = { 0x00, 0x20, 0, 0, 0, subindex };
	uint8_t answer[128];

	request[2] = (uint8_t)(0x23 | (4 - len) << 2);
	put_le16(request + 3, index);
	put_le32(request + 6, value);
	exchange(b, request, sizeof(request), answer);
	if (abort_of(answer + 6) == 0) {
		CHECK_EQ(answer[6 + 2], 0x60);
		CHECK_EQ(answer[6 + 1] >> 4, 3);
	}
	return abort_of(answer + 6);
}
