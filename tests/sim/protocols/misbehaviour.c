/* SPDX-License-Identifier: MIT */
/* FoE through the engine with slaves that are slow, lossy or stubborn. */
#include <errno.h>

#include "harness/test.h"
#include "sim/protocols/bench.h"
#include "wire/foe.h"

enum { FILE_BYTES = 20000 };

static const char *const terminal[] = { "el3104", NULL };

static void begin(struct protocol_bench *b, uint8_t *file)
{
	for (unsigned i = 0; i < FILE_BYTES; i++) {
		file[i] = (uint8_t)(i * 29 + i / 253);
	}
	bench_begin(b, terminal);
	bench_to_preop(b, 0);
}

static void check_there_and_back(struct protocol_bench *b, const uint8_t *file)
{
	static uint8_t in[FILE_BYTES];
	static uint8_t out[FILE_BYTES];
	struct mailbox_request rq = bench_foe(FOE_WRITE, "a.bin", out, FILE_BYTES);

	memcpy(out, file, FILE_BYTES);
	memset(in, 0, sizeof(in));
	CHECK_EQ(bench_do(b, 0, &rq), 0);
	CHECK_EQ(rq.len, FILE_BYTES);
	rq = bench_foe(FOE_READ, "a.bin", in, FILE_BYTES);
	CHECK_EQ(bench_do(b, 0, &rq), 0);
	CHECK_EQ(rq.len, FILE_BYTES);
	CHECK_MEM(in, file, FILE_BYTES);
}

TEST(foe_engine, a_file_goes_there_and_back_in_preop)
{
	struct protocol_bench b;
	uint8_t file[FILE_BYTES];

	begin(&b, file);
	check_there_and_back(&b, file);
	bench_end(&b);
}

TEST(foe_engine, a_file_goes_there_and_back_while_one_frame_in_20_is_lost)
{
	struct protocol_bench b;
	uint8_t file[FILE_BYTES];
	char error[128];

	begin(&b, file);
	fault_plan_restart(b.faults, bench_now_ns(&b));
	CHECK_EQ(fault_plan_add(b.faults, "p=0.05 lose", 1, error, sizeof(error)), 0);
	check_there_and_back(&b, file);
	CHECK(mailbox_counters_of(b.mb, 0)->recovered > 0);
	bench_end(&b);
}

TEST(foe_engine, a_slave_that_is_busy_before_each_packet_gets_each_once)
{
	struct protocol_bench b;
	uint8_t file[FILE_BYTES];

	begin(&b, file);
	bench_set(&b, 0, "foe.busy", "1");
	check_there_and_back(&b, file);
	bench_end(&b);
}

TEST(foe_engine, endless_busy_ends_with_a_timeout_and_the_slave_serves_the_next_request)
{
	struct protocol_bench b;
	uint8_t file[FILE_BYTES];
	struct mailbox_request rq = bench_foe(FOE_WRITE, "a.bin", file, 100);
	int64_t begun_ns;

	begin(&b, file);
	bench_set(&b, 0, "foe.busy", "-1");
	rq.with.foe.busy_limit = (span_t){ 3 * NS_PER_S };
	begun_ns = bench_now_ns(&b);
	CHECK_EQ(bench_do(&b, 0, &rq), -ETIMEDOUT);
	CHECK_EQ(rq.state.foe.is_busy, 1);
	CHECK(bench_now_ns(&b) - begun_ns > 2 * NS_PER_S);
	CHECK(bench_now_ns(&b) - begun_ns < 4 * NS_PER_S);
	bench_set(&b, 0, "foe.busy", "0");
	check_there_and_back(&b, file);
	bench_end(&b);
}

TEST(foe_engine, an_error_in_the_middle_ends_the_transfer_with_its_code)
{
	struct protocol_bench b;
	uint8_t file[FILE_BYTES];
	struct mailbox_request rq = bench_foe(FOE_WRITE, "a.bin", file, FILE_BYTES);

	begin(&b, file);
	bench_set(&b, 0, "foe.fail_at", "5");
	CHECK_EQ(bench_do(&b, 0, &rq), -EREMOTEIO);
	CHECK_EQ(rq.detail, FOE_ERROR_FLASH);
	bench_set(&b, 0, "foe.fail_at", "0");
	check_there_and_back(&b, file);
	bench_end(&b);
}
