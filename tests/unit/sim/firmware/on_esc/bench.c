/* SPDX-License-Identifier: MIT */
#include "bench.h"

#include "base/bytes.h"
#include "devices/fb1111_piccolo.h"
#include "harness/test.h"
#include "wire/al.h"
#include "wire/datagram.h"
#include "wire/esc_reg.h"

enum { COE = 3, MS = 1000000 };

/* A start that makes 64-bit times look like today's. */
#define CLOCK_START_NS UINT64_C(845000000000000000)

static void on_edge(void *ctx, unsigned slave, int64_t t_ns, uint64_t system_time_ns)
{
	struct bench *b = ctx;

	b->edge_ns[slave] = t_ns;
	b->edge_system_ns[slave] = system_time_ns;
	b->edges[slave]++;
}

void bench_begin(struct bench *b)
{
	struct segment_slave_spec specs[BENCH_SLAVES];

	memset(b, 0, sizeof(*b));
	b->cycle_ns = BENCH_CYCLE_NS;
	for (int i = 0; i < BENCH_SLAVES; i++) {
		CHECK_EQ(fb1111_piccolo_slave(i, &specs[i]), 0);
		specs[i].clock_start_ns = CLOCK_START_NS + (uint64_t)i * 12345;
		specs[i].ppm = i == 0 ? 37.0 : -81.0;
	}
	CHECK_EQ(segment_create(specs, BENCH_SLAVES, 0, &b->segment), 0);
	segment_sync0_to(b->segment, on_edge, b);
	bench_run(b, 5 * MS);
}

void bench_end(struct bench *b)
{
	for (unsigned i = 0; i < BENCH_SLAVES; i++) {
		/* no test here may have broken the SPI protocol */
		CHECK_EQ(segment_esc(b->segment, i)->reg[ESC_REG_PDI_ERROR], 0);
	}
	segment_destroy(b->segment);
}

void bench_run_to(struct bench *b, int64_t t_ns)
{
	CHECK(t_ns >= b->now_ns);
	b->now_ns = t_ns;
	segment_advance(b->segment, t_ns);
	for (unsigned i = 0; i < BENCH_SLAVES; i++) {
		int64_t copy_ns = fb1111_piccolo_copy_ns(segment_device(b->segment, i));

		b->copy_ns_max[i] = copy_ns > b->copy_ns_max[i] ? copy_ns : b->copy_ns_max[i];
	}
}

void bench_run(struct bench *b, int64_t span_ns)
{
	bench_run_to(b, b->now_ns + span_ns);
}

static unsigned datagram(struct bench *b, enum ecat_cmd cmd, unsigned slave, uint16_t address,
			 void *data, size_t len)
{
	static const uint8_t source[6] = { 0x10, 0x10, 0x10, 0x10, 0x10, 0x10 };
	uint8_t frame[ECAT_FRAME_MAX_BYTES];
	struct ecat_frame_builder fb;
	uint8_t *body;
	int64_t back_ns;

	ecat_frame_begin(&fb, frame, source);
	body = ecat_frame_add(&fb, cmd, 0, (uint16_t)-slave, address, (uint16_t)len);
	CHECK(body != NULL);
	memcpy(body, data, len);
	CHECK_EQ(segment_frame(b->segment, b->now_ns, frame, ecat_frame_end(&fb), &back_ns), 0);
	memcpy(data, body, len);
	return get_le16(body + len);
}

unsigned bench_write(struct bench *b, unsigned slave, uint16_t address, const void *data,
		     size_t len)
{
	uint8_t copy[256];

	CHECK(len <= sizeof(copy));
	memcpy(copy, data, len);
	return datagram(b, ECAT_CMD_APWR, slave, address, copy, len);
}

unsigned bench_read(struct bench *b, unsigned slave, uint16_t address, void *data, size_t len)
{
	memset(data, 0, len);
	return datagram(b, ECAT_CMD_APRD, slave, address, data, len);
}

void bench_put(struct bench *b, unsigned slave, uint16_t address, uint64_t value, size_t len)
{
	uint8_t data[8];

	put_le64(data, value);
	CHECK_EQ(bench_write(b, slave, address, data, len), 1);
}

uint64_t bench_get(struct bench *b, unsigned slave, uint16_t address, size_t len)
{
	uint8_t data[8] = { 0 };

	CHECK_EQ(bench_read(b, slave, address, data, len), 1);
	return get_le64(data);
}

uint16_t bench_request(struct bench *b, unsigned slave, uint16_t control)
{
	bench_put(b, slave, ESC_REG_AL_CONTROL, control, 2);
	bench_run(b, 3 * MS);
	return (uint16_t)bench_get(b, slave, ESC_REG_AL_STATUS, 2);
}

uint16_t bench_code(struct bench *b, unsigned slave)
{
	return (uint16_t)bench_get(b, slave, ESC_REG_AL_STATUS_CODE, 2);
}

void bench_outputs(struct bench *b, unsigned slave, uint8_t led, uint64_t oneshot_ns)
{
	uint8_t data[9] = { led };

	put_le64(data + 1, oneshot_ns);
	CHECK_EQ(bench_write(b, slave, 0x1100, data, sizeof(data)), 1);
}

struct bench_input bench_inputs(struct bench *b, unsigned slave)
{
	uint8_t data[13];

	CHECK_EQ(bench_read(b, slave, 0x1180, data, sizeof(data)), 1);
	return (struct bench_input){ get_le16(data), get_le16(data + 2), get_le64(data + 4),
				     data[12] };
}

/* --- mailbox --- */

static void exchange(struct bench *b, unsigned slave, const uint8_t *sdo, uint8_t *answer)
{
	uint8_t box[128] = { 10 };

	b->mailbox_counter[slave] = b->mailbox_counter[slave] % 7 + 1;
	box[5] = (uint8_t)(COE | b->mailbox_counter[slave] << 4);
	memcpy(box + 6, sdo, 10);
	CHECK_EQ(bench_write(b, slave, 0x1000, box, sizeof(box)), 1);
	for (unsigned i = 0; i < 100; i++) {
		for (unsigned step = 0; step < 5; step++) {
			bench_run(b, MS / 50); /* fine enough to see each sample */
		}
		if (bench_read(b, slave, 0x1080, answer, 128) == 1) {
			CHECK_EQ(answer[5] & 15, COE);
			return;
		}
	}
	test_fail(__FILE__, __LINE__, "no mailbox answer in 10 ms");
}

static uint32_t abort_code(const uint8_t *answer)
{
	return answer[8] == 0x80 ? get_le32(answer + 12) : 0;
}

uint32_t bench_sdo_write(struct bench *b, unsigned slave, uint16_t index, uint8_t subindex,
			 uint32_t value, size_t len)
{
	uint8_t sdo[10] = { 0, 0x20, (uint8_t)(0x23 | (4 - len) << 2), 0, 0, subindex };
	uint8_t answer[128];

	put_le16(sdo + 3, index);
	put_le32(sdo + 6, value);
	exchange(b, slave, sdo, answer);
	return abort_code(answer);
}

uint32_t bench_sdo_read(struct bench *b, unsigned slave, uint16_t index, uint8_t subindex,
			uint32_t *ret_value)
{
	uint8_t sdo[10] = { 0, 0x20, 0x40, 0, 0, subindex };
	uint8_t answer[128];

	put_le16(sdo + 3, index);
	exchange(b, slave, sdo, answer);
	if (abort_code(answer) == 0) {
		*ret_value = get_le32(answer + 12);
	}
	return abort_code(answer);
}

/* --- bring-up --- */

static void set_sm(struct bench *b, unsigned slave, unsigned sm, uint16_t start, uint16_t len,
		   uint8_t control)
{
	uint8_t reg[8] = { 0, 0, 0, 0, control, 0, 1, 0 };

	put_le16(reg, start);
	put_le16(reg + 2, len);
	CHECK_EQ(bench_write(b, slave, (uint16_t)(ESC_REG_SM + 8 * sm), reg, 8), 1);
}

void bench_preop(struct bench *b, unsigned slave)
{
	CHECK_EQ(bench_get(b, slave, ESC_REG_AL_STATUS, 2), AL_INIT);
	set_sm(b, slave, 0, 0x1000, 128, 0x26);
	set_sm(b, slave, 1, 0x1080, 128, 0x22);
	CHECK_EQ(bench_request(b, slave, AL_PREOP), AL_PREOP);
	set_sm(b, slave, 2, 0x1100, 9, 0x64);
	set_sm(b, slave, 3, 0x1180, 13, 0x20);
}

void bench_periodic_op(struct bench *b, unsigned slave)
{
	uint64_t start;

	bench_preop(b, slave);
	start = bench_get(b, slave, ESC_REG_DC_SYSTEM_TIME, 8) + 2 * MS;
	bench_put(b, slave, ESC_REG_DC_CYCLIC_CONTROL, 0, 1);
	bench_put(b, slave, ESC_REG_DC_START_TIME, start, 8);
	bench_put(b, slave, ESC_REG_DC_SYNC0_CYCLE, b->cycle_ns, 4);
	bench_put(b, slave, ESC_REG_DC_ACTIVATION, 3, 1);
	CHECK_EQ(bench_request(b, slave, AL_SAFEOP), AL_SAFEOP);
	bench_outputs(b, slave, 0, 0);
	CHECK_EQ(bench_request(b, slave, AL_OP), AL_OP);
	bench_run_to(b, b->edge_ns[slave] + 3 * (int64_t)b->cycle_ns / 2);
}

void bench_oneshot_op(struct bench *b, unsigned slave)
{
	bench_preop(b, slave);
	CHECK_EQ(bench_sdo_write(b, slave, 0x8000, 1, 1, 1), 0);
	CHECK_EQ(bench_request(b, slave, AL_SAFEOP), AL_PREOP | AL_ERROR);
	CHECK_EQ(bench_code(b, slave), AL_CODE_INVALID_DC_SYNC_CONFIG);
	bench_put(b, slave, ESC_REG_DC_CYCLIC_CONTROL, 1, 1);
	CHECK_EQ(bench_request(b, slave, AL_SAFEOP | AL_ERROR), AL_SAFEOP);
	bench_outputs(b, slave, 0, 0);
	CHECK_EQ(bench_request(b, slave, AL_OP), AL_OP);
}
