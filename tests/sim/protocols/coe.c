/* SPDX-License-Identifier: MIT */
/* CoE through the engine: long transfers, SDO information, and slaves that misbehave. */
#include <errno.h>
#include <stdlib.h>

#include "base/bytes.h"
#include "harness/test.h"
#include "mailbox/coe.h"
#include "sim/protocols/bench.h"

enum {
	MEMORY = 0x2f00,
	MEBIBYTE = 1 << 20,
	TIMEOUT_MS = 200,
	NAME = 0x1008,
	IDENTITY = 0x1018,
	FEW = 3000,
};

static const char *const terminals[] = { "el3104", "el3204", "gauge", NULL };

static struct mailbox_request coe(enum coe_operation operation, uint16_t index, uint8_t subindex,
				  uint8_t *buffer, size_t capacity)
{
	return (struct mailbox_request){
		.protocol = &coe_protocol,
		.with.coe = { .operation = operation, .index = index, .subindex = subindex },
		.buffer = buffer,
		.capacity = capacity,
		.timeout = { TIMEOUT_MS * NS_PER_MS }
	};
}

static void begin(struct protocol_bench *b)
{
	bench_begin(b, terminals);
	bench_set(b, 0, "coe.memory", "1048576");
	bench_to_preop(b, 0);
	bench_to_preop(b, 1);
}

static void fault(struct protocol_bench *b, const char *line)
{
	char error[128];

	fault_plan_restart(b->faults, bench_now_ns(b));
	if (fault_plan_add(b->faults, line, 2, error, sizeof(error)) < 0) {
		test_fail(__FILE__, __LINE__, "%s", error);
	}
	/* a fault that happens once happens with the next frame */
	line_sleep(b->line, (span_t){ NS_PER_MS });
}

static uint32_t read_vendor(struct protocol_bench *b, unsigned pos)
{
	uint8_t data[4];
	struct mailbox_request rq = coe(COE_UPLOAD, IDENTITY, 1, data, sizeof(data));

	CHECK_EQ(bench_do(b, pos, &rq), 0);
	CHECK_EQ(rq.len, 4);
	return get_le32(data);
}

static unsigned arrived(const struct protocol_bench *b, unsigned pos)
{
	return segment_esc(b->segment, pos)->sm[0].completed;
}

static void there_and_back(struct protocol_bench *b, size_t bytes)
{
	uint8_t *out = malloc(bytes);
	uint8_t *in = malloc(bytes);
	struct mailbox_request rq = coe(COE_DOWNLOAD, MEMORY, 1, out, bytes);

	CHECK(out != NULL && in != NULL);
	for (size_t i = 0; i < bytes; i++) {
		out[i] = (uint8_t)(i * 7 + i / 251);
	}
	CHECK_EQ(bench_do(b, 0, &rq), 0);
	CHECK_EQ(rq.len, bytes);
	CHECK_EQ(rq.total, bytes);
	rq = coe(COE_UPLOAD, MEMORY, 1, in, bytes);
	CHECK_EQ(bench_do(b, 0, &rq), 0);
	CHECK_EQ(rq.len, bytes);
	CHECK_MEM(in, out, bytes);
	free(out);
	free(in);
}

TEST(coe_engine, transfers_of_every_kind_go_there_and_back)
{
	static const size_t bytes[] = { 1, 2, 4, 5, 111, 112, 113, 119, 120, 121, 125, 231, FEW };
	struct protocol_bench b;

	begin(&b);
	for (size_t i = 0; i < sizeof(bytes) / sizeof(bytes[0]); i++) {
		there_and_back(&b, bytes[i]);
	}
	bench_end(&b);
}

TEST(coe_engine, one_mebibyte_goes_there_and_back)
{
	struct protocol_bench b;

	begin(&b);
	there_and_back(&b, MEBIBYTE);
	bench_end(&b);
}

/* D3: what was sent again after a lost frame has reached the slave once. */
TEST(coe_engine, no_mail_reaches_a_slave_twice_while_one_frame_in_10_is_lost)
{
	static const char *const plans[] = { "p=0.1 lose", "p=0.1 drop" };

	for (int i = 0; i < 2; i++) {
		struct protocol_bench b;
		unsigned before;

		begin(&b);
		before = arrived(&b, 0);
		fault(&b, plans[i]);
		there_and_back(&b, (size_t)4 * FEW);
		CHECK_EQ(arrived(&b, 0) - before, mailbox_counters_of(b.mb, 0)->sent);
		CHECK_EQ(mailbox_counters_of(b.mb, 0)->timeouts, 0);
		CHECK_EQ(mailbox_counters_of(b.mb, 0)->recovered > 0, i == 0);
		bench_end(&b);
	}
}

TEST(coe_engine, complete_access_reads_an_assignment_at_once)
{
	struct protocol_bench b;
	uint8_t data[64];
	struct mailbox_request rq = coe(COE_UPLOAD, 0x1c13, 0, data, sizeof(data));

	begin(&b);
	rq.with.coe.access = COE_ACCESS_COMPLETE;
	CHECK_EQ(bench_do(&b, 0, &rq), 0);
	CHECK_EQ(rq.len, 2 + 2 * (size_t)data[0]);
	CHECK_EQ(get_le16(data + 2), 0x1a00);
	rq = coe(COE_UPLOAD, 0x1c13, 2, data, sizeof(data));
	rq.with.coe.access = COE_ACCESS_COMPLETE;
	CHECK_EQ(bench_do(&b, 0, &rq), -EINVAL);
	bench_end(&b);
}

TEST(coe_engine, sdo_information_describes_the_dictionary)
{
	struct protocol_bench b;
	uint8_t data[4096];
	struct mailbox_request rq = coe(COE_LIST, 0, 0, data, sizeof(data));
	struct coe_object object;
	struct coe_entry entry;

	begin(&b);
	rq.with.coe.list_type = COE_LIST_ALL;
	CHECK_EQ(bench_do(&b, 0, &rq), 0);
	CHECK(rq.len >= 20 && rq.len % 2 == 0);
	CHECK_EQ(get_le16(data), 0x1000);
	rq = coe(COE_OBJECT, IDENTITY, 0, data, sizeof(data));
	CHECK_EQ(bench_do(&b, 0, &rq), 0);
	CHECK_EQ(coe_object_get(data, rq.len, &object), 0);
	CHECK_EQ(object.index, IDENTITY);
	CHECK_EQ(object.subindex_max, 4);
	rq = coe(COE_ENTRY, 0x6000, 0x11, data, sizeof(data));
	CHECK_EQ(bench_do(&b, 0, &rq), 0);
	CHECK_EQ(coe_entry_get(data, rq.len, &entry), 0);
	CHECK_EQ(entry.subindex, 0x11);
	CHECK_EQ(entry.bit_len, 16);
	rq = coe(COE_ENTRY, 0x5fff, 1, data, sizeof(data));
	CHECK_EQ(bench_do(&b, 0, &rq), -EREMOTEIO);
	CHECK_EQ(rq.detail, 0x06020000);
	bench_end(&b);
}

TEST(coe_engine, an_entry_has_the_unit_that_its_slave_gives)
{
	struct protocol_bench b;
	uint8_t data[256];
	struct mailbox_request rq = coe(COE_ENTRY, 0x6000, 2, data, sizeof(data));
	struct coe_entry entry;

	begin(&b);
	bench_to_preop(&b, 2);
	CHECK_EQ(bench_do(&b, 2, &rq), 0);
	CHECK_EQ(coe_entry_get(data, rq.len, &entry), 0);
	CHECK_EQ(entry.unit, 0xff2d0000);
	CHECK_STR(entry.name, "temperature");
	rq = coe(COE_ENTRY, 0x6000, 5, data, sizeof(data));
	CHECK_EQ(bench_do(&b, 2, &rq), 0);
	CHECK_EQ(coe_entry_get(data, rq.len, &entry), 0);
	CHECK_EQ(entry.unit, 0);
	CHECK_STR(entry.name, "count");
	rq = coe(COE_ENTRY, 0x6000, 0x11, data, sizeof(data));
	CHECK_EQ(bench_do(&b, 0, &rq), 0);
	CHECK_EQ(coe_entry_get(data, rq.len, &entry), 0);
	CHECK_EQ(entry.unit, 0);
	bench_end(&b);
}

TEST(coe_engine, a_unit_that_is_announced_and_not_sent_is_none)
{
	static const uint8_t announced[] = "\x00\x60\x01\x0f\x03\x00\x10\x00\x07\x00speed";
	static const uint8_t sent[] =
		"\x00\x60\x01\x08\x03\x00\x10\x00\x07\x00\x00\x47\xb4\x00speed";
	struct coe_entry entry;

	CHECK_EQ(coe_entry_get(announced, sizeof(announced) - 1, &entry), 0);
	CHECK_EQ(entry.unit, 0);
	CHECK_STR(entry.name, "speed");
	CHECK_EQ(coe_entry_get(sent, sizeof(sent) - 1, &entry), 0);
	CHECK_EQ(entry.unit, 0x00b44700);
	CHECK_STR(entry.name, "speed");
	for (size_t len = 10; len < 14; len++) {
		CHECK_EQ(coe_entry_get(sent, len, &entry), 0);
		CHECK_EQ(entry.unit, 0);
	}
}

/* --- misbehaviour --- */

static int read_few(struct protocol_bench *b, struct mailbox_request *rq)
{
	static uint8_t data[MEBIBYTE];

	*rq = coe(COE_UPLOAD, MEMORY, 1, data, sizeof(data));
	return bench_do(b, 0, rq);
}

static void check_fault(const char *line, int result, uint32_t detail)
{
	struct protocol_bench b;
	struct mailbox_request rq;
	int64_t start_ns;

	begin(&b);
	bench_set(&b, 0, "coe.memory", "3000");
	fault(&b, line);
	start_ns = bench_now_ns(&b);
	CHECK_EQ(read_few(&b, &rq), result);
	CHECK_EQ(rq.detail, detail);
	CHECK(bench_now_ns(&b) - start_ns < 2 * TIMEOUT_MS * NS_PER_MS);
	/* the next transfer is not touched by it, nor is the other slave */
	line_sleep(b.line, (span_t){ 300 * NS_PER_MS });
	CHECK_EQ(read_vendor(&b, 0), 2);
	CHECK_EQ(read_vendor(&b, 1), 2);
	CHECK_EQ(read_few(&b, &rq), 0);
	CHECK_EQ(rq.len, FEW);
	bench_end(&b);
}

TEST(coe_engine, late_answer_within_the_timeout_is_taken)
{
	check_fault("at=0s mailbox kind=late by=150ms slave=0", 0, 0);
}

TEST(coe_engine, late_answer_after_the_timeout_is_dropped)
{
	check_fault("at=0s mailbox kind=late by=300ms slave=0", -ETIMEDOUT, 0);
}

TEST(coe_engine, doubled_answers_are_dropped)
{
	check_fault("at=0s mailbox kind=double count=20 slave=0", 0, 0);
}

TEST(coe_engine, wrong_counters_do_not_fail_a_transfer)
{
	check_fault("at=0s mailbox kind=counter count=20 slave=0", 0, 0);
}

TEST(coe_engine, length_beyond_the_mailbox_is_a_protocol_error)
{
	check_fault("at=0s mailbox kind=length slave=0", -EPROTO, 0);
}

TEST(coe_engine, missing_answer_is_a_timeout_and_nothing_is_sent_again)
{
	check_fault("at=0s mailbox kind=silent slave=0", -ETIMEDOUT, 0);
}

TEST(coe_engine, eoe_fragments_between_segments_do_not_fail_a_transfer)
{
	check_fault("at=0s mailbox kind=eoe count=20 slave=0", 0, 0);
}

TEST(coe_engine, abort_in_the_middle_ends_the_transfer_with_its_code)
{
	check_fault("at=0s mailbox kind=abort slave=0", -EREMOTEIO, 0x08000000);
}

TEST(coe_engine, slave_that_reads_no_request_is_a_timeout)
{
	check_fault("at=0s mailbox kind=busy count=600 slave=0", -ETIMEDOUT, 0);
}

TEST(coe_engine, cancelled_transfer_is_aborted_and_the_next_one_works)
{
	static uint8_t data[MEBIBYTE];
	struct mailbox_request rq = coe(COE_UPLOAD, MEMORY, 1, data, sizeof(data));
	struct protocol_bench b;

	begin(&b);
	CHECK_EQ(mailbox_submit(b.mb, &rq), 0);
	CHECK_EQ(mailbox_submit(b.mb, &rq), -EBUSY);
	while (rq.len < 10000) {
		mailbox_step(b.mb);
		line_sleep(b.line, (span_t){ NS_PER_MS });
	}
	CHECK_EQ(rq.total, MEBIBYTE);
	mailbox_cancel(b.mb, &rq);
	CHECK_EQ(rq.result, -ECANCELED);
	CHECK_EQ(read_vendor(&b, 0), 2);
	/* the slave has let go of the transfer, too: its next segment would be an error */
	CHECK_EQ(read_few(&b, &rq), 0);
	bench_end(&b);
}
