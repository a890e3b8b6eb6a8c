/* SPDX-License-Identifier: MIT */
/* An image in a datagram a slave: one that does not answer costs its own data only. */
#include "bus/exchange.h"

#include "unit/master/bus/exchange_bench.h"

enum { OUT = 4, IN = 6 };

/* The LRW at @lost_at has no answer, as from a slave without power. */
static uint32_t lost_at;

static void play_split(struct fake_wire *wire, uint8_t *frame, size_t len)
{
	const struct bench *b = wire->user;
	struct ecat_datagram dg;
	size_t pos = 0;

	frame[6] |= 0x02;
	while (ecat_frame_next(frame, len, &pos, &dg) == 1) {
		uint32_t at = ecat_logical_address(&dg) & 0xffff;

		if (dg.cmd != ECAT_CMD_LRW || at == lost_at) {
			continue;
		}
		put_le16(dg.wkc, at < 2 * OUT ? 2 : 1);
		if (at >= 2 * OUT) {
			memset(dg.data, b->input, dg.data_len);
		}
	}
}

/* Two slaves: outputs of both, then inputs of both. */
static struct exchange_plan split_plan(void)
{
	return (struct exchange_plan){
		.image_bytes = 2 * OUT + 2 * IN,
		.output_bytes = 2 * OUT,
		.chunk_bytes = { OUT, OUT, IN, IN },
		.chunk_count = 4,
		.chunk_wkc = { 2, 2, 1, 1 },
		.chunk_slaves = { { { 1 } }, { { 2 } }, { { 1 } }, { { 2 } } },
		.wkc_expected = 6,
		.slave_count = 2,
		.is_split = 1,
	};
}

static struct bench *start(const struct exchange_plan *plan)
{
	struct bench *b = bench_create(plan);

	lost_at = UINT32_MAX;
	b->wire.answer = play_split;
	for (uint8_t i = 0; i < 2 * OUT; i++) {
		b->image[i] = (uint8_t)(0x10 + i);
	}
	CHECK_EQ(run(b).status, EXCHANGE_OK);
	CHECK_EQ(b->wire.sent, 1);
	CHECK_EQ(b->image[2 * OUT], 0x5a);
	CHECK_EQ(b->image[2 * OUT + 2 * IN - 1], 0x5a);
	return b;
}

TEST(exchange, split_image_sends_each_slave_its_outputs)
{
	struct exchange_plan plan = split_plan();
	struct bench *b = start(&plan);
	const uint8_t *f = b->wire.last_sent.bytes;

	CHECK_EQ(f[16], ECAT_CMD_LRW);
	CHECK_EQ(f[26], 0x10);
	CHECK_EQ(f[26 + OUT + 2], ECAT_CMD_LRW);
	CHECK_EQ(f[26 + OUT + 2 + 10], 0x10 + OUT);
	CHECK_EQ(b->image[OUT], 0x10 + OUT);
	bench_destroy(b);
}

TEST(exchange, split_image_takes_the_good_parts_and_names_the_bad_slaves)
{
	struct exchange_plan plan = split_plan();
	struct bench *b = start(&plan);
	struct exchange_result res;

	b->input = 0x77;
	lost_at = 2 * OUT + IN;
	res = run(b);
	CHECK_EQ(res.status, EXCHANGE_WKC_LOW);
	CHECK_EQ(res.slaves_low.word[0], 2);
	CHECK_EQ(res.wkc, 5);
	CHECK_EQ(b->image[2 * OUT], 0x77);
	CHECK_EQ(b->image[2 * OUT + IN - 1], 0x77);
	CHECK_EQ(b->image[2 * OUT + IN], 0x5a);
	lost_at = 0;
	res = run(b);
	CHECK_EQ(res.slaves_low.word[0], 1);
	lost_at = UINT32_MAX;
	res = run(b);
	CHECK_EQ(res.status, EXCHANGE_OK);
	CHECK_EQ(res.slaves_low.word[0], 0);
	CHECK_EQ(b->image[2 * OUT + IN], 0x77);
	bench_destroy(b);
}

TEST(exchange, lost_frame_of_a_split_image_takes_nothing)
{
	struct exchange_plan plan = split_plan();
	struct bench *b = start(&plan);

	b->input = 0x77;
	b->wire.drop = 1;
	CHECK_EQ(run(b).status, EXCHANGE_NO_FRAME);
	CHECK_EQ(b->image[2 * OUT], 0x5a);
	bench_destroy(b);
}
