/* SPDX-License-Identifier: MIT */
#include "unit/master/daemon/fake_bus.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "bus/differences.h"
#include "bus/esc_access.h"
#include "bus/exchange_list.h"
#include "mailbox/mailbox.h"

enum { IMAGE_BYTES = 3, ROUND_TRIP_NS = 20000 };

struct fake_bus fake_bus;

static const struct slave_info slaves[] = {
	{ .name = "a",
	  .device = "fake",
	  .vendor = 2,
	  .has_dc = 1,
	  .is_dc_reference = 1,
	  .counter_channel = -1,
	  .input_bits = 16,
	  .output_bits = 1 },
};

static const struct channel channels[] = {
	{ .name = "a.led",
	  .type = CHANNEL_BOOL,
	  .direction = CHANNEL_OUTPUT,
	  .bit_len = 1,
	  .bit_offset = 0,
	  .scale = 1.0 },
	{ .name = "a.adc",
	  .type = CHANNEL_UINT,
	  .direction = CHANNEL_INPUT,
	  .bit_len = 16,
	  .bit_offset = 8,
	  .scale = 1.0 },
};

static const struct exchange_plan plan = {
	.image_bytes = IMAGE_BYTES,
	.output_bytes = 1,
	.chunk_bytes = { IMAGE_BYTES },
	.chunk_count = 1,
	.chunk_wkc = { 3 },
	.wkc_expected = 3,
	.dc_reference = 0x1001,
	.slave_count = 1,
	.monitor = 1,
};

void fake_bus_init(void)
{
	fake_bus = (struct fake_bus){
		.mono_ns = 1000 * NS_PER_S,
		.tai_ns = 800000000 * NS_PER_S,
		.report = { .slaves_op = 1, .slaves_lost = 0, .is_all_op = 1 },
		.is_link_up = 1,
	};
}

/* --- clock --- */

static mono_t now(void *ctx)
{
	(void)ctx;
	return (mono_t){ fake_bus.mono_ns };
}

static int64_t tai(void *ctx)
{
	(void)ctx;
	return fake_bus.tai_ns + fake_bus.mono_ns;
}

static int sleep_until(void *ctx, mono_t deadline)
{
	(void)ctx;
	if (deadline.ns > fake_bus.mono_ns) {
		fake_bus.mono_ns = deadline.ns;
	}
	return 0;
}

struct platform fake_platform(void)
{
	return (struct platform){ .now = now, .tai_ns = tai, .sleep_until = sleep_until };
}

static int send_frame(void *ctx, const uint8_t *frame, size_t len)
{
	(void)ctx;
	(void)frame;
	(void)len;
	return 0;
}

static int receive(void *ctx, uint8_t *frame, size_t capacity, mono_t deadline, mono_t *ret_at)
{
	(void)frame;
	(void)capacity;
	(void)ret_at;
	sleep_until(ctx, deadline);
	return -EAGAIN;
}

static int is_up(void *ctx)
{
	(void)ctx;
	fake_bus.link_queries++;
	return fake_bus.is_link_up;
}

static void destroy(void *ctx)
{
	(void)ctx;
	fake_bus.transports--;
}

struct transport fake_transport(void)
{
	fake_bus.transports++;
	return (struct transport){
		.send = send_frame, .receive = receive, .is_up = is_up, .destroy = destroy
	};
}

/* --- bus/bus.h --- */

struct bus {
	const struct config *cfg;
};

static int step(enum fake_step which, const char *name, char *error)
{
	size_t used = strlen(fake_bus.steps);

	snprintf(fake_bus.steps + used, sizeof(fake_bus.steps) - used, "%s ", name);
	if (fake_bus.fails_at == which) {
		snprintf(error, BUS_ERROR_BYTES, "%s: does not work", name);
		return fake_bus.result;
	}
	return 0;
}

int bus_create(const struct config *cfg, struct line *line, struct bus **ret_bus)
{
	(void)line;
	*ret_bus = calloc(1, sizeof(struct bus));
	if (*ret_bus == NULL) {
		return -ENOMEM;
	}
	(*ret_bus)->cfg = cfg;
	return 0;
}

const struct config *bus_config(const struct bus *bus)
{
	return bus->cfg;
}

void bus_listen(struct bus *bus, void (*emit)(void *ctx, const struct event *ev), void *emit_ctx)
{
	(void)bus;
	(void)emit;
	(void)emit_ctx;
}

void bus_destroy(struct bus *bus)
{
	free(bus);
}

int bus_scan(struct bus *bus, char *error)
{
	(void)bus;
	return step(FAKE_SCAN, "scan", error);
}

int bus_compare(const struct bus *bus, char *error)
{
	(void)bus;
	return step(FAKE_COMPARE, "compare", error);
}

void bus_config_follow(struct bus *bus)
{
	(void)bus;
}

int bus_map(struct bus *bus, char *error)
{
	(void)bus;
	return step(FAKE_MAP, "map", error);
}

int bus_dc_setup(struct bus *bus, char *error)
{
	(void)bus;
	return step(FAKE_DC_SETUP, "dc_setup", error);
}

int exchange_list(const struct exchange_plan *of, const struct exchange *ex,
		  struct exchange_datagram *ret, size_t capacity)
{
	(void)of;
	(void)ex;
	(void)ret;
	(void)capacity;
	return 0;
}

void bus_show_places(const struct bus *bus, struct status_page *page)
{
	(void)bus;
	(void)page;
}

int bus_sync0_start(struct bus *bus, int64_t dc_now_ns, char *error)
{
	(void)bus;
	(void)dc_now_ns;
	return step(FAKE_SYNC0, "sync0", error);
}

int bus_request_state(struct bus *bus, enum al_state state, span_t timeout, char *error)
{
	(void)bus;
	(void)timeout;
	return state == AL_OP ? step(FAKE_OP, "op", error) : step(FAKE_SAFEOP, "safeop", error);
}

int bus_slave_al_request(struct bus *bus, size_t pos, uint16_t request, char *error)
{
	(void)bus;
	(void)pos;
	(void)request;
	(void)error;
	return 0;
}

int bus_slave_al_read(struct bus *bus, size_t pos, uint8_t ret_al[6], char *error)
{
	(void)bus;
	(void)pos;
	(void)error;
	ret_al[0] = AL_PREOP;
	return 0;
}

int bus_slave_has_boot(const struct bus *bus, size_t pos)
{
	(void)bus;
	(void)pos;
	return 1;
}

int bus_slave_mailbox_program(struct bus *bus, size_t pos, uint16_t state, char *error)
{
	(void)bus;
	(void)pos;
	(void)state;
	(void)error;
	return 0;
}

int bus_slave_set_up(struct bus *bus, size_t pos, uint16_t state, char *error)
{
	(void)bus;
	(void)pos;
	(void)state;
	(void)error;
	return 0;
}

void bus_slave_mailbox_follow(struct bus *bus, size_t pos, uint16_t state)
{
	(void)bus;
	(void)pos;
	(void)state;
}

int bus_startup(struct bus *bus, enum config_transition transition, char *error)
{
	(void)bus;
	(void)transition;
	(void)error;
	return 0;
}

int bus_has_startup(const struct bus *bus, enum config_transition transition)
{
	(void)bus;
	(void)transition;
	return 0;
}

int bus_startup_down(struct bus *bus, char *error)
{
	(void)bus;
	(void)error;
	return 0;
}

int bus_stop_outputs(struct bus *bus, char *error)
{
	(void)bus;
	return step(FAKE_SAFEOP, "safeop", error);
}

int bus_stop(struct bus *bus, char *error)
{
	(void)bus;
	return step(FAKE_STOP, "stop", error);
}

int bus_watch(struct bus *bus, struct status_page *page,
	      void (*emit)(void *ctx, const struct event *ev), void *emit_ctx,
	      struct bus_watch_report *ret_report)
{
	(void)bus;
	(void)page;
	(void)emit;
	(void)emit_ctx;
	*ret_report = fake_bus.report;
	return 0;
}

void bus_clear_alarms(struct bus *bus)
{
	(void)bus;
}

int bus_reference_is_itself(struct bus *bus)
{
	(void)bus;
	return 1;
}

void bus_lead_back(struct bus *bus, void (*emit)(void *ctx, const struct event *ev), void *emit_ctx)
{
	(void)bus;
	(void)emit;
	(void)emit_ctx;
	if (fake_bus.led_back != NULL) {
		fake_bus.led_back(fake_bus.led_back_ctx);
	}
}

const struct slave_info *bus_slaves(const struct bus *bus, size_t *ret_count)
{
	(void)bus;
	*ret_count = 1;
	return slaves;
}

size_t bus_startup_list(const struct bus *bus, size_t pos, uint8_t *buf, size_t buf_len)
{
	(void)bus;
	(void)pos;
	(void)buf;
	(void)buf_len;
	return 0;
}

const struct channel *bus_channels(const struct bus *bus, size_t *ret_count)
{
	(void)bus;
	*ret_count = sizeof(channels) / sizeof(channels[0]);
	return channels;
}

void bus_use_esi(struct bus *bus, const struct bus_esi *esi)
{
	(void)bus;
	(void)esi;
}

const struct schedule *bus_schedule(const struct bus *bus)
{
	static const struct schedule schedule = { .need_ns = 50000, .allowed_ns = 400000 };

	(void)bus;
	return &schedule;
}

const struct exchange_plan *bus_plan(const struct bus *bus)
{
	(void)bus;
	return &plan;
}

/* A read gives its subindex; a write is aborted. The answer comes with the next step. */
static struct mailbox_request *sdo;

int bus_mailbox_submit(struct bus *bus, struct mailbox_request *rq)
{
	(void)bus;
	rq->result = -EINPROGRESS;
	sdo = rq;
	return 0;
}

void bus_mailbox_cancel(struct bus *bus, struct mailbox_request *rq)
{
	(void)bus;
	sdo = NULL;
	rq->result = -ECANCELED;
	rq->done(rq->ctx, rq);
}

struct mailbox_engine *bus_mailbox(struct bus *bus)
{
	(void)bus;
	return NULL;
}

int bus_is_busy(const struct bus *bus)
{
	(void)bus;
	return sdo != NULL;
}

void bus_step(struct bus *bus, const struct exchange *ex)
{
	struct mailbox_request *rq = sdo;

	(void)bus;
	(void)ex;
	if (rq == NULL) {
		return;
	}
	sdo = NULL;
	if (rq->with.coe.operation == COE_UPLOAD) {
		rq->buffer[0] = rq->with.coe.subindex;
		rq->len = 1;
		rq->result = 0;
	} else {
		rq->detail = 0x06020000;
		rq->result = -EREMOTEIO;
	}
	rq->done(rq->ctx, rq);
}

/* --- bus/exchange.h --- */

struct exchange {
	int unused;
};

int exchange_create(const struct exchange_plan *wanted, struct line *line,
		    struct exchange **ret_exchange)
{
	(void)wanted;
	(void)line;
	*ret_exchange = calloc(1, sizeof(struct exchange));
	return 0;
}

void exchange_destroy(struct exchange *ex)
{
	free(ex);
}

struct exchange_result exchange_run(struct exchange *ex, uint8_t *image, mono_t deadline)
{
	struct exchange_result res = {
		.status = EXCHANGE_OK,
		.wkc = 3,
		.wkc_expected = 3,
		.al_status = AL_OP,
		.al_wkc = 1,
		.dc_diff_ns = 5,
		.sent = { fake_bus.mono_ns },
		.round_trip = { ROUND_TRIP_NS },
		.doubled = fake_bus.is_doubled ? 1 : 0,
	};

	(void)ex;
	fake_bus.exchanges++;
	fake_bus.led = image[0] & 1;
	if (fake_bus.lost_every != 0 && fake_bus.exchanges % fake_bus.lost_every == 0) {
		res.status = EXCHANGE_NO_FRAME;
		res.round_trip.ns = -1;
		fake_bus.mono_ns = deadline.ns;
		return res;
	}
	res.dc_time_ns = 100 * NS_PER_S + fake_bus.mono_ns + fake_bus.mono_ns / 20000;
	if (fake_bus.is_dc_running_away) {
		res.dc_time_ns += fake_bus.mono_ns / 20;
	}
	fake_bus.mono_ns += ROUND_TRIP_NS;
	return res;
}

unsigned exchange_ride(struct exchange *ex, const struct exchange_window *window)
{
	(void)ex;
	(void)window;
	return 0;
}

int exchange_doubts_reference(const struct exchange *ex)
{
	(void)ex;
	return 0;
}

void exchange_confirm_reference(struct exchange *ex)
{
	(void)ex;
}

/* --- esc_access.h: no slave of this bus answers --- */

static int no_answer(char *error)
{
	snprintf(error, BUS_ERROR_BYTES, "does not answer");
	return -ENXIO;
}

int esc_access_read(struct bus *bus, size_t pos, uint16_t reg, uint8_t *ret_data, size_t len,
		    char *error)
{
	(void)bus;
	(void)pos;
	(void)reg;
	(void)ret_data;
	(void)len;
	return no_answer(error);
}

int esc_access_write(struct bus *bus, size_t pos, uint16_t reg, const uint8_t *data, size_t len,
		     enum esc_guard guard, char *error)
{
	(void)bus;
	(void)pos;
	(void)reg;
	(void)data;
	(void)len;
	(void)guard;
	return no_answer(error);
}

int esc_diagnosis_read(struct bus *bus, size_t pos, struct esc_diagnosis *ret, char *error)
{
	(void)bus;
	(void)pos;
	(void)ret;
	return no_answer(error);
}

int esc_errors_reset(struct bus *bus, size_t pos, char *error)
{
	(void)bus;
	(void)pos;
	return no_answer(error);
}

int sii_job_read(struct sii_job *job, struct bus *bus, size_t pos, uint8_t *image, size_t capacity)
{
	(void)bus;
	(void)pos;
	(void)image;
	(void)capacity;
	return no_answer(job->error);
}

int sii_job_write(struct sii_job *job, struct bus *bus, size_t pos, const uint8_t *image,
		  size_t len_bytes, enum esc_guard guard)
{
	(void)bus;
	(void)pos;
	(void)image;
	(void)len_bytes;
	(void)guard;
	return no_answer(job->error);
}

int sii_job_alias(struct sii_job *job, struct bus *bus, size_t pos, uint16_t alias,
		  enum esc_guard guard)
{
	(void)bus;
	(void)pos;
	(void)alias;
	(void)guard;
	return no_answer(job->error);
}

int sii_job_step(struct sii_job *job)
{
	return no_answer(job->error);
}

const uint8_t *bus_slave_sii(const struct bus *bus, size_t pos, size_t *ret_bytes)
{
	(void)bus;
	(void)pos;
	*ret_bytes = 0;
	return NULL;
}

int differences_of_bus(const struct bus *bus, const struct config *cfg, struct differences *list)
{
	(void)bus;
	(void)cfg;
	(void)list;
	return 0;
}

void differences_free(struct differences *list)
{
	(void)list;
}
