/* SPDX-License-Identifier: MIT */
/* SoE through the engine: elements, lists, fragments, errors, a procedure command. */
#include "wire/soe.h"

#include <errno.h>

#include "base/bytes.h"
#include "devices/soe_server.h"
#include "harness/test.h"
#include "sim/protocols/bench.h"

enum { TABLE_BYTES = SOE_LIST_HEADER_BYTES + 1200 };

static const char *const drive[] = { "all", NULL };

static struct {
	unsigned count;
	uint16_t idn;
	uint16_t state;
} notified;

static void note(void *ctx, uint16_t slave_pos, const uint8_t *data, size_t len)
{
	struct soe_message m;

	(void)ctx;
	CHECK_EQ(slave_pos, 0);
	CHECK_EQ(soe_parse(data, len, &m), 0);
	CHECK_EQ(m.operation, SOE_NOTIFICATION);
	CHECK_EQ(m.body_len, 2);
	notified.count++;
	notified.idn = m.idn;
	notified.state = get_le16(m.body);
}

static void begin(struct protocol_bench *b)
{
	bench_begin(b, drive);
	bench_to_preop(b, 0);
	memset(&notified, 0, sizeof(notified));
	mailbox_sink_set(b->mb, MAILBOX_TYPE_SOE, note, NULL);
}

static struct mailbox_request soe(enum soe_operation operation, uint16_t idn, uint8_t elements,
				  uint8_t *buffer, size_t capacity)
{
	return (struct mailbox_request){
		.protocol = &soe_protocol,
		.with.soe = { .operation = operation, .elements = elements, .idn = idn },
		.buffer = buffer,
		.capacity = capacity,
		.timeout = { NS_PER_S },
	};
}

static int read_idn(struct protocol_bench *b, uint16_t idn, uint8_t elements, uint8_t *buffer,
		    size_t capacity, size_t *ret_len)
{
	struct mailbox_request rq = soe(SOE_READ, idn, elements, buffer, capacity);
	int r = bench_do(b, 0, &rq);

	*ret_len = rq.len;
	return r < 0 && rq.detail != 0 ? -(int)rq.detail : r;
}

static int write_idn(struct protocol_bench *b, uint16_t idn, uint8_t *buffer, size_t len)
{
	struct mailbox_request rq = soe(SOE_WRITE, idn, SOE_ELEMENT_VALUE, buffer, len);
	int r = bench_do(b, 0, &rq);

	return r < 0 && rq.detail != 0 ? -(int)rq.detail : r;
}

TEST(soe_engine, all_elements_of_a_parameter_come_in_order)
{
	static const uint8_t expected[] = {
		0,  0,                                           /* state */
		23, 0, 23, 0, 'C', 'o', 'n', 't', 'r', 'o', 'l', /* name */
	};
	struct protocol_bench b;
	uint8_t buffer[128];
	size_t len;

	begin(&b);
	CHECK_EQ(read_idn(&b, SOE_IDN_CYCLE, 0x7f, buffer, sizeof(buffer), &len), 0);
	CHECK_EQ(len, 2 + 4 + 23 + 4 + 4 + 2 + 2 + 2 + 2);
	CHECK_MEM(buffer, expected, sizeof(expected));
	CHECK_EQ(soe_value_bytes(get_le32(buffer + 29)), 2);
	CHECK_EQ(get_le16(buffer + 39), 250);
	CHECK_EQ(get_le16(buffer + 41), 10000);
	CHECK_EQ(get_le16(buffer + 43), 1000);
	bench_end(&b);
}

TEST(soe_engine, the_list_of_all_idns_is_read)
{
	struct protocol_bench b;
	uint8_t buffer[64];
	size_t len;

	begin(&b);
	CHECK_EQ(read_idn(&b, SOE_IDN_ALL, SOE_ELEMENT_VALUE, buffer, sizeof(buffer), &len), 0);
	CHECK_EQ(len, SOE_LIST_HEADER_BYTES + 2 * SOE_SERVER_IDNS);
	CHECK_EQ(get_le16(buffer), 2 * SOE_SERVER_IDNS);
	CHECK_EQ(get_le16(buffer + SOE_LIST_HEADER_BYTES + 2), SOE_IDN_ALL);
	bench_end(&b);
}

TEST(soe_engine, a_long_list_goes_there_and_back_in_fragments)
{
	struct protocol_bench b;
	static uint8_t out[TABLE_BYTES];
	static uint8_t in[TABLE_BYTES];
	size_t len;
	uint64_t mails;

	begin(&b);
	CHECK_EQ(read_idn(&b, SOE_IDN_TABLE, SOE_ELEMENT_VALUE, in, sizeof(in), &len), 0);
	CHECK_EQ(len, TABLE_BYTES);
	CHECK_EQ(get_le32(in + SOE_LIST_HEADER_BYTES + 4 * (size_t)299), 299 * 299);
	memcpy(out, in, sizeof(out));
	for (unsigned i = SOE_LIST_HEADER_BYTES; i < TABLE_BYTES; i++) {
		out[i] = (uint8_t)(i * 5);
	}
	mails = mailbox_counters_of(b.mb, 0)->sent;
	CHECK_EQ(write_idn(&b, SOE_IDN_TABLE, out, sizeof(out)), 0);
	CHECK_EQ(mailbox_counters_of(b.mb, 0)->sent, mails + 2);
	CHECK_EQ(read_idn(&b, SOE_IDN_TABLE, SOE_ELEMENT_VALUE, in, sizeof(in), &len), 0);
	CHECK_MEM(in, out, sizeof(out));
	CHECK_EQ(read_idn(&b, SOE_IDN_TABLE, SOE_ELEMENT_VALUE, in, 1000, &len), -EMSGSIZE);
	bench_end(&b);
}

TEST(soe_engine, what_the_drive_refuses_has_its_code_and_the_value_stays)
{
	struct protocol_bench b;
	uint8_t v[4];
	size_t len;

	begin(&b);
	put_le16(v, 249);
	CHECK_EQ(write_idn(&b, SOE_IDN_CYCLE, v, 2), -SOE_ERROR_BELOW_MIN);
	put_le16(v, 10001);
	CHECK_EQ(write_idn(&b, SOE_IDN_CYCLE, v, 2), -SOE_ERROR_ABOVE_MAX);
	CHECK_EQ(write_idn(&b, SOE_IDN_CYCLE, v, 1), -SOE_ERROR_TOO_SHORT);
	CHECK_EQ(write_idn(&b, SOE_IDN_CYCLE, v, 4), -SOE_ERROR_TOO_LONG);
	CHECK_EQ(write_idn(&b, SOE_IDN_VERSION, v, 4), -SOE_ERROR_READ_ONLY);
	CHECK_EQ(write_idn(&b, 4711, v, 2), -SOE_ERROR_NO_IDN);
	CHECK_EQ(read_idn(&b, 4711, SOE_ELEMENT_VALUE, v, 2, &len), -SOE_ERROR_NO_IDN);
	CHECK_EQ(read_idn(&b, SOE_IDN_CYCLE, SOE_ELEMENT_VALUE, v, 2, &len), 0);
	CHECK_EQ(get_le16(v), 1000);
	put_le16(v, 500);
	CHECK_EQ(write_idn(&b, SOE_IDN_CYCLE, v, 2), 0);
	CHECK_EQ(read_idn(&b, SOE_IDN_CYCLE, SOE_ELEMENT_VALUE, v, 2, &len), 0);
	CHECK_EQ(get_le16(v), 500);
	bench_end(&b);
}

TEST(soe_engine, a_procedure_command_ends_with_a_notification)
{
	struct protocol_bench b;
	uint8_t v[2];
	size_t len;

	begin(&b);
	put_le16(v, 3);
	CHECK_EQ(write_idn(&b, SOE_IDN_RESET, v, 2), 0);
	CHECK_EQ(read_idn(&b, SOE_IDN_RESET, SOE_ELEMENT_STATE, v, 2, &len), 0);
	CHECK_EQ(get_le16(v), 7);
	CHECK_EQ(notified.count, 0);
	for (unsigned i = 0; i < 100; i++) {
		mailbox_step(b.mb);
		CHECK_EQ(line_sleep(b.line, (span_t){ NS_PER_MS }), 0);
	}
	CHECK_EQ(notified.count, 1);
	CHECK_EQ(notified.idn, SOE_IDN_RESET);
	CHECK_EQ(notified.state, 3);
	CHECK_EQ(read_idn(&b, SOE_IDN_RESET, SOE_ELEMENT_STATE, v, 2, &len), 0);
	CHECK_EQ(get_le16(v), 3);
	bench_end(&b);
}

TEST(soe_engine, answers_survive_a_wire_that_loses_one_frame_in_20)
{
	struct protocol_bench b;
	uint8_t in[64];
	char error[128];
	size_t len;

	begin(&b);
	fault_plan_restart(b.faults, bench_now_ns(&b));
	CHECK_EQ(fault_plan_add(b.faults, "p=0.05 lose", 1, error, sizeof(error)), 0);
	for (unsigned i = 0; i < 100; i++) {
		CHECK_EQ(read_idn(&b, SOE_IDN_ALL, SOE_ELEMENT_VALUE, in, sizeof(in), &len), 0);
		CHECK_EQ(len, SOE_LIST_HEADER_BYTES + 2 * SOE_SERVER_IDNS);
	}
	CHECK_EQ(mailbox_counters_of(b.mb, 0)->timeouts, 0);
	bench_end(&b);
}

TEST(soe_engine, a_lost_fragment_fails_the_read_and_never_shortens_the_value)
{
	struct protocol_bench b;
	static uint8_t in[TABLE_BYTES];
	unsigned failed = 0;
	char error[128];
	size_t len;

	begin(&b);
	fault_plan_restart(b.faults, bench_now_ns(&b));
	CHECK_EQ(fault_plan_add(b.faults, "p=0.05 lose", 1, error, sizeof(error)), 0);
	for (unsigned i = 0; i < 100; i++) {
		int r = read_idn(&b, SOE_IDN_TABLE, SOE_ELEMENT_VALUE, in, sizeof(in), &len);

		CHECK(r == 0 || r == -EIO);
		CHECK(r < 0 || len == TABLE_BYTES);
		failed += r < 0;
	}
	CHECK(failed > 0);
	CHECK(failed < 50);
	CHECK_EQ(mailbox_counters_of(b.mb, 0)->lost, failed);
	bench_end(&b);
}
