/* SPDX-License-Identifier: MIT */
/*
 * The bus's mailboxes: blocking SDO transfers for bring-up, others that are begun, and start-up
 * SDOs, of all slaves at the same time.
 */
#include <errno.h>
#include <inttypes.h>
#include <string.h>

#include "base/bytes.h"
#include "bus/bus_internal.h"
#include "bus/guests.h"
#include "image/entry.h"
#include "wire/sdo_abort.h"

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

static void tell_abort(struct bus *bus, size_t pos, int32_t object, uint32_t abort)
{
	bus_emit_event(bus, &bus->listener,
		       (struct event){ .id = EVENT_SDO_ABORT,
				       .slave_pos = (uint16_t)pos,
				       .value = abort,
				       .arg = { object, 0 } });
}

static int32_t object_of(uint16_t index, uint8_t subindex)
{
	return (int32_t)((uint32_t)index << 8 | subindex);
}

int bus_mailbox_submit(struct bus *bus, struct mailbox_request *rq)
{
	rq->timeout = (span_t){ bus->cfg->bus_mailbox_timeout_ns };
	if (rq->slave_pos >= bus->slave_count) {
		return -ENODEV;
	}
	if (!mailbox_slave_has(bus->mailbox, rq->slave_pos, rq->protocol->sii_bit)) {
		return -ENOTSUP;
	}
	return bus->slave[rq->slave_pos].is_lost ? -EIO : mailbox_submit(bus->mailbox, rq);
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
		tell_abort(bus, slave_pos, object_of(index, subindex), *ret_abort);
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
		tell_abort(bus, slave_pos, object_of(index, subindex), *ret_abort);
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

/* --- start-up SDOs --- */

static int line_of(const struct bus *bus, size_t pos)
{
	return pos < bus->cfg->slave_count ? bus->cfg->slave[pos].line : 0;
}

static struct config_sdo mode_sdo(const struct bus *bus, size_t pos)
{
	return (struct config_sdo){
		.slave_pos = (uint16_t)pos,
		.index = PICCOLO_OBJECT_MODE,
		.subindex = PICCOLO_SUBINDEX_MODE,
		.bytes = 1,
		.value = bus->slave[pos].mode == CONFIG_MODE_ONESHOT ? 1 : 0,
		.line = line_of(bus, pos),
	};
}

/* The slave's next one, the mode first: 1 and @ret; 0: there is none. */
static int next_sdo(const struct bus *bus, size_t pos, size_t *next, struct config_sdo *ret)
{
	if (*next == 0) {
		*next = 1;
		if (bus->slave[pos].mode != CONFIG_MODE_UNSET) {
			*ret = mode_sdo(bus, pos);
			return 1;
		}
	}
	while (*next <= bus->cfg->sdo_count) {
		const struct config_sdo *sdo = &bus->cfg->sdo[*next - 1];

		(*next)++;
		if (sdo->slave_pos == pos) {
			*ret = *sdo;
			return 1;
		}
	}
	return 0;
}

static void go_on(struct bus *bus, size_t pos)
{
	struct bus_startup *su = &bus->slave[pos].startup;
	int r;

	if (!next_sdo(bus, pos, &su->next, &su->sdo)) {
		su->state = STARTUP_DONE;
		return;
	}
	put_le64(su->data, su->sdo.value);
	su->request.buffer = su->data;
	su->request.capacity = su->sdo.bytes;
	su->request.with.coe = (struct coe_parameters){ .operation = COE_DOWNLOAD,
							.index = su->sdo.index,
							.subindex = su->sdo.subindex };
	r = bus_mailbox_submit(bus, &su->request);
	if (r < 0) {
		su->request.result = r;
		su->state = STARTUP_FAILED;
	}
}

static void startup_sdo_done(void *ctx, struct mailbox_request *rq)
{
	struct bus *bus = ctx;
	struct bus_startup *su = &bus->slave[rq->slave_pos].startup;

	if (rq->result < 0) {
		su->state = STARTUP_FAILED;
	} else {
		go_on(bus, rq->slave_pos);
	}
}

void bus_startup_begin(struct bus *bus, size_t pos)
{
	struct bus_startup *su = &bus->slave[pos].startup;

	bus_startup_cancel(bus, pos);
	*su = (struct bus_startup){
		.state = STARTUP_RUNNING,
		.request = { .protocol = &coe_protocol,
			     .slave_pos = (uint16_t)pos,
			     .done = startup_sdo_done,
			     .ctx = bus },
	};
	if (bus->slave[pos].mode != CONFIG_MODE_UNSET && !slave_is_piccolo(&bus->slave[pos].info)) {
		su->state = STARTUP_FAILED;
		su->request.result = -ENOTSUP;
		return;
	}
	go_on(bus, pos);
}

void bus_startup_cancel(struct bus *bus, size_t pos)
{
	struct bus_startup *su = &bus->slave[pos].startup;

	if (mailbox_is_running(&su->request)) {
		mailbox_cancel(bus->mailbox, &su->request);
	}
	su->state = STARTUP_IDLE;
}

static int fail_startup(struct bus *bus, size_t pos)
{
	const struct bus_slave *sl = &bus->slave[pos];
	const struct config_sdo *sdo = &sl->startup.sdo;
	const struct mailbox_request *rq = &sl->startup.request;

	if (sl->mode != CONFIG_MODE_UNSET && !slave_is_piccolo(&sl->info)) {
		return bus_fail_slave(
			bus, pos, -ENOTSUP,
			"mode is an option of the FB1111-Piccolo; this is vendor 0x%08x "
			"product 0x%08x",
			sl->info.vendor, sl->info.product);
	}
	if (rq->result == -EREMOTEIO && !rq->is_mailbox_error) {
		tell_abort(bus, pos, object_of(sdo->index, sdo->subindex), rq->detail);
		return bus_fail_slave(bus, pos, -EPROTO,
				      "start-up SDO 0x%04x:%02x = 0x%" PRIx64
				      " (%s:%d) rejected: abort "
				      "0x%08x, %s",
				      sdo->index, sdo->subindex, sdo->value, bus->cfg->path,
				      sdo->line, rq->detail, sdo_abort_to_str(rq->detail));
	}
	return bus_fail_slave(bus, pos, rq->result, "start-up SDO 0x%04x:%02x (%s:%d): %s",
			      sdo->index, sdo->subindex, bus->cfg->path, sdo->line,
			      rq->is_mailbox_error       ? mailbox_error_to_str(rq->detail)
			      : rq->result == -ENOTSUP   ? "the slave has no CoE mailbox"
			      : rq->result == -ETIMEDOUT ? "no answer from its mailbox"
							 : strerror(-rq->result));
}

int bus_startup_poll(struct bus *bus, size_t pos)
{
	struct bus_startup *su = &bus->slave[pos].startup;

	if (su->state == STARTUP_IDLE) {
		bus_startup_begin(bus, pos);
	}
	if (su->state == STARTUP_RUNNING) {
		return 1;
	}
	if (su->state == STARTUP_FAILED) {
		su->state = STARTUP_IDLE;
		return fail_startup(bus, pos);
	}
	su->state = STARTUP_IDLE;
	return 0;
}

int bus_startup_all(struct bus *bus)
{
	int r;

	for (size_t i = 0; i < bus->slave_count; i++) {
		bus_startup_begin(bus, i);
	}
	r = mailbox_wait_all(bus->mailbox);
	for (size_t i = 0; i < bus->slave_count; i++) {
		int one = r < 0 ? r : bus_startup_poll(bus, i);

		if (one < 0) {
			for (size_t k = 0; k < bus->slave_count; k++) {
				bus_startup_cancel(bus, k);
			}
			return one;
		}
	}
	return 0;
}
