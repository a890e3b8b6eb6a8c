/* SPDX-License-Identifier: MIT */
/*
 * Requests of the admin socket to the mailboxes of the slaves, one table for all protocols: how the
 * parameters are filled, what an error is called, what the answer is. Each is submitted to the
 * engine and answered when it has ended; nothing here waits.
 */
#include <assert.h>
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/bytes.h"
#include "bus/bus.h"
#include "daemon/session_internal.h"
#include "mailbox/mailbox.h"
#include "wire/foe.h"
#include "wire/sdo_abort.h"

enum {
	OBJECT_BYTES_MAX = 1 << 20, /* of an SDO, or an element of an IDN */
	LIST_BYTES_MAX = 2 << 16,   /* every index once */
	FILE_BYTES_FIRST = 256 << 10,
	FILE_BYTES_MARGIN = 64 << 10, /* more than comes between two passes */
	VOE_TYPE_BYTES = 2,
	WHAT_BYTES = 96,
};

static_assert(ADMIN_NAME_BYTES - 1 <= FOE_NAME_BYTES, "a name fits");

/* One transfer. Owned by its admin request until it has ended. */
struct transfer {
	struct mailbox_request request;
	struct bus *bus;
	struct admin_pending *pending;
	const struct verb *verb;
	size_t shown;    /* progress that the client knows */
	uint8_t *buffer; /* what is read; NULL: a write, its buffer is the data of the request */
};

struct verb {
	enum admin_verb verb;
	const struct mailbox_protocol *protocol;
	/* The parameters, rq->with. */
	void (*fill)(const struct admin_pending *pending, struct mailbox_request *rq);
	/* Bytes that an answer may have; 0: the data of the request are written. */
	size_t room;
	/* What it does, for an error: "SDO read of 0x1018:01". */
	void (*say)(const struct admin_request *asked, char *ret_what);
	const char *(*code_to_str)(uint32_t code);
	/* The answer from what was read; NULL: as it is. 0 or -errno. */
	int (*answer)(struct admin_pending *pending, const struct mailbox_request *rq);
};

/* --- answers --- */

/* In one message, or in many. */
static int answer_bytes(struct admin_pending *pending, const void *data, size_t len)
{
	uint8_t *room = pending->reply.data;

	if (len > ADMIN_DATA_BYTES) {
		room = admin_pending_reserve(pending, len);
		if (room == NULL) {
			return -ENOMEM;
		}
		admin_pending_answer_len(pending, len);
	} else {
		pending->reply.data_len = (uint32_t)len;
	}
	if (len > 0) {
		memcpy(room, data, len);
	}
	return 0;
}

/* --- CoE --- */

static_assert((int)ADMIN_NAME_BYTES == (int)COE_NAME_BYTES, "a name fits");

static void fill_coe(const struct admin_pending *pending, struct mailbox_request *rq)
{
	static const enum coe_operation operations[] = {
		[ADMIN_SDO_READ] = COE_UPLOAD, [ADMIN_SDO_WRITE] = COE_DOWNLOAD,
		[ADMIN_SDO_LIST] = COE_LIST,   [ADMIN_SDO_OBJECT] = COE_OBJECT,
		[ADMIN_SDO_ENTRY] = COE_ENTRY,
	};
	const struct admin_request *asked = &pending->request;
	int is_list = asked->verb == ADMIN_SDO_LIST;

	rq->with.coe = (struct coe_parameters){
		.operation = operations[asked->verb],
		.access = !is_list && asked->argument[0] != 0 ? COE_ACCESS_COMPLETE
							      : COE_ACCESS_SINGLE,
		.index = asked->index,
		.subindex = asked->subindex,
		.list_type = is_list ? (enum coe_list_type)asked->argument[0] : COE_LIST_LENGTHS,
	};
}

static void say_sdo(const struct admin_request *asked, char *ret_what)
{
	snprintf(ret_what, WHAT_BYTES, "SDO %s of 0x%04x:%02x%s",
		 asked->verb == ADMIN_SDO_READ ? "read" : "write", asked->index, asked->subindex,
		 asked->argument[0] != 0 ? ", complete access" : "");
}

static void say_information(const struct admin_request *asked, char *ret_what)
{
	if (asked->verb == ADMIN_SDO_LIST) {
		snprintf(ret_what, WHAT_BYTES, "list of objects");
	} else if (asked->verb == ADMIN_SDO_OBJECT) {
		snprintf(ret_what, WHAT_BYTES, "description of object 0x%04x", asked->index);
	} else {
		snprintf(ret_what, WHAT_BYTES, "description of entry 0x%04x:%02x", asked->index,
			 asked->subindex);
	}
}

static int answer_object(struct admin_pending *pending, const struct mailbox_request *rq)
{
	struct coe_object object;
	struct admin_sdo_object answer;
	int r = coe_object_get(rq->buffer, rq->len, &object);

	if (r < 0) {
		return r;
	}
	answer = (struct admin_sdo_object){ .index = object.index,
					    .data_type = object.data_type,
					    .subindex_max = object.subindex_max,
					    .object_code = object.object_code };
	memcpy(answer.name, object.name, sizeof(answer.name));
	return answer_bytes(pending, &answer, sizeof(answer));
}

static int answer_entry(struct admin_pending *pending, const struct mailbox_request *rq)
{
	struct coe_entry entry;
	struct admin_sdo_entry answer;
	int r = coe_entry_get(rq->buffer, rq->len, &entry);

	if (r < 0) {
		return r;
	}
	answer = (struct admin_sdo_entry){ .index = entry.index,
					   .data_type = entry.data_type,
					   .bit_len = entry.bit_len,
					   .access = entry.access,
					   .subindex = entry.subindex };
	memcpy(answer.name, entry.name, sizeof(answer.name));
	return answer_bytes(pending, &answer, sizeof(answer));
}

/* --- FoE --- */

static void fill_foe(const struct admin_pending *pending, struct mailbox_request *rq)
{
	const struct admin_request *asked = &pending->request;

	rq->with.foe = (struct foe_parameters){
		.operation = asked->verb == ADMIN_FOE_READ ? FOE_READ : FOE_WRITE,
		.password = asked->argument[0],
		.name = asked->name, /* of the pending request, which outlives the transfer */
	};
}

static void say_foe(const struct admin_request *asked, char *ret_what)
{
	snprintf(ret_what, WHAT_BYTES, "FoE %s of %s",
		 asked->verb == ADMIN_FOE_READ ? "read" : "write", asked->name);
}

/* --- SoE --- */

static void fill_soe(const struct admin_pending *pending, struct mailbox_request *rq)
{
	const struct admin_request *asked = &pending->request;

	rq->with.soe = (struct soe_parameters){
		.operation = asked->verb == ADMIN_SOE_READ ? SOE_READ : SOE_WRITE,
		.drive = asked->subindex,
		.elements = (uint8_t)asked->argument[0],
		.idn = asked->index,
	};
}

static void say_soe(const struct admin_request *asked, char *ret_what)
{
	char idn[SOE_IDN_TEXT_BYTES];

	soe_idn_format(asked->index, idn);
	snprintf(ret_what, WHAT_BYTES, "SoE %s of %s of drive %u",
		 asked->verb == ADMIN_SOE_READ ? "read" : "write", idn, asked->subindex);
}

/* --- EoE --- */

/* Data that are too short were refused before: session_mailbox(). */
static void fill_eoe(const struct admin_pending *pending, struct mailbox_request *rq)
{
	int is_read = pending->request.verb == ADMIN_EOE_IP_READ;

	rq->with.eoe = (struct eoe_parameters){ .operation = is_read ? EOE_GET_IP : EOE_SET_IP,
						.port = (uint8_t)pending->request.argument[0] };
	if (!is_read) {
		eoe_ip_get(pending->data, pending->data_len, &rq->with.eoe.ip);
	}
}

static void say_eoe(const struct admin_request *asked, char *ret_what)
{
	snprintf(ret_what, WHAT_BYTES, "EoE %s of the IP parameters of port %u",
		 asked->verb == ADMIN_EOE_IP_READ ? "read" : "write", asked->argument[0]);
}

static int answer_ip(struct admin_pending *pending, const struct mailbox_request *rq)
{
	uint8_t bytes[EOE_IP_BYTES];

	eoe_ip_put(bytes, &rq->state.eoe.ip);
	return answer_bytes(pending, bytes, sizeof(bytes));
}

/* --- AoE --- */

static void fill_aoe(const struct admin_pending *pending, struct mailbox_request *rq)
{
	const struct admin_request *asked = &pending->request;

	rq->with.aoe = (struct aoe_parameters){
		.command = asked->verb == ADMIN_AOE_READ ? AOE_READ : AOE_WRITE,
		.target.port = (uint16_t)asked->argument[2],
		.group = asked->argument[0],
		.offset = asked->argument[1],
	};
	aoe_net_id_parse(asked->name, rq->with.aoe.target.net_id);
	if (asked->verb == ADMIN_AOE_READ) {
		rq->capacity = asked->length;
	}
}

static void say_aoe(const struct admin_request *asked, char *ret_what)
{
	snprintf(ret_what, WHAT_BYTES, "AoE %s of group 0x%x, offset 0x%x, port %u",
		 asked->verb == ADMIN_AOE_READ ? "read" : "write", asked->argument[0],
		 asked->argument[1], asked->argument[2]);
}

/* --- VoE --- */

/* What is sent is in the buffer; the answer replaces it. */
static void fill_voe(const struct admin_pending *pending, struct mailbox_request *rq)
{
	const struct admin_request *asked = &pending->request;

	rq->with.voe = (struct voe_parameters){
		.vendor = asked->argument[0],
		.type = (uint16_t)asked->argument[1],
		.expect = asked->argument[2] != 0 ? VOE_NO_ANSWER : VOE_ANSWER,
		.len = pending->data_len,
	};
	memcpy(rq->buffer, pending->data, pending->data_len);
}

static void say_voe(const struct admin_request *asked, char *ret_what)
{
	snprintf(ret_what, WHAT_BYTES, "VoE of vendor 0x%08x, type 0x%04x", asked->argument[0],
		 asked->argument[1]);
}

static int answer_voe(struct admin_pending *pending, const struct mailbox_request *rq)
{
	uint8_t bytes[VOE_TYPE_BYTES + MAILBOX_BYTES];

	if (rq->with.voe.expect == VOE_NO_ANSWER) {
		return 0;
	}
	put_le16(bytes, rq->state.voe.type);
	memcpy(bytes + VOE_TYPE_BYTES, rq->buffer, rq->len);
	return answer_bytes(pending, bytes, VOE_TYPE_BYTES + rq->len);
}

/* --- all --- */

static const struct verb verbs[] = {
	{ ADMIN_SDO_READ, &coe_protocol, fill_coe, OBJECT_BYTES_MAX, say_sdo, sdo_abort_to_str,
	  NULL },
	{ ADMIN_SDO_WRITE, &coe_protocol, fill_coe, 0, say_sdo, sdo_abort_to_str, NULL },
	{ ADMIN_SDO_LIST, &coe_protocol, fill_coe, LIST_BYTES_MAX, say_information,
	  sdo_abort_to_str, NULL },
	{ ADMIN_SDO_OBJECT, &coe_protocol, fill_coe, MAILBOX_BYTES, say_information,
	  sdo_abort_to_str, answer_object },
	{ ADMIN_SDO_ENTRY, &coe_protocol, fill_coe, MAILBOX_BYTES, say_information,
	  sdo_abort_to_str, answer_entry },
	{ ADMIN_FOE_READ, &foe_protocol, fill_foe, FILE_BYTES_FIRST, say_foe, foe_error_to_str,
	  NULL },
	{ ADMIN_FOE_WRITE, &foe_protocol, fill_foe, 0, say_foe, foe_error_to_str, NULL },
	{ ADMIN_SOE_READ, &soe_protocol, fill_soe, OBJECT_BYTES_MAX, say_soe, soe_error_to_str,
	  NULL },
	{ ADMIN_SOE_WRITE, &soe_protocol, fill_soe, 0, say_soe, soe_error_to_str, NULL },
	{ ADMIN_EOE_IP_READ, &eoe_protocol, fill_eoe, EOE_IP_BYTES, say_eoe, eoe_result_to_str,
	  answer_ip },
	{ ADMIN_EOE_IP_WRITE, &eoe_protocol, fill_eoe, 0, say_eoe, eoe_result_to_str, NULL },
	{ ADMIN_AOE_READ, &aoe_protocol, fill_aoe, MAILBOX_BYTES, say_aoe, aoe_error_to_str, NULL },
	{ ADMIN_AOE_WRITE, &aoe_protocol, fill_aoe, 0, say_aoe, aoe_error_to_str, NULL },
	{ ADMIN_VOE, &voe_protocol, fill_voe, MAILBOX_BYTES, say_voe, NULL, answer_voe },
};

static const struct verb *find_verb(uint32_t verb)
{
	size_t n = 0;

	while (n < sizeof(verbs) / sizeof(verbs[0]) && (uint32_t)verbs[n].verb != verb) {
		n++;
	}
	return n < sizeof(verbs) / sizeof(verbs[0]) ? &verbs[n] : NULL;
}

/* --- errors --- */

static void say_why(const struct transfer *tf, char *why, size_t why_bytes)
{
	const struct mailbox_request *rq = &tf->request;
	const char *protocol = mailbox_type_to_str(rq->protocol->type);
	const char *said = rq->protocol == &foe_protocol ? rq->state.foe.text : "";

	switch (rq->result) {
	case -EREMOTEIO:
		if (rq->is_mailbox_error) {
			snprintf(why, why_bytes, "%s", mailbox_error_to_str(rq->detail));
			return;
		}
		snprintf(why, why_bytes, "%s (0x%0*x)%s%s",
			 tf->verb->code_to_str != NULL ? tf->verb->code_to_str(rq->detail)
						       : "refused",
			 rq->detail > UINT16_MAX ? 8 : 4, rq->detail, said[0] != '\0' ? ": " : "",
			 said);
		return;
	case -ETIMEDOUT:
		snprintf(why, why_bytes,
			 rq->protocol == &foe_protocol && rq->state.foe.is_busy
				 ? "the slave is busy for too long"
				 : "no answer");
		return;
	case -ECANCELED:
		snprintf(why, why_bytes, "cancelled");
		return;
	case -EMSGSIZE:
		snprintf(why, why_bytes, "more than %zu bytes, or than one mail takes",
			 rq->capacity);
		return;
	case -EINVAL:
		snprintf(why, why_bytes, "the parameters do not fit the slave's mailbox");
		return;
	case -EIO:
		snprintf(why, why_bytes, "the slave, or a part of its answer, is lost");
		return;
	case -ENODEV:
		snprintf(why, why_bytes, "the slave was restarted, or its state changed");
		return;
	case -ENOTSUP:
		snprintf(why, why_bytes, "the slave has no %s mailbox in this state", protocol);
		return;
	case -EPROTO:
		snprintf(why, why_bytes, "its answer is malformed");
		return;
	default: /* any errno */
		snprintf(why, why_bytes, "%s", strerror(-rq->result));
		return;
	}
}

static void refuse(const struct transfer *tf, int r)
{
	struct admin_pending *pending = tf->pending;
	uint16_t pos = pending->request.slave_pos;
	size_t count;
	const struct slave_info *slaves = bus_slaves(tf->bus, &count);
	char what[WHAT_BYTES];
	char why[128];

	if (tf->request.result == -EREMOTEIO && !tf->request.is_mailbox_error) {
		pending->reply.slave_code = tf->request.detail;
	}
	tf->verb->say(&pending->request, what);
	say_why(tf, why, sizeof(why));
	admin_pending_refuse(pending, r, "slave %u (%s): %s: %s", pos,
			     pos < count ? slaves[pos].name : "", what, why);
}

/* --- the transfer --- */

static void transfer_done(void *ctx, struct mailbox_request *rq)
{
	struct transfer *tf = ctx;
	struct admin_pending *pending = tf->pending;
	int r = rq->result;

	pending->work = NULL;
	if (r == 0 && tf->verb->answer != NULL) {
		r = tf->verb->answer(pending, rq);
	} else if (r == 0 && tf->buffer != NULL) {
		r = answer_bytes(pending, rq->buffer, rq->len);
	}
	rq->result = r;
	if (r < 0) {
		refuse(tf, r);
	} else {
		admin_pending_complete(pending, 0);
	}
	free(tf->buffer);
	free(tf);
}

/* A file has no length until its end: there is always room for what comes in one pass. */
static void grow(struct transfer *tf)
{
	struct mailbox_request *rq = &tf->request;
	size_t more = 2 * rq->capacity;
	uint8_t *room;

	if (tf->verb->verb != ADMIN_FOE_READ || rq->capacity - rq->len > FILE_BYTES_MARGIN ||
	    more > ADMIN_TRANSFER_BYTES) {
		return;
	}
	room = realloc(tf->buffer, more);
	if (room != NULL) {
		tf->buffer = room;
		rq->buffer = room;
		rq->capacity = more;
	}
}

static void poll_transfer(struct admin_pending *pending, const struct admin_target *target)
{
	struct transfer *tf = pending->work;
	const struct mailbox_request *rq;

	(void)target;
	if (tf == NULL) {
		return;
	}
	rq = &tf->request;
	grow(tf);
	if (rq->len != tf->shown && (rq->total > ADMIN_DATA_BYTES || rq->len > ADMIN_DATA_BYTES)) {
		tf->shown = rq->len;
		admin_pending_progress(pending, (uint32_t)rq->len, (uint32_t)rq->total);
	}
}

static void cancel_transfer(struct admin_pending *pending)
{
	struct transfer *tf = pending->work;

	if (tf != NULL) {
		bus_mailbox_cancel(tf->bus, &tf->request);
	}
}

/* 0; -EMSGSIZE: more data than the verb takes; -EINVAL: less. */
static int check_data(const struct admin_pending *pending)
{
	struct eoe_ip ip;

	switch (pending->request.verb) {
	case ADMIN_SDO_WRITE:
	case ADMIN_SOE_WRITE:
		return pending->data_len > OBJECT_BYTES_MAX ? -EMSGSIZE : 0;
	case ADMIN_EOE_IP_WRITE:
		return eoe_ip_get(pending->data, pending->data_len, &ip) < 0 ? -EINVAL : 0;
	case ADMIN_VOE:
		return pending->data_len > MAILBOX_BYTES ? -EMSGSIZE : 0;
	default: /* their protocols check them */
		return 0;
	}
}

static struct transfer *make_transfer(struct session *s, struct admin_pending *pending)
{
	const struct verb *verb = find_verb(pending->request.verb);
	struct transfer *tf = calloc(1, sizeof(*tf));
	uint8_t *buffer = verb->room > 0 ? malloc(verb->room) : NULL;

	if (tf == NULL || (verb->room > 0 && buffer == NULL)) {
		free(tf);
		free(buffer);
		return NULL;
	}
	*tf = (struct transfer){
		.request = { .protocol = verb->protocol,
			     .slave_pos = pending->request.slave_pos,
			     .buffer = buffer,
			     .capacity = verb->room,
			     .done = transfer_done,
			     .ctx = tf },
		.bus = s->bus,
		.pending = pending,
		.verb = verb,
		.buffer = buffer,
	};
	if (buffer == NULL) {
		tf->request.buffer = (uint8_t *)(uintptr_t)pending->data; /* is only read */
		tf->request.capacity = pending->data_len;
	}
	verb->fill(pending, &tf->request);
	return tf;
}

void session_mailbox(void *ctx, struct admin_pending *pending)
{
	struct session *s = ctx;
	struct transfer *tf = NULL;
	int r = check_data(pending);

	if (r < 0) {
		admin_pending_refuse(pending, r, "%zu bytes of data are too %s for this request",
				     pending->data_len, r == -EINVAL ? "few" : "many");
		return;
	}
	tf = make_transfer(s, pending);
	if (tf == NULL) {
		admin_pending_complete(pending, -ENOMEM);
		return;
	}
	pending->work = tf;
	pending->poll = poll_transfer;
	pending->cancel = cancel_transfer;
	r = bus_mailbox_submit(s->bus, &tf->request);
	if (r < 0) {
		tf->request.result = r;
		transfer_done(tf, &tf->request);
	}
}
