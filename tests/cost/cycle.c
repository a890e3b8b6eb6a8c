/* SPDX-License-Identifier: MIT */
/*
 * cost_cycle FOLDER SLAVES CYCLES still|commanded: so many cycles of the master in OP, counted
 * (cost.h); the NIC, the clocks and the slaves are not. commanded: a new set of all outputs is on
 * the board in each cycle. Prints what the cycle counted; 1 if a sample was not good.
 */
#include <inttypes.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/bytes.h"
#include "base/event.h"
#include "bus/exchange_frame.h"
#include "cost/cost.h"
#include "cost/piccolos.h"
#include "cycle/cycle.h"
#include "link/line.h"
#include "wire/al.h"
#include "wire/datagram.h"

enum { LOCK_CYCLES = 1000, SETTLE_CYCLES = 20, TRAVEL_NS = 20000 };

static struct piccolos piccolos;
static struct config cfg;
static struct exchange_plan plan;
static struct cycle_stats stats;
static struct board board;
static struct cycle *cy;
static int is_commanded;

/* The segment: frames that wait to come back, and its clock. */
static struct {
	int64_t now_ns;
	uint8_t frame[LIMIT_FRAMES][LIMIT_FRAME_BYTES];
	size_t len[LIMIT_FRAMES];
	unsigned sent;
	unsigned received;
	uint8_t image[LIMIT_IMAGE_BYTES];
} wire;

#define DC_OFFSET_NS INT64_C(5000000000)

static int64_t dc_now_ns(void)
{
	return wire.now_ns + DC_OFFSET_NS;
}

/* --- platform --- */

static mono_t wire_now(void *ctx)
{
	(void)ctx;
	return (mono_t){ wire.now_ns };
}

static int64_t wire_tai(void *ctx)
{
	(void)ctx;
	return wire.now_ns;
}

static int wire_sleep(void *ctx, mono_t deadline)
{
	(void)ctx;
	if (deadline.ns > wire.now_ns) {
		wire.now_ns = deadline.ns;
	}
	return 0;
}

/* --- slaves --- */

static uint16_t chunk_wkc(uint32_t offset)
{
	uint32_t at = 0;

	for (unsigned i = 0; i < plan.chunk_count; i++) {
		if (at == offset) {
			return plan.chunk_wkc[i];
		}
		at += plan.chunk_bytes[i];
	}
	return 0;
}

static void answer(const struct ecat_datagram *dg)
{
	uint32_t offset = ecat_logical_address(dg) - plan.logical_start;

	switch (dg->cmd) {
	case ECAT_CMD_LRW:
		memcpy(dg->data, wire.image + offset, dg->data_len);
		put_le16(dg->wkc, chunk_wkc(offset));
		break;
	case ECAT_CMD_LRD: /* mailbox states: all empty */
		put_le16(dg->wkc, plan.mailbox_bits);
		break;
	case ECAT_CMD_FRMW:
	case ECAT_CMD_FPRD:
		put_le64(dg->data, (uint64_t)dc_now_ns());
		put_le16(dg->wkc, dg->cmd == ECAT_CMD_FPRD ? 1 : (uint16_t)piccolos.slave_count);
		break;
	case ECAT_CMD_BRD:
		put_le16(dg->data, dg->data_len == EXCHANGE_AL_BYTES ? AL_OP : 7);
		put_le16(dg->wkc, (uint16_t)piccolos.slave_count);
		break;
	default:
		break;
	}
}

struct frame {
	const uint8_t *sent;
	uint8_t *received;
	size_t len;
};

static void take_frame(void *ctx)
{
	const struct frame *f = ctx;

	memcpy(wire.frame[wire.sent], f->sent, f->len);
	wire.len[wire.sent++] = f->len;
}

static void give_frame(void *ctx)
{
	struct frame *f = ctx;
	struct ecat_datagram dg;
	size_t pos = 0;

	if (wire.received == 0) {
		wire.now_ns += TRAVEL_NS;
		piccolos_sample(&piccolos, dc_now_ns(), wire.image);
	}
	f->len = wire.len[wire.received];
	memcpy(f->received, wire.frame[wire.received++], f->len);
	f->received[6] |= 0x02; /* as a slave marks it */
	while (ecat_frame_next(f->received, f->len, &pos, &dg) > 0) {
		answer(&dg);
	}
	if (wire.received == wire.sent) {
		wire.sent = 0;
		wire.received = 0;
	}
}

static int wire_send(void *ctx, const uint8_t *frame, size_t frame_len)
{
	struct frame f = { .sent = frame, .len = frame_len };

	(void)ctx;
	cost_aside(take_frame, &f);
	return 0;
}

static int wire_receive(void *ctx, uint8_t *frame, size_t capacity, mono_t deadline, mono_t *ret_at)
{
	struct frame f = { .received = frame };

	(void)ctx;
	(void)capacity;
	(void)deadline;
	cost_aside(give_frame, &f);
	ret_at->ns = wire.now_ns;
	return (int)f.len;
}

/* --- master --- */

/* Slaves' outputs, then their inputs, cut where the next would not fit into the frame. */
static void make_plan(void)
{
	unsigned pieces = 2 * piccolos.slave_count;
	unsigned chunk = 0;

	plan = (struct exchange_plan){ .image_bytes = piccolos.image_bytes,
				       .output_bytes = piccolos.output_bytes,
				       .mailbox_bits = (uint16_t)piccolos.slave_count,
				       .dc_reference = piccolos.slaves[0].station_addr,
				       .slave_count = (uint16_t)piccolos.slave_count,
				       .monitor = 1 };
	for (unsigned i = 0; i < pieces; i++) {
		int is_output = i < piccolos.slave_count;
		uint32_t bytes = is_output ? PICCOLO_OUTPUT_BYTES : PICCOLO_INPUT_BYTES;

		if (plan.chunk_bytes[chunk] + bytes > exchange_frame_capacity(&plan, chunk)) {
			chunk++;
		}
		plan.chunk_kind[chunk] = EXCHANGE_LRW;
		plan.chunk_frame[chunk] = (uint8_t)chunk;
		plan.chunk_bytes[chunk] += bytes;
		plan.chunk_wkc[chunk] = (uint16_t)(plan.chunk_wkc[chunk] + (is_output ? 2 : 1));
		slave_set_add(&plan.chunk_slaves[chunk], i % piccolos.slave_count);
	}
	plan.chunk_count = chunk + 1;
	plan.wkc_expected = (uint16_t)(3 * piccolos.slave_count);
}

static void start(const char *folder)
{
	struct platform platform = { .now = wire_now,
				     .tai_ns = wire_tai,
				     .sleep_until = wire_sleep };
	struct transport transport = { .send = wire_send, .receive = wire_receive };
	struct cycle_spec spec = { .cfg = &cfg,
				   .platform = platform,
				   .plan = &plan,
				   .slaves = piccolos.slaves,
				   .slave_count = piccolos.slave_count,
				   .channels = piccolos.channels,
				   .channel_count = piccolos.channel_count,
				   .stats = &stats,
				   .boards = { [CYCLE_WRITER_LOCAL] = &board } };
	char error[256] = "";
	char path[PATH_MAX];
	struct line *line;

	config_defaults(&cfg);
	make_plan();
	board_init(&board);
	wire.now_ns = 7000123456;
	snprintf(path, sizeof(path), "%s/samples", folder);
	spec.samples = piccolos_ring(&piccolos, path, "sample", piccolos_sample_bytes(&piccolos));
	snprintf(path, sizeof(path), "%s/events", folder);
	spec.events = piccolos_ring(&piccolos, path, "event", sizeof(struct event));
	if (line_create(platform, transport, &line) < 0 ||
	    exchange_create(&plan, line, &spec.exchange) < 0 ||
	    cycle_create(&spec, &cy, error, sizeof(error)) < 0) {
		fprintf(stderr, "cost_cycle: %s\n", error[0] != '\0' ? error : "no exchange");
		exit(1);
	}
}

static void put_outputs(void *ctx)
{
	(void)ctx;
	board_begin(&board);
	for (unsigned i = 0; i < 2 * piccolos.slave_count; i++) {
		board_put(&board, i, i % 2 != 0 ? (uint64_t)wire.now_ns + i : stats.cycles & 1);
	}
	board_commit(&board);
}

static void run(void *ctx)
{
	const unsigned *cycles = ctx;

	for (unsigned i = 0; i < *cycles; i++) {
		if (is_commanded) {
			cost_aside(put_outputs, NULL);
		}
		cycle_step(cy);
	}
}

int main(int argc, char **argv)
{
	unsigned settle = SETTLE_CYCLES;
	unsigned lock = LOCK_CYCLES;
	unsigned cycles;
	uint64_t before;

	if (argc != 5) {
		fprintf(stderr, "usage: cost_cycle FOLDER SLAVES CYCLES still|commanded\n");
		return 2;
	}
	piccolos = piccolos_make(cost_number(argv[2], LIMIT_SLAVES), PICCOLO_CHANNELS);
	cycles = cost_number(argv[3], 1000000);
	is_commanded = strcmp(argv[4], "commanded") == 0;
	start(argv[1]);
	run(&lock);
	cycle_phase_set(cy, CYCLE_OP);
	run(&settle);
	before = stats.samples_good;
	cost_counted(run, &cycles);
	printf("%u cycles, %u frames each, %" PRIu64 " good samples, %" PRIu64 " bad since OP\n",
	       cycles, exchange_frame_count(&plan), stats.samples_good - before, stats.samples_bad);
	return stats.samples_good - before == (uint64_t)cycles * piccolos.slave_count ? 0 : 1;
}
