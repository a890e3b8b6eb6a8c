/* SPDX-License-Identifier: MIT */
/*
 * SDO transfers on SOEM's mailbox. A mailbox write is sent once only (link/nicdrv.c), so a lost one
 * is recovered here: the whole transfer is retried with a new counter after the mailbox has been
 * emptied (T42).
 */
#include <errno.h>
#include <inttypes.h>
#include <string.h>

#include "base/bytes.h"
#include "bus/bus_internal.h"

#include "ethercatprint.h"

enum { TRIES = 3, FAST_US = 100000, SOEM_TOO_SMALL = 3 };

int bus_has_coe(const struct bus *bus, size_t pos)
{
	const ec_slavet *soem = &bus->soem_slave[soem_index(pos)];

	return soem->mbx_l > 0 && (soem->mbx_proto & ECT_MBXPROT_COE) != 0;
}

static const char *abort_text(uint32_t abort)
{
	return ec_sdoerror2string(abort);
}

static void tell_emergency(struct bus *bus, const ec_errort *note)
{
	uint64_t data = (uint64_t)note->b1 | (uint64_t)note->w1 << 8 | (uint64_t)note->w2 << 24;

	bus_emit_event(bus, &bus->listener,
		       (struct event){ .id = EVENT_EMERGENCY,
				       .slave_pos = (uint16_t)(note->Slave - 1),
				       .value = (int64_t)data,
				       .arg = { note->ErrorCode, note->ErrorReg } });
}

/*
 * What SOEM noted about the transfer that failed: -EREMOTEIO abort, -EMSGSIZE, -ETIMEDOUT nothing.
 * An emergency of any slave that came meanwhile is reported (T30).
 */
static int take_errors(struct bus *bus, uint16_t index, uint32_t *ret_abort)
{
	int result = -ETIMEDOUT;
	ec_errort note;

	while (ecx_poperror(&bus->context, &note)) {
		if (note.Etype == EC_ERR_TYPE_EMERGENCY) {
			tell_emergency(bus, &note);
		} else if (note.Etype == EC_ERR_TYPE_SDO_ERROR && note.Index == index) {
			*ret_abort = (uint32_t)note.AbortCode;
			result = -EREMOTEIO;
		} else if (note.Etype == EC_ERR_TYPE_PACKET_ERROR && note.Index == index &&
			   note.ErrorCode == SOEM_TOO_SMALL) {
			result = -EMSGSIZE;
		}
	}
	return result;
}

static int check_request(const struct bus *bus, size_t pos)
{
	if (pos >= bus->slave_count) {
		return -ENODEV;
	}
	if (!bus_has_coe(bus, pos)) {
		return -ENOTSUP;
	}
	return bus->slave[pos].is_lost ? -EIO : 0;
}

/* During recovery a dead mailbox must not delay the other slaves. */
static int timeout_us(const struct bus *bus, size_t pos)
{
	return bus->slave[pos].step != RECOVERY_NONE ? FAST_US : EC_TIMEOUTRXM;
}

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

/* NOLINTNEXTLINE(readability-function-size): as bus_sdo_read() */
static int read_sdo(struct bus *bus, uint16_t slave_pos, uint16_t index, uint8_t subindex,
		    uint8_t *ret_data, size_t *len, uint32_t *ret_abort)
{
	int r = check_request(bus, slave_pos);
	uint32_t abort = 0;

	*ret_abort = 0;
	if (r < 0) {
		return r;
	}
	r = -ETIMEDOUT;
	take_errors(bus, index, &abort);
	for (int i = 0; i < TRIES && r == -ETIMEDOUT; i++) {
		int size = (int)*len;

		if (ecx_SDOread(&bus->context, soem_index(slave_pos), index, subindex, FALSE, &size,
				ret_data, timeout_us(bus, slave_pos)) > 0) {
			*len = (size_t)size;
			take_errors(bus, index, &abort);
			return 0;
		}
		r = take_errors(bus, index, ret_abort);
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
	int r = check_request(bus, slave_pos);
	uint32_t abort = 0;

	*ret_abort = 0;
	if (r < 0) {
		return r;
	}
	r = -ETIMEDOUT;
	take_errors(bus, index, &abort);
	for (int i = 0; i < TRIES && r == -ETIMEDOUT; i++) {
		if (ecx_SDOwrite(&bus->context, soem_index(slave_pos), index, subindex, FALSE,
				 (int)len, data, timeout_us(bus, slave_pos)) > 0) {
			take_errors(bus, index, &abort);
			return 0;
		}
		r = take_errors(bus, index, ret_abort);
	}
	if (r == -EREMOTEIO) {
		tell_abort(bus, slave_pos, object_of(index, subindex), *ret_abort);
	}
	return r;
}

void bus_read_mail(struct bus *bus, size_t pos)
{
	ec_mbxbuft mail = { 0 };
	uint32_t abort;

	/* A stale answer is dropped with it. */
	ecx_mbxreceive(&bus->context, soem_index(pos), &mail, 0);
	take_errors(bus, 0, &abort);
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

static int write_startup(struct bus *bus, size_t pos, const struct config_sdo *sdo)
{
	uint8_t data[8];
	uint32_t abort;
	int r;

	put_le64(data, sdo->value);
	r = bus_sdo_write(bus, (uint16_t)pos, sdo->index, sdo->subindex, data, sdo->bytes, &abort);
	if (r == -EREMOTEIO) {
		return bus_fail_slave(bus, pos, -EPROTO,
				      "start-up SDO 0x%04x:%02x = 0x%" PRIx64
				      " (%s:%d) rejected: abort "
				      "0x%08x, %s",
				      sdo->index, sdo->subindex, sdo->value, bus->cfg->path,
				      sdo->line, abort, abort_text(abort));
	}
	if (r < 0) {
		return bus_fail_slave(bus, pos, r, "start-up SDO 0x%04x:%02x (%s:%d): %s",
				      sdo->index, sdo->subindex, bus->cfg->path, sdo->line,
				      r == -ENOTSUP ? "the slave has no CoE mailbox"
						    : strerror(-r));
	}
	return 0;
}

static int write_mode(struct bus *bus, size_t pos)
{
	const struct bus_slave *sl = &bus->slave[pos];
	struct config_sdo sdo = {
		.index = PICCOLO_OBJECT_MODE,
		.subindex = PICCOLO_SUBINDEX_MODE,
		.bytes = 1,
		.value = sl->mode == CONFIG_MODE_ONESHOT ? 1 : 0,
		.line = pos < bus->cfg->slave_count ? bus->cfg->slave[pos].line : 0,
	};

	if (sl->mode == CONFIG_MODE_UNSET) {
		return 0;
	}
	if (!is_piccolo(&sl->info)) {
		return bus_fail_slave(
			bus, pos, -ENOTSUP,
			"mode is an option of the FB1111-Piccolo; this is vendor 0x%08x "
			"product 0x%08x",
			sl->info.vendor, sl->info.product);
	}
	return write_startup(bus, pos, &sdo);
}

int bus_startup_sdos(struct bus *bus, size_t pos)
{
	int r = write_mode(bus, pos);

	for (size_t i = 0; i < bus->cfg->sdo_count && r >= 0; i++) {
		if (bus->cfg->sdo[i].slave_pos == pos) {
			r = write_startup(bus, pos, &bus->cfg->sdo[i]);
		}
	}
	return r;
}

void bus_startup_begin(struct bus *bus, size_t pos)
{
	(void)bus;
	(void)pos;
}

int bus_startup_poll(struct bus *bus, size_t pos)
{
	return bus_startup_sdos(bus, pos);
}
