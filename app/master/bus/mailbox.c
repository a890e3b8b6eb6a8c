/* SPDX-License-Identifier: MIT */
/*
 * The bus's mailboxes: blocking SDO transfers for bring-up, and others that are begun.
 */
#include <errno.h>
#include <string.h>

#include "base/bytes.h"
#include "bus/bus_internal.h"
#include "bus/guests.h"

/* Boxes that no frame can carry: a slave without a mailbox. */
static void open_mailbox(struct bus *bus, size_t pos, const struct mailbox_slave_spec *spec)
{
	if (spec->out_bytes == 0 || mailbox_slave_set(bus->mailbox, (uint16_t)pos, spec) < 0) {
		mailbox_slave_set(bus->mailbox, (uint16_t)pos, NULL);
	}
}

void bus_mailbox_set(struct bus *bus, size_t pos)
{
	const ec_slavet *soem = &bus->soem_slave[soem_index(pos)];
	const struct mailbox_slave_spec spec = { .station_addr = bus->slave[pos].info.station_addr,
						 .out_start = soem->mbx_wo,
						 .out_bytes = soem->mbx_l,
						 .in_start = soem->mbx_ro,
						 .in_bytes = soem->mbx_rl,
						 .protocols = soem->mbx_proto };

	open_mailbox(bus, pos, &spec);
}

int bus_slave_has_boot(const struct bus *bus, size_t pos)
{
	return bus->slave[pos].boot.out_bytes > 0;
}

int bus_slave_mailbox_program(struct bus *bus, size_t pos, uint16_t state, char *error)
{
	int r;

	bus->error = error;
	mailbox_slave_set(bus->mailbox, (uint16_t)pos, NULL);
	if (state != AL_BOOT && bus->soem_slave[soem_index(pos)].mbx_l == 0) {
		return 0;
	}
	r = bus_mailbox_program(bus, pos, state);
	return r < 0 ? bus_fail_slave(bus, pos, r,
				      "its mailbox SyncManagers (0x0800) cannot be written")
		     : 0;
}

void bus_slave_mailbox_follow(struct bus *bus, size_t pos, uint16_t state)
{
	if (state == AL_INIT) {
		mailbox_slave_set(bus->mailbox, (uint16_t)pos, NULL);
	} else if (mailbox_slave_has(bus->mailbox, (uint16_t)pos, UINT16_MAX)) {
		return; /* what runs there goes on */
	} else if (state == AL_BOOT) {
		open_mailbox(bus, pos, &bus->slave[pos].boot);
	} else {
		bus_mailbox_set(bus, pos);
	}
}

struct mailbox_engine *bus_mailbox(struct bus *bus)
{
	return bus->mailbox;
}

void bus_step(struct bus *bus, const struct exchange *ex)
{
	bus_mailbox_state_follow(bus, ex);
	mailbox_step(bus->mailbox);
	bus_guests_step(bus);
}

int bus_is_busy(const struct bus *bus)
{
	return mailbox_is_busy(bus->mailbox) || bus_guests_is_reading(bus);
}

int bus_has_coe(const struct bus *bus, size_t pos)
{
	return mailbox_slave_has(bus->mailbox, (uint16_t)pos, SII_MAILBOX_COE);
}

/* --- one transfer; blocking --- */

/* NOLINTNEXTLINE(readability-function-size): as bus_sdo_read() */
void bus_tell_abort(struct bus *bus, size_t pos, uint16_t index, uint8_t subindex, uint32_t abort)
{
	bus_emit_event(bus, &bus->listener,
		       (struct event){ .id = EVENT_SDO_ABORT,
				       .slave_pos = (uint16_t)pos,
				       .value = abort,
				       .arg = { (int32_t)((uint32_t)index << 8 | subindex), 0 } });
}

static span_t longer(int64_t configured_ns, int64_t esi_ns)
{
	return (span_t){ esi_ns > configured_ns ? esi_ns : configured_ns };
}

int bus_mailbox_submit(struct bus *bus, struct mailbox_request *rq)
{
	const struct bus_slave *sl = &bus->slave[rq->slave_pos];

	if (rq->slave_pos >= bus->slave_count) {
		return -ENODEV;
	}
	rq->timeout = longer(bus->cfg->bus_mailbox_timeout_ns, sl->esi.response_ns);
	rq->send_timeout = longer(bus->cfg->bus_mailbox_timeout_ns, sl->esi.request_ns);
	if (!mailbox_slave_has(bus->mailbox, rq->slave_pos, rq->protocol->sii_bit)) {
		return -ENOTSUP;
	}
	return sl->is_lost ? -EIO : mailbox_submit(bus->mailbox, rq);
}

void bus_mailbox_cancel(struct bus *bus, struct mailbox_request *rq)
{
	mailbox_cancel(bus->mailbox, rq);
}

static int run(struct bus *bus, struct mailbox_request *rq)
{
	int r = -ENOENT;

	rq->protocol = &coe_protocol;
	if (bus->ahead != NULL && rq->with.coe.operation != COE_DOWNLOAD) {
		r = bus_read_ahead_take(bus, rq);
	}
	if (r != -ENOENT) {
		return r;
	}
	r = bus_mailbox_submit(bus, rq);
	return r < 0 ? r : mailbox_wait(bus->mailbox, rq);
}

/* NOLINTNEXTLINE(readability-function-size): as bus_sdo_read() */
static int read_sdo(struct bus *bus, uint16_t slave_pos, uint16_t index, uint8_t subindex,
		    uint8_t *ret_data, size_t *len, uint32_t *ret_abort)
{
	struct mailbox_request rq = {
		.slave_pos = slave_pos,
		.with.coe = { .operation = COE_UPLOAD, .index = index, .subindex = subindex },
		.buffer = ret_data,
		.capacity = *len,
	};
	int r = run(bus, &rq);

	*ret_abort = rq.is_mailbox_error ? 0 : rq.detail;
	if (r == 0) {
		*len = rq.len;
	}
	return r;
}

/* NOLINTNEXTLINE(readability-function-size): the interface of bus.h */
int bus_sdo_read(struct bus *bus, uint16_t slave_pos, uint16_t index, uint8_t subindex,
		 uint8_t *ret_data, size_t *len, uint32_t *ret_abort)
{
	int r = read_sdo(bus, slave_pos, index, subindex, ret_data, len, ret_abort);

	if (r == -EREMOTEIO) {
		bus_tell_abort(bus, slave_pos, index, subindex, *ret_abort);
	}
	return r;
}

/* NOLINTNEXTLINE(readability-function-size): the interface of bus.h */
int bus_sdo_write(struct bus *bus, uint16_t slave_pos, uint16_t index, uint8_t subindex,
		  const uint8_t *data, size_t len, uint32_t *ret_abort)
{
	struct mailbox_request rq = {
		.slave_pos = slave_pos,
		.with.coe = { .operation = COE_DOWNLOAD, .index = index, .subindex = subindex },
		.buffer = (uint8_t *)(uintptr_t)data, /* a download only reads it */
		.capacity = len,
	};
	int r;

	if (bus->ahead != NULL) {
		if (bus_read_ahead_forbids(bus)) {
			return -ECANCELED;
		}
		bus_read_ahead_forget(bus, slave_pos);
	}
	r = run(bus, &rq);
	*ret_abort = rq.is_mailbox_error ? 0 : rq.detail;
	if (r == -EREMOTEIO) {
		bus_tell_abort(bus, slave_pos, index, subindex, *ret_abort);
	}
	return r;
}

/* Looking whether an object is there: an abort is an answer, and no event. */
int bus_sdo_value(struct bus *bus, size_t pos, uint16_t index, uint8_t subindex,
		  uint64_t *ret_value, uint32_t *ret_abort)
{
	uint8_t data[8] = { 0 };
	size_t len = sizeof(data);
	int r = read_sdo(bus, (uint16_t)pos, index, subindex, data, &len, ret_abort);

	if (r < 0) {
		return r;
	}
	for (size_t i = len; i < sizeof(data); i++) {
		data[i] = 0;
	}
	*ret_value = get_le64(data);
	return 0;
}

int bus_sdo_entry(struct bus *bus, size_t pos, uint16_t index, uint8_t subindex,
		  struct coe_entry *ret_entry)
{
	uint8_t description[MAILBOX_BYTES];
	struct mailbox_request rq = {
		.slave_pos = (uint16_t)pos,
		.with.coe = { .operation = COE_ENTRY, .index = index, .subindex = subindex },
		.buffer = description,
		.capacity = sizeof(description),
	};
	int r = run(bus, &rq);

	return r < 0 ? r : coe_entry_get(description, rq.len, ret_entry);
}
