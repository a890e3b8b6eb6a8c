/* SPDX-License-Identifier: MIT */
#include "unit/master/admin/target.h"

#include <errno.h>
#include <stdio.h>
#include <string.h>

static struct channel channel(const char *name, uint16_t slave_pos,
			      enum channel_direction direction, enum channel_type type,
			      uint8_t bit_len)
{
	struct channel ch = {
		.slave_pos = slave_pos,
		.type = (uint8_t)type,
		.direction = (uint8_t)direction,
		.bit_len = bit_len,
		.scale = 1.0,
	};

	snprintf(ch.name, sizeof(ch.name), "%s", name);
	return ch;
}

void fake_init(struct fake *fake)
{
	struct config_output *level;

	memset(fake, 0, sizeof(*fake));
	fake->cfg.cycle_period_ns = FAKE_PERIOD_NS;
	fake->cfg.slave_count = 2;
	fake->cfg.slave[1].mode = CONFIG_MODE_ONESHOT;
	level = &fake->cfg.output[fake->cfg.output_count++];
	snprintf(level->channel, sizeof(level->channel), "a.level");
	level->owner = CONFIG_OWNER_LOCAL;
	level->min = -10;
	level->max = 10;
	fake->channels[FAKE_ADC] = channel("a.adc", 0, CHANNEL_INPUT, CHANNEL_UINT, 16);
	fake->channels[FAKE_LED] = channel("a.led", 0, CHANNEL_OUTPUT, CHANNEL_BOOL, 1);
	fake->channels[FAKE_LEVEL] = channel("a.level", 0, CHANNEL_OUTPUT, CHANNEL_INT, 8);
	fake->channels[FAKE_ONESHOT] =
		channel("b.oneshot_time", 1, CHANNEL_OUTPUT, CHANNEL_UINT, 64);
	snprintf(fake->slaves[0].name, sizeof(fake->slaves[0].name), "a");
	snprintf(fake->slaves[1].name, sizeof(fake->slaves[1].name), "b");
	fake->slaves[1].slave_pos = 1;
	fake->has_dc = 1;
	board_init(&fake->board);
}

static int dc_now(void *ctx, int64_t *ret_dc_ns)
{
	const struct fake *fake = ctx;

	if (!fake->has_dc) {
		return -EAGAIN;
	}
	*ret_dc_ns = FAKE_NOW_NS;
	return 0;
}

static void cancel_sdo(struct admin_pending *pending)
{
	struct fake *fake = pending->work;

	fake->cancels++;
	if (!fake->is_cancel_slow) {
		admin_pending_complete(pending, -ECANCELED);
	}
}

static void sdo(void *ctx, struct admin_pending *pending)
{
	struct fake *fake = ctx;

	fake->pending = pending;
	if (fake->is_sdo_slow) {
		pending->work = fake;
		pending->cancel = cancel_sdo;
		return;
	}
	pending->reply.slave_code = fake->sdo_abort;
	if (fake->sdo_result == 0 && pending->request.verb == ADMIN_SDO_READ) {
		pending->reply.data[0] = pending->request.subindex;
		pending->reply.data_len = 1;
	}
	admin_pending_complete(pending, fake->sdo_result);
}

static void poll_bus(struct admin_pending *pending, const struct admin_target *target)
{
	struct fake *fake = target->ctx;

	(void)pending;
	fake->frames++;
}

/* A register takes one frame, the state of a slave one in each pass. */
static void bus_request(void *ctx, struct admin_pending *pending)
{
	struct fake *fake = ctx;

	fake->frames++;
	if (pending->request.verb == ADMIN_STATE) {
		pending->poll = poll_bus;
	} else {
		admin_pending_complete(pending, 0);
	}
}

static void stop(void *ctx)
{
	struct fake *fake = ctx;

	fake->stops++;
}

static void clear(void *ctx)
{
	struct fake *fake = ctx;

	fake->clears++;
}

static void emit(void *ctx, const struct event *ev)
{
	struct fake *fake = ctx;

	fake->event[fake->events++ % FAKE_EVENTS] = *ev;
}

struct admin_target fake_target(struct fake *fake)
{
	return (struct admin_target){
		.cfg = &fake->cfg,
		.channels = fake->channels,
		.channel_count = FAKE_CHANNELS,
		.slaves = fake->slaves,
		.slave_count = 2,
		.board = &fake->board,
		.is_op = 1,
		.dc_now = dc_now,
		.mailbox = sdo,
		.bus_request = bus_request,
		.capture = sdo,
		.stop = stop,
		.clear = clear,
		.emit = emit,
		.ctx = fake,
	};
}

void fake_cycle(struct fake *fake, uint64_t cycle)
{
	struct board_set set = { .sequence = 0 };

	if (board_take(&fake->board, 3, &set)) {
		board_answer(&fake->board, set.sequence, cycle);
	}
}

struct admin_request fake_request(enum admin_verb verb)
{
	return (struct admin_request){ .magic = ADMIN_MAGIC, .verb = verb };
}

void fake_item(struct admin_request *request, const char *name, uint64_t raw)
{
	struct admin_item *item = &request->item[request->count++];

	snprintf(item->channel, sizeof(item->channel), "%s", name);
	item->raw = raw;
}
