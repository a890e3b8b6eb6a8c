/* SPDX-License-Identifier: MIT */
#include "bus/exchange_frame.h"

#include <assert.h>
#include <errno.h>
#include <string.h>

#include "base/bytes.h"
#include "wire/datagram.h"
#include "wire/echo.h"
#include "wire/esc_reg.h"

enum {
	HEADERS = ECAT_ETHERNET_BYTES + ECAT_FRAME_HEADER_BYTES,
	OVERHEAD = EXCHANGE_OVERHEAD,
	LENGTH_MASK = 0x07ff,
};

static_assert(OVERHEAD == ECAT_DATAGRAM_HEADER_BYTES + ECAT_WKC_BYTES, "wire/datagram.h");

/* As SOEM sends, so that captures look alike; bit 0x02 of the first octet must be clear. */
static const uint8_t source[6] = { 0x10, 0x10, 0x10, 0x10, 0x10, 0x10 };

static int has_monitor(const struct exchange_plan *plan, unsigned number)
{
	return number == 0 && plan->monitor;
}

static int has_dc(const struct exchange_plan *plan, unsigned number)
{
	return number == 0 && plan->dc_reference != 0;
}

static int has_mailboxes(const struct exchange_plan *plan, unsigned number)
{
	return number == 0 && plan->mailbox_bits > 0;
}

/* Two index bytes are needed for the sequence: a lone datagram gets a NOP as companion. */
static int needs_nop(const struct exchange_plan *plan, unsigned number)
{
	return !has_dc(plan, number) && !has_monitor(plan, number) && !has_mailboxes(plan, number);
}

uint32_t exchange_frame_capacity(const struct exchange_plan *plan, unsigned number)
{
	uint32_t taken = HEADERS + OVERHEAD;

	if (has_dc(plan, number)) {
		taken += OVERHEAD + EXCHANGE_DC_BYTES;
	}
	if (has_monitor(plan, number)) {
		taken += OVERHEAD + EXCHANGE_AL_BYTES + OVERHEAD + EXCHANGE_DIFF_BYTES;
	}
	if (has_mailboxes(plan, number)) {
		taken += OVERHEAD + exchange_mailbox_bytes(plan);
	}
	if (needs_nop(plan, number)) {
		taken += OVERHEAD + EXCHANGE_NOP_BYTES;
	}
	return ECAT_FRAME_MAX_BYTES - taken;
}

static enum ecat_cmd command_of(const struct exchange_plan *plan, unsigned chunk)
{
	switch ((enum exchange_kind)plan->chunk_kind[chunk]) {
	case EXCHANGE_LRW:
		return ECAT_CMD_LRW;
	case EXCHANGE_LWR:
		return ECAT_CMD_LWR;
	case EXCHANGE_LRD:
		return ECAT_CMD_LRD;
	}
	assert(0 && "unreachable exchange_kind");
	return ECAT_CMD_NOP;
}

static size_t add(struct exchange_frame *ef, struct ecat_frame_builder *fb, enum ecat_cmd cmd,
		  uint32_t address, uint16_t data_len)
{
	uint8_t *data =
		ecat_frame_add(fb, cmd, 0, (uint16_t)address, (uint16_t)(address >> 16), data_len);
	size_t at;

	if (data == NULL) {
		return 0;
	}
	at = (size_t)(data - ef->bytes) - ECAT_DATAGRAM_HEADER_BYTES;
	if (ef->datagram_count < EXCHANGE_NUMBERED) {
		ef->datagram[ef->datagram_count] = at;
	}
	ef->datagram_count++;
	return at;
}

static uint32_t register_address(uint16_t station, uint16_t reg)
{
	return (uint32_t)reg << 16 | station;
}

/* The chunks that frame @number carries. The bytes they take of its capacity; UINT32_MAX: too
 * many. */
static uint32_t list_parts(const struct exchange_plan *plan, unsigned number,
			   struct exchange_frame *ef)
{
	uint32_t offset = 0;
	uint32_t taken = 0;

	for (unsigned i = 0; i < plan->chunk_count; i++) {
		if (plan->chunk_frame[i] == number) {
			if (ef->part_count == EXCHANGE_PARTS) {
				return UINT32_MAX;
			}
			taken += (ef->part_count > 0 ? OVERHEAD : 0) + plan->chunk_bytes[i];
			ef->part[ef->part_count++] = (struct exchange_part){
				.offset = offset, .len = plan->chunk_bytes[i], .chunk = i
			};
		}
		offset += plan->chunk_bytes[i];
	}
	return taken;
}

size_t exchange_frame_bytes(const struct exchange_plan *plan, unsigned number)
{
	/* What is not capacity is there anyway; no process data at all: nor is its datagram. */
	size_t bytes = ECAT_FRAME_MAX_BYTES - exchange_frame_capacity(plan, number) - OVERHEAD;
	unsigned parts = 0;

	for (unsigned i = 0; i < plan->chunk_count; i++) {
		if (plan->chunk_frame[i] == number) {
			bytes += OVERHEAD + plan->chunk_bytes[i];
			parts++;
		}
	}
	if (parts > 1 && needs_nop(plan, number)) {
		bytes -= OVERHEAD + EXCHANGE_NOP_BYTES;
	}
	return bytes < ECAT_FRAME_MIN_BYTES ? ECAT_FRAME_MIN_BYTES : bytes;
}

int exchange_frame_build(const struct exchange_plan *plan, unsigned number,
			 struct exchange_frame *ret)
{
	struct ecat_frame_builder fb;
	memset(ret, 0, sizeof(*ret));
	if (list_parts(plan, number, ret) > exchange_frame_capacity(plan, number)) {
		return -E2BIG;
	}
	ecat_frame_begin(&fb, ret->bytes, source);
	for (unsigned i = 0; i < ret->part_count; i++) {
		struct exchange_part *part = &ret->part[i];

		part->at = add(ret, &fb, command_of(plan, part->chunk),
			       plan->logical_start + part->offset, (uint16_t)part->len);
	}
	if (has_dc(plan, number)) {
		ret->dc = add(ret, &fb, ECAT_CMD_FRMW,
			      register_address(plan->dc_reference, ESC_REG_DC_SYSTEM_TIME),
			      EXCHANGE_DC_BYTES);
	}
	if (has_monitor(plan, number)) {
		ret->al = add(ret, &fb, ECAT_CMD_BRD, register_address(0, ESC_REG_AL_STATUS),
			      EXCHANGE_AL_BYTES);
		ret->diff =
			add(ret, &fb, ECAT_CMD_BRD,
			    register_address(0, ESC_REG_DC_SYSTEM_TIME_DIFF), EXCHANGE_DIFF_BYTES);
	}
	if (has_mailboxes(plan, number)) {
		ret->mailboxes =
			add(ret, &fb, ECAT_CMD_LRD, plan->logical_start + plan->image_bytes,
			    (uint16_t)exchange_mailbox_bytes(plan));
	}
	while (ret->datagram_count < 2) {
		add(ret, &fb, ECAT_CMD_NOP, 0, EXCHANGE_NOP_BYTES);
	}
	ret->len = ecat_frame_end(&fb);
	return 0;
}

void exchange_frame_number(struct exchange_frame *ef, uint16_t sequence)
{
	ef->bytes[ef->datagram[0] + 1] = (uint8_t)sequence;
	ef->bytes[ef->datagram[1] + 1] = (uint8_t)(sequence >> 8);
}

/* The reference is read by FRMW in one cycle and by FPRD in another; an older frame may have
 * either. */
static int is_dc_command(uint8_t cmd)
{
	return cmd == ECAT_CMD_FRMW || cmd == ECAT_CMD_FPRD;
}

int exchange_frame_matches(const struct exchange_frame *ef, uint8_t *frame, size_t frame_len,
			   uint16_t *ret_sequence)
{
	int has_dc = ef->dc != 0 && ef->dc < frame_len && is_dc_command(frame[ef->dc]);
	uint8_t kept = has_dc ? frame[ef->dc] : 0;
	int is_match;

	if (has_dc) {
		frame[ef->dc] = ef->bytes[ef->dc];
	}
	is_match = echo_matches(ef->bytes, frame, frame_len, ECHO_INDEX_ANY);
	if (has_dc) {
		frame[ef->dc] = kept;
	}
	if (!is_match) {
		return 0;
	}
	*ret_sequence = (uint16_t)(frame[ef->datagram[0] + 1] | frame[ef->datagram[1] + 1] << 8);
	return 1;
}

uint16_t exchange_wkc(const uint8_t *frame, size_t datagram)
{
	size_t data_len = get_le16(frame + datagram + 6) & LENGTH_MASK;

	return get_le16(frame + datagram + ECAT_DATAGRAM_HEADER_BYTES + data_len);
}
