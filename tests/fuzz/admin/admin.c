/* SPDX-License-Identifier: MIT */
/*
 * A message as any member of the group may send it. The input is the beginning of a request, the
 * rest is zero; its own length is tried, too. Whatever comes: the reply is whole, its text ends,
 * and the board holds only what its channels can hold.
 */
#include <assert.h>
#include <errno.h>
#include <stdio.h>
#include <string.h>

#include "admin/command.h"

enum { OUTPUTS = 3, CHANNELS = 4 };

static struct config cfg;
static struct board board;
static struct channel channels[CHANNELS];
static struct slave_info slaves[2];

static int dc_now(void *ctx, int64_t *ret_dc_ns)
{
	(void)ctx;
	*ret_dc_ns = 1000000000;
	return 0;
}

static void sdo(void *ctx, struct admin_pending *pending)
{
	struct admin_reply *reply = &pending->reply;

	(void)ctx;
	assert(pending->request.slave_pos < 2);
	assert((pending->request.verb != ADMIN_SDO_WRITE &&
		pending->request.verb != ADMIN_SOE_WRITE) ||
	       pending->data_len >= 1);
	reply->slave_code = pending->request.index % 2 != 0 ? 0x06020000 : 0;
	memset(reply->data, 0x55, sizeof(reply->data));
	reply->data_len = sizeof(reply->data);
	admin_pending_complete(pending, reply->slave_code != 0 ? -EIO : 0);
}

/* It is of no slave. */
static void capture(void *ctx, struct admin_pending *pending)
{
	(void)ctx;
	admin_pending_complete(pending, 0);
}

static void nothing(void *ctx)
{
	(void)ctx;
}

static void emit(void *ctx, const struct event *ev)
{
	char text[256];

	(void)ctx;
	event_format(ev, text, sizeof(text));
}

static void make_channel(unsigned n, const char *name, enum channel_direction direction,
			 enum channel_type type, uint8_t bit_len)
{
	channels[n] = (struct channel){ .slave_pos = n == 3,
					.type = (uint8_t)type,
					.direction = (uint8_t)direction,
					.bit_len = bit_len,
					.scale = 1.0 };
	snprintf(channels[n].name, sizeof(channels[n].name), "%s", name);
}

static struct admin_target make_target(void)
{
	memset(&cfg, 0, sizeof(cfg));
	cfg.cycle_period_ns = 1000000;
	cfg.slave_count = 2;
	cfg.slave[1].mode = CONFIG_MODE_ONESHOT;
	make_channel(0, "a.adc", CHANNEL_INPUT, CHANNEL_UINT, 16);
	make_channel(1, "a.led", CHANNEL_OUTPUT, CHANNEL_BOOL, 1);
	make_channel(2, "a.level", CHANNEL_OUTPUT, CHANNEL_INT, 8);
	make_channel(3, "b.oneshot_time", CHANNEL_OUTPUT, CHANNEL_UINT, 64);
	board_init(&board);
	return (struct admin_target){
		.cfg = &cfg,
		.channels = channels,
		.channel_count = CHANNELS,
		.slaves = slaves,
		.slave_count = 2,
		.board = &board,
		.is_op = 1,
		.dc_now = dc_now,
		.mailbox = sdo,
		.capture = capture,
		.stop = nothing,
		.clear = nothing,
		.emit = emit,
	};
}

static void check_board(void)
{
	struct board_set set = { .sequence = UINT64_MAX };

	assert(board_take(&board, OUTPUTS, &set) == 1);
	assert(!set.is_set[0] || set.raw[0] <= 1);
	assert(!set.is_set[1] || set.raw[1] <= 0xff);
}

static void on_bus(void *ctx, struct admin_pending *pending)
{
	(void)ctx;
	admin_pending_complete(pending, 0);
}

/* A set is taken by the cycle; what looks at the bus waits until that has been brought up. */
static void finish(struct admin_pending *pending, struct admin_target *target)
{
	int is_for_bus = pending->outlives_bus;

	if (is_for_bus) {
		target->bus_request = on_bus;
	} else {
		board_answer(&board, pending->sequence, 7);
	}
	pending->poll(pending, target);
	assert(pending->state == ADMIN_PENDING_COMPLETE);
	assert(is_for_bus || pending->reply.cycle == 7);
}

static void run(const struct admin_request *request)
{
	static struct admin_pending pending;
	struct admin_target target = make_target();

	assert(admin_pending_init(&pending, request, 0) == 0);
	if (pending.state == ADMIN_PENDING_OPEN) {
		admin_command_run(&target, &pending);
	}
	if (pending.state == ADMIN_PENDING_OPEN) {
		finish(&pending, &target);
	}
	if (pending.state == ADMIN_PENDING_COMPLETE) {
		admin_command_report(&target, &pending);
	}
	assert(memchr(pending.reply.text, '\0', sizeof(pending.reply.text)) != NULL);
	assert(pending.reply.data_len <= ADMIN_DATA_BYTES);
	assert(pending.reply.result != 0 || pending.reply.text[0] == '\0');
	check_board();
	admin_pending_release(&pending);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
	static uint8_t message[sizeof(struct admin_request)];
	struct admin_request request;
	char why[ADMIN_TEXT_BYTES] = "";

	if (admin_request_parse(data, size, &request, why) == 0) {
		run(&request);
	}
	memset(message, 0, sizeof(message));
	memcpy(message, data, size < sizeof(message) ? size : sizeof(message));
	if (admin_request_parse(message, sizeof(message), &request, why) == 0) {
		run(&request);
	} else {
		assert(why[0] != '\0' && memchr(why, '\0', sizeof(why)) != NULL);
	}
	return 0;
}
