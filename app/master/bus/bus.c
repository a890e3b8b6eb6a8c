/* SPDX-License-Identifier: MIT */
#include "bus/bus.h"

#include <errno.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>

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
		.esibuf = bus->sii_cache,
		.esimap = bus->sii_map,
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
	if (bus_mailbox_create(bus) < 0) {
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

void bus_destroy(struct bus *bus)
{
	if (bus != NULL) {
		mailbox_destroy(bus->mailbox);
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
