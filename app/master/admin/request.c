/* SPDX-License-Identifier: MIT */
#include "admin/command.h"

#include <errno.h>
#include <stdio.h>
#include <string.h>

#include "wire/aoe.h"
#include "wire/eoe.h"
#include "wire/mailbox.h"
#include "wire/soe.h"

static int refuse(char *why, int result, const char *text)
{
	snprintf(why, ADMIN_TEXT_BYTES, "%s", text);
	return result;
}

/* A name that can be printed in a line: it comes back in messages. */
static int is_name(const char *name, size_t room)
{
	size_t len = strnlen(name, room);

	if (len == 0 || len == room) {
		return 0;
	}
	for (size_t i = 0; i < len; i++) {
		if (name[i] <= ' ' || name[i] > '~') {
			return 0;
		}
	}
	return 1;
}

static int check_items(const struct admin_request *rq, char *why)
{
	if (rq->count == 0 || rq->count > ADMIN_ITEMS) {
		snprintf(why, ADMIN_TEXT_BYTES, "%u items: a request sets 1 to ADMIN_ITEMS = %d",
			 rq->count, ADMIN_ITEMS);
		return -EINVAL;
	}
	for (uint32_t i = 0; i < rq->count; i++) {
		if (!is_name(rq->item[i].channel, LIMIT_NAME_BYTES)) {
			snprintf(why, ADMIN_TEXT_BYTES, "item %u has no valid channel name", i);
			return -EINVAL;
		}
	}
	return 0;
}

static int check_slave(const struct admin_request *rq, char *why)
{
	if (rq->slave_pos >= LIMIT_SLAVES) {
		snprintf(why, ADMIN_TEXT_BYTES, "slave %u: positions go from 0 to %d",
			 rq->slave_pos, LIMIT_SLAVES - 1);
		return -EINVAL;
	}
	return 0;
}

static int check_registers(const struct admin_request *rq, uint32_t len, char *why)
{
	if (len == 0 || len > ADMIN_REGISTER_BYTES || rq->address > UINT16_MAX ||
	    rq->data_total > rq->data_len) {
		snprintf(why, ADMIN_TEXT_BYTES,
			 "%u bytes at 0x%x: expected 1 to %d bytes at 0x0000 to 0xffff", len,
			 rq->address, ADMIN_REGISTER_BYTES);
		return -EINVAL;
	}
	return check_slave(rq, why);
}

/* An SDO, its description, or a list of objects. */
static int check_coe(const struct admin_request *rq, char *why)
{
	if (rq->verb == ADMIN_SDO_LIST && rq->argument[0] > 5) {
		return refuse(why, -EINVAL, "argument[0] must be a list of objects, 0 to 5");
	}
	if ((rq->verb == ADMIN_SDO_READ || rq->verb == ADMIN_SDO_WRITE) &&
	    (rq->argument[0] > 1 || (rq->argument[0] == 1 && rq->subindex > 1))) {
		return refuse(why, -EINVAL, "complete access begins at subindex 0 or 1");
	}
	if (rq->verb == ADMIN_SDO_WRITE && rq->data_len == 0) {
		return refuse(why, -EINVAL, "an SDO takes 1 byte of data at least");
	}
	return check_slave(rq, why);
}

static int check_soe(const struct admin_request *rq, char *why)
{
	if (rq->subindex >= SOE_DRIVES || rq->argument[0] == 0 || rq->argument[0] > UINT8_MAX) {
		return refuse(why, -EINVAL, "expected a drive, 0 to 7, and 1 element at least");
	}
	if (rq->verb == ADMIN_SOE_WRITE && rq->data_len == 0) {
		return refuse(why, -EINVAL, "an IDN takes 1 byte of data at least");
	}
	return check_slave(rq, why);
}

static int check_aoe(const struct admin_request *rq, char *why)
{
	uint8_t net_id[AOE_NET_ID_BYTES];

	if (rq->argument[2] > UINT16_MAX || aoe_net_id_parse(rq->name, net_id) < 0) {
		return refuse(why, -EINVAL, "expected an AMS port, 0 to 65535, and a Net ID");
	}
	if (rq->verb == ADMIN_AOE_READ && (rq->length == 0 || rq->length > MAILBOX_BYTES)) {
		snprintf(why, ADMIN_TEXT_BYTES, "%u bytes: expected 1 to %d", rq->length,
			 MAILBOX_BYTES);
		return -EINVAL;
	}
	return check_slave(rq, why);
}

static int check_foe(const struct admin_request *rq, char *why)
{
	return is_name(rq->name, ADMIN_NAME_BYTES)
		       ? check_slave(rq, why)
		       : refuse(why, -EINVAL, "a file name has 1 to 63 bytes and no spaces");
}

static int check_eoe(const struct admin_request *rq, char *why)
{
	return rq->argument[0] < EOE_PORTS
		       ? check_slave(rq, why)
		       : refuse(why, -EINVAL, "argument[0] must be a port, 0 to 15");
}

static int check_voe(const struct admin_request *rq, char *why)
{
	return rq->argument[1] <= UINT16_MAX && rq->argument[2] <= 1
		       ? check_slave(rq, why)
		       : refuse(why, -EINVAL, "expected a type up to 65535 and a flag");
}

static int check_verb(const struct admin_request *rq, char *why)
{
	switch ((enum admin_verb)rq->verb) {
	case ADMIN_PING:
	case ADMIN_STOP:
	case ADMIN_CLEAR:
	case ADMIN_CANCEL:
	case ADMIN_DATA:
		return 0;
	case ADMIN_SET:
		return check_items(rq, why);
	case ADMIN_ONESHOT:
		if (rq->is_relative > 1) {
			return refuse(why, -EINVAL, "is_relative must be 0 or 1");
		}
		return rq->slave_pos == ADMIN_ALL_SLAVES ? 0 : check_slave(rq, why);
	case ADMIN_RESCAN:
	case ADMIN_DATAGRAMS:
	case ADMIN_COMPARE:
	case ADMIN_CONFIG_RELOAD:
	case ADMIN_CAPTURE:
		return 0;
	case ADMIN_STATE:
		if (rq->argument[0] == 0 || rq->argument[0] > UINT8_MAX) {
			return refuse(why, -EINVAL, "argument[0] must be an AL state");
		}
		return rq->slave_pos == ADMIN_ALL_SLAVES ? 0 : check_slave(rq, why);
	case ADMIN_REGISTER_READ:
		return check_registers(rq, rq->length, why);
	case ADMIN_REGISTER_WRITE:
		return check_registers(rq, rq->data_len, why);
	case ADMIN_SII_ALIAS:
		if (rq->argument[0] > UINT16_MAX) {
			return refuse(why, -EINVAL, "argument[0] must be an alias up to 65535");
		}
		return check_slave(rq, why);
	case ADMIN_SII_READ:
	case ADMIN_SII_WRITE:
	case ADMIN_DIAGNOSIS:
	case ADMIN_ERRORS_RESET:
	case ADMIN_STARTUP:
		return check_slave(rq, why);
	case ADMIN_SDO_READ:
	case ADMIN_SDO_WRITE:
	case ADMIN_SDO_LIST:
	case ADMIN_SDO_OBJECT:
	case ADMIN_SDO_ENTRY:
		return check_coe(rq, why);
	case ADMIN_FOE_READ:
	case ADMIN_FOE_WRITE:
		return check_foe(rq, why);
	case ADMIN_SOE_READ:
	case ADMIN_SOE_WRITE:
		return check_soe(rq, why);
	case ADMIN_EOE_IP_READ:
	case ADMIN_EOE_IP_WRITE:
		return check_eoe(rq, why);
	case ADMIN_AOE_READ:
	case ADMIN_AOE_WRITE:
		return check_aoe(rq, why);
	case ADMIN_VOE:
		return check_voe(rq, why);
	}
	snprintf(why, ADMIN_TEXT_BYTES, "unknown verb %u", rq->verb);
	return -EINVAL;
}

/* What every verb may have. */
static int check_common(const struct admin_request *rq, char *why)
{
	if (rq->reserved != 0) {
		return refuse(why, -EINVAL, "the reserved field is not zero");
	}
	if (rq->data_len > ADMIN_DATA_BYTES || rq->data_total > ADMIN_TRANSFER_BYTES) {
		snprintf(why, ADMIN_TEXT_BYTES,
			 "%u of %u bytes of data: a message has up to %d, a request up to %d",
			 rq->data_len, rq->data_total, ADMIN_DATA_BYTES, ADMIN_TRANSFER_BYTES);
		return -EINVAL;
	}
	if (rq->timeout_ms > ADMIN_TIMEOUT_MS_MAX) {
		snprintf(why, ADMIN_TEXT_BYTES, "timeout of %u ms: at most %d ms are taken",
			 rq->timeout_ms, ADMIN_TIMEOUT_MS_MAX);
		return -EINVAL;
	}
	if (strnlen(rq->name, ADMIN_NAME_BYTES) == ADMIN_NAME_BYTES) {
		return refuse(why, -EINVAL, "the name does not end");
	}
	return 0;
}

int admin_request_parse(const void *message, size_t len, struct admin_request *ret_request,
			char *why)
{
	struct admin_request rq;
	int r;

	if (len != sizeof(rq)) {
		snprintf(why, ADMIN_TEXT_BYTES, "a request has %zu bytes, not %zu", sizeof(rq),
			 len);
		return -EMSGSIZE;
	}
	memcpy(&rq, message, sizeof(rq));
	if (rq.magic != ADMIN_MAGIC) {
		return refuse(why, -EPROTO, "not a request of this version");
	}
	r = check_common(&rq, why);
	r = r < 0 ? r : check_verb(&rq, why);
	if (r < 0) {
		return r;
	}
	*ret_request = rq;
	return 0;
}
