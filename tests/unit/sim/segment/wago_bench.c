/* SPDX-License-Identifier: MIT */
#include "wago_bench.h"

#include "base/bytes.h"
#include "devices/wago_750_354.h"
#include "harness/test.h"
#include "wire/al.h"
#include "wire/esc_reg.h"

enum {
	STATION = BENCH_STATION,
	MAILBOX_OUT = 0x1000,
	MAILBOX_IN = 0x1400,
	OUTPUTS = 0x1800,
	INPUTS = 0x2400,
	STATE_NS = 3000000,
	KBUS_NS = 2 * WAGO_FREE_RUN_NS + WAGO_KBUS_NS,
	SDO_BYTES = 10,
	SDO_UPLOAD = 0x40,
	SDO_ABORT = 0x80,
};

static uint8_t counter;

struct bench *wago_bench_create(const char *name, const struct signal_spec *signal)
{
	struct segment_slave_spec spec;
	struct bench *b;

	CHECK_EQ(wago_750_354_by_name(0, name, &spec), 0);
	b = bench_create(&(struct bench_slave){ .pdi = spec.sii[0],
						.config = spec.sii[1],
						.sync_pins = spec.sii[3],
						.device = spec.device },
			 1);
	spec.device->signal = signal;
	counter = 0;
	return b;
}

struct sim_device *wago_bench_device(struct bench *b)
{
	return segment_device(b->segment, 0);
}

uint16_t wago_bench_request(struct bench *b, uint16_t control)
{
	bench_write16(b, STATION, ESC_REG_AL_CONTROL, control);
	bench_wait(b, STATE_NS);
	return bench_read16(b, STATION, ESC_REG_AL_STATUS);
}

void wago_bench_preop(struct bench *b)
{
	bench_sm(b, STATION, 0, MAILBOX_OUT, WAGO_BENCH_BOX, 0x26);
	bench_sm(b, STATION, 1, MAILBOX_IN, WAGO_BENCH_BOX, 0x22);
	CHECK_EQ(wago_bench_request(b, AL_PREOP), AL_PREOP);
}

void wago_bench_safeop(struct bench *b)
{
	bench_sm(b, STATION, 2, OUTPUTS, WAGO_BENCH_BYTES, 0x64);
	bench_sm(b, STATION, 3, INPUTS, WAGO_BENCH_BYTES, 0x00);
	CHECK_EQ(wago_bench_request(b, AL_SAFEOP), AL_SAFEOP);
}

void wago_bench_op(struct bench *b, const uint8_t *outputs)
{
	uint8_t bytes[WAGO_BENCH_BYTES];

	wago_bench_safeop(b);
	memcpy(bytes, outputs, sizeof(bytes));
	CHECK_EQ(bench_send(b, ECAT_CMD_FPWR, STATION, OUTPUTS, bytes, sizeof(bytes)), 1);
	CHECK_EQ(wago_bench_request(b, AL_OP), AL_OP);
}

void wago_bench_exchange(struct bench *b, const uint8_t *outputs, uint8_t *ret_inputs)
{
	uint8_t bytes[WAGO_BENCH_BYTES];

	memcpy(bytes, outputs, sizeof(bytes));
	CHECK_EQ(bench_send(b, ECAT_CMD_FPWR, STATION, OUTPUTS, bytes, sizeof(bytes)), 1);
	bench_wait(b, KBUS_NS);
	CHECK_EQ(bench_send(b, ECAT_CMD_FPRD, STATION, INPUTS, ret_inputs, WAGO_BENCH_BYTES), 1);
}

int wago_bench_get(struct bench *b, size_t slot, unsigned channel)
{
	int value = 0;

	CHECK_EQ(wago_750_354_get(wago_bench_device(b), slot, channel, &value), 0);
	return value;
}

size_t wago_bench_coe(struct bench *b, const uint8_t *request, size_t len, uint8_t *answer)
{
	uint8_t box[WAGO_BENCH_BOX] = { 0 };

	counter = (uint8_t)(counter % 7 + 1);
	put_le16(box, (uint16_t)len);
	box[5] = (uint8_t)(3 | counter << 4);
	memcpy(box + 6, request, len);
	CHECK_EQ(bench_send(b, ECAT_CMD_FPWR, STATION, MAILBOX_OUT, box, sizeof(box)), 1);
	bench_wait(b, STATE_NS);
	CHECK_EQ(bench_send(b, ECAT_CMD_FPRD, STATION, MAILBOX_IN, box, sizeof(box)), 1);
	len = get_le16(box);
	CHECK(len <= WAGO_BENCH_BOX - 6);
	memcpy(answer, box + 6, len);
	return len;
}

uint32_t wago_bench_upload(struct bench *b, uint16_t index, uint8_t subindex, int *ret_is_abort)
{
	uint8_t request[SDO_BYTES] = { 0x00, 0x20, SDO_UPLOAD };
	uint8_t answer[WAGO_BENCH_BOX] = { 0 };

	put_le16(request + 3, index);
	request[5] = subindex;
	CHECK_EQ(wago_bench_coe(b, request, sizeof(request), answer), SDO_BYTES);
	*ret_is_abort = answer[2] == SDO_ABORT;
	return get_le32(answer + 6);
}
