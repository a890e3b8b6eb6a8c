/* SPDX-License-Identifier: MIT */
#include "bus/bus.h"

#include <errno.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/bytes.h"
#include "bus/bus_internal.h"

static void bind_soem(struct bus *bus)
{
	bus->context = (ecx_contextt){
		.port = &bus->port,
		.slavelist = bus->soem_slave,
		.slavecount = &bus->soem_slave_count,
		.maxslave = LIMIT_SLAVES + 1,
		.grouplist = bus->group,
		.maxgroup = EC_MAXGROUP,
		.elist = &bus->errors,
		.idxstack = &bus->index_stack,
		.ecaterror = &bus->has_error,
		.DCtime = &bus->dc_time,
		.SMcommtype = &bus->sm_comm_type,
		.PDOassign = &bus->pdo_assign,
		.PDOdesc = &bus->pdo_description,
		.eepSM = &bus->sii_sm,
		.eepFMMU = &bus->sii_fmmu,
		.manualstatechange = 1,
	};
}

/* --- the mailbox engine: its wire is the mailbox slot of the line --- */

static int submit(void *ctx, const uint8_t *frame, size_t frame_len)
{
	return line_submit(ctx, LINE_MAILBOX, frame, frame_len);
}

static int collect(void *ctx, uint8_t *ret_answer, size_t capacity)
{
	return line_collect(ctx, LINE_MAILBOX, ret_answer, capacity);
}

static size_t frame_limit(void *ctx)
{
	return line_frame_limit(ctx);
}

static mono_t now(void *ctx)
{
	const struct platform *platform = line_platform(ctx);

	return platform->now(platform->ctx);
}

static int sleep_for(void *ctx, span_t span)
{
	return line_sleep(ctx, span);
}

static void take_coe(void *ctx, uint16_t slave_pos, const uint8_t *data, size_t len)
{
	struct bus *bus = ctx;
	struct coe_emergency em;

	if (coe_emergency_get(data, len, &em)) {
		uint8_t bytes[8] = { 0 };

		memcpy(bytes, em.data, sizeof(em.data));
		bus_emit_event(bus, &bus->listener,
			       (struct event){ .id = EVENT_EMERGENCY,
					       .slave_pos = slave_pos,
					       .value = (int64_t)get_le64(bytes),
					       .arg = { em.code, em.error_register } });
	}
}

static int create_mailbox(struct bus *bus)
{
	const struct mailbox_wire wire = { .submit = submit,
					   .collect = collect,
					   .frame_limit = frame_limit,
					   .now = now,
					   .sleep = sleep_for,
					   .ctx = bus->line };
	int r = mailbox_create(&wire, &bus->mailbox);

	if (r >= 0) {
		mailbox_sink_set(bus->mailbox, MAILBOX_TYPE_COE, take_coe, bus);
	}
	return r;
}

int bus_create(const struct config *cfg, struct line *line, struct bus **ret_bus)
{
	struct bus *bus = calloc(1, sizeof(*bus));

	if (bus == NULL) {
		return -ENOMEM;
	}
	bus->wanted = cfg;
	bus->cfg = cfg;
	bus->line = line;
	bus->reference = -1;
	bind_soem(bus);
	if (create_mailbox(bus) < 0) {
		free(bus);
		return -ENOMEM;
	}
	line_bind(line);
	ecx_init(&bus->context, "");
	*ret_bus = bus;
	return 0;
}

void bus_listen(struct bus *bus, void (*emit)(void *ctx, const struct event *ev), void *emit_ctx)
{
	bus->listener = (struct bus_emit){ .call = emit, .ctx = emit_ctx };
}

void bus_use_esi(struct bus *bus, const struct bus_esi *esi)
{
	bus->esi = *esi;
}

void bus_sii_free(struct bus *bus)
{
	for (size_t i = 0; i < LIMIT_SLAVES; i++) {
		free(bus->slave[i].sii);
		bus->slave[i].sii = NULL;
		bus->slave[i].sii_len = 0;
	}
}

void bus_destroy(struct bus *bus)
{
	if (bus != NULL) {
		mailbox_destroy(bus->mailbox);
		bus_sii_free(bus);
		free(bus->pdo);
		free(bus->startup);
		free(bus->assign);
		free(bus->module);
		free(bus->channel);
		free(bus);
	}
}

mono_t bus_now(const struct bus *bus)
{
	const struct platform *platform = line_platform(bus->line);

	return platform->now(platform->ctx);
}

void bus_emit_event(struct bus *bus, const struct bus_emit *emit, struct event ev)
{
	const struct platform *platform = line_platform(bus->line);

	if (emit->call == NULL) {
		return;
	}
	ev.mono_ns = platform->now(platform->ctx).ns;
	ev.tai_ns = platform->tai_ns(platform->ctx);
	emit->call(emit->ctx, &ev);
}

int bus_fail(struct bus *bus, int code, const char *format, ...)
{
	va_list args;

	if (bus->error != NULL) {
		va_start(args, format);
		vsnprintf(bus->error, BUS_ERROR_BYTES, format, args);
		va_end(args);
	}
	return code;
}

int bus_fail_slave(struct bus *bus, size_t pos, int code, const char *format, ...)
{
	va_list args;
	int used;

	if (bus->error == NULL) {
		return code;
	}
	used = snprintf(bus->error, BUS_ERROR_BYTES, "slave %zu (%s): ", pos,
			bus->slave[pos].info.name[0] != '\0' ? bus->slave[pos].info.name : "?");
	if (used > 0 && used < BUS_ERROR_BYTES) {
		va_start(args, format);
		vsnprintf(bus->error + used, (size_t)(BUS_ERROR_BYTES - used), format, args);
		va_end(args);
	}
	return code;
}

const struct slave_info *bus_slaves(const struct bus *bus, size_t *ret_count)
{
	*ret_count = bus->slave_count;
	return bus->info;
}

const uint8_t *bus_slave_sii(const struct bus *bus, size_t pos, size_t *ret_bytes)
{
	*ret_bytes = bus->slave[pos].sii_len;
	return bus->slave[pos].sii;
}

const struct channel *bus_channels(const struct bus *bus, size_t *ret_count)
{
	*ret_count = bus->channel_count;
	return bus->channel;
}

const struct schedule *bus_schedule(const struct bus *bus)
{
	return &bus->schedule;
}

const struct exchange_plan *bus_plan(const struct bus *bus)
{
	return &bus->plan;
}
