/* SPDX-License-Identifier: MIT */
/* VoE and AoE through the engine. */
#include <errno.h>

#include "base/bytes.h"
#include "harness/test.h"
#include "sim/protocols/bench.h"

static const char *const drive[] = { "all", NULL };

static struct mailbox_request voe(uint8_t *buffer, size_t capacity, size_t len)
{
	return (struct mailbox_request){ .protocol = &voe_protocol,
					 .with.voe = { .vendor = 0x6a, .type = 7, .len = len },
					 .buffer = buffer,
					 .capacity = capacity,
					 .timeout = { NS_PER_S } };
}

TEST(voe_engine, what_is_sent_comes_back_from_an_echo)
{
	struct protocol_bench b;
	uint8_t buffer[300];
	struct mailbox_request rq = voe(buffer, sizeof(buffer), 200);

	for (unsigned i = 0; i < sizeof(buffer); i++) {
		buffer[i] = (uint8_t)(i * 3);
	}
	bench_begin(&b, drive);
	bench_to_preop(&b, 0);
	CHECK_EQ(bench_do(&b, 0, &rq), 0);
	CHECK_EQ(rq.len, 200);
	CHECK_EQ(rq.state.voe.type, 7);
	CHECK_EQ(buffer[199], (uint8_t)(199 * 3));
	rq = voe(buffer, sizeof(buffer), 0);
	CHECK_EQ(bench_do(&b, 0, &rq), 0);
	CHECK_EQ(rq.len, 0);
	bench_end(&b);
}

TEST(voe_engine, a_request_without_answer_ends_when_it_is_sent)
{
	struct protocol_bench b;
	uint8_t buffer[8] = { 1 };
	struct mailbox_request rq = voe(buffer, sizeof(buffer), 8);

	bench_begin(&b, drive);
	bench_to_preop(&b, 0);
	rq.with.voe.expect = VOE_NO_ANSWER;
	CHECK_EQ(bench_do(&b, 0, &rq), 0);
	CHECK_EQ(mailbox_counters_of(b.mb, 0)->sent, 1);
	bench_end(&b);
}

TEST(voe_engine, what_no_mail_can_carry_is_refused)
{
	struct protocol_bench b;
	static uint8_t buffer[1100];
	struct mailbox_request rq = voe(buffer, sizeof(buffer), 1024 - 6 - 6 + 1);

	bench_begin(&b, drive);
	bench_to_preop(&b, 0);
	CHECK_EQ(bench_do(&b, 0, &rq), -EINVAL);
	rq.with.voe.len--;
	CHECK_EQ(bench_do(&b, 0, &rq), 0);
	rq.with.voe.len = 10;
	rq.capacity = 9;
	CHECK_EQ(bench_do(&b, 0, &rq), -EINVAL);
	bench_end(&b);
}

static struct mailbox_request aoe(enum aoe_command command, uint32_t offset, uint8_t *buffer,
				  size_t capacity)
{
	return (struct mailbox_request){ .protocol = &aoe_protocol,
					 .with.aoe = { .command = command,
						       .target = { { 1, 2, 3, 4, 5, 6 }, 1001 },
						       .group = AOE_GROUP_SDO,
						       .offset = offset },
					 .buffer = buffer,
					 .capacity = capacity,
					 .timeout = { NS_PER_S } };
}

TEST(aoe_engine, an_object_is_read_and_written_as_an_sdo)
{
	struct protocol_bench b;
	uint8_t buffer[64] = { 0 };
	struct mailbox_request rq = aoe(AOE_READ, aoe_sdo_offset(0x1018, 2), buffer, 64);

	bench_begin(&b, drive);
	bench_to_preop(&b, 0);
	CHECK_EQ(bench_do(&b, 0, &rq), 0);
	CHECK_EQ(rq.len, 4);
	CHECK_EQ(get_le32(buffer), b.sii[0].product);
	put_le32(buffer, 0x12345678);
	rq = aoe(AOE_WRITE, aoe_sdo_offset(0x607a, 0), buffer, 4);
	CHECK_EQ(bench_do(&b, 0, &rq), 0);
	memset(buffer, 0, sizeof(buffer));
	rq = aoe(AOE_READ, aoe_sdo_offset(0x607a, 0), buffer, 64);
	CHECK_EQ(bench_do(&b, 0, &rq), 0);
	CHECK_EQ(get_le32(buffer), 0x12345678);
	bench_end(&b);
}

TEST(aoe_engine, what_the_slave_refuses_has_its_code)
{
	struct protocol_bench b;
	uint8_t buffer[64] = { 0 };
	struct mailbox_request rq = aoe(AOE_READ, aoe_sdo_offset(0x5555, 0), buffer, 64);

	bench_begin(&b, drive);
	bench_to_preop(&b, 0);
	CHECK_EQ(bench_do(&b, 0, &rq), -EREMOTEIO);
	CHECK_EQ(rq.detail, 0x06020000);
	rq = aoe(AOE_WRITE, aoe_sdo_offset(0x1018, 2), buffer, 4);
	CHECK_EQ(bench_do(&b, 0, &rq), -EREMOTEIO);
	CHECK(rq.detail != 0);
	rq = aoe(AOE_READ, aoe_sdo_offset(0x1018, 2), buffer, 64);
	rq.with.aoe.group = 1;
	CHECK_EQ(bench_do(&b, 0, &rq), -EREMOTEIO);
	CHECK_EQ(rq.detail, AOE_ERROR_GROUP);
	rq = aoe(AOE_READ, aoe_sdo_offset(0x1018, 2), buffer, 3);
	CHECK_EQ(bench_do(&b, 0, &rq), -EREMOTEIO);
	CHECK_EQ(rq.detail, AOE_ERROR_SIZE);
	bench_end(&b);
}

TEST(aoe_engine, a_slave_without_the_protocol_refuses_at_once)
{
	static const char *const terminal[] = { "el3104", NULL };
	struct protocol_bench b;
	uint8_t buffer[8] = { 0 };
	struct mailbox_request rq = aoe(AOE_READ, aoe_sdo_offset(0x1018, 2), buffer, 8);

	bench_begin(&b, terminal);
	bench_to_preop(&b, 0);
	rq.slave_pos = 0;
	CHECK_EQ(mailbox_submit(b.mb, &rq), -ENOTSUP);
	bench_end(&b);
}
