/* SPDX-License-Identifier: MIT */
/* Replies of SoE, EoE, AoE and VoE that no server should give. */
#include <errno.h>

#include "base/bytes.h"
#include "harness/test.h"
#include "mailbox/mailbox.h"
#include "wire/voe.h"

enum { MAIL = 122, BUFFER = 64 };

static uint8_t buffer[BUFFER + 8];
static uint8_t mail[MAIL];

static struct mailbox_request begin(const struct mailbox_protocol *protocol)
{
	memset(buffer, 0xee, sizeof(buffer));
	return (struct mailbox_request){ .protocol = protocol,
					 .buffer = buffer,
					 .capacity = BUFFER,
					 .mail_capacity = MAIL,
					 .mail_room = MAIL,
					 .timeout = { 1 } };
}

/* The first mail is out. */
static void open_request(struct mailbox_request *rq)
{
	CHECK_EQ(rq->protocol->start(rq), MAILBOX_SEND);
	CHECK(rq->protocol->compose(rq, mail, MAIL) > 0);
	if (rq->protocol->sent != NULL) {
		CHECK_EQ(rq->protocol->sent(rq), MAILBOX_WAIT);
	}
}

/* --- SoE --- */

static struct mailbox_request soe(enum soe_operation operation)
{
	struct mailbox_request rq = begin(&soe_protocol);

	rq.with.soe = (struct soe_parameters){
		.operation = operation, .drive = 2, .elements = SOE_ELEMENT_VALUE, .idn = 40
	};
	open_request(&rq);
	return rq;
}

static int soe_reply(struct mailbox_request *rq, struct soe_message m)
{
	uint8_t body[MAIL] = { 0 };
	uint8_t data[MAIL];

	m.body = body;
	return rq->protocol->received(rq, data, soe_format(&m, data, sizeof(data)));
}

static const struct soe_message good = { .operation = SOE_READ_RESPONSE,
					 .drive = 2,
					 .elements = SOE_ELEMENT_VALUE,
					 .idn = 40,
					 .body_len = 4 };

TEST(soe_client, answers_to_another_question_are_breaches_or_not_ours)
{
	struct mailbox_request rq = soe(SOE_READ);
	struct soe_message m = good;

	m.drive = 3;
	CHECK_EQ(soe_reply(&rq, m), MAILBOX_IGNORE);
	m = good;
	m.operation = SOE_NOTIFICATION;
	CHECK_EQ(soe_reply(&rq, m), MAILBOX_IGNORE);
	m.operation = SOE_EMERGENCY;
	CHECK_EQ(soe_reply(&rq, m), MAILBOX_IGNORE);
	m.operation = SOE_WRITE_RESPONSE;
	CHECK_EQ(soe_reply(&rq, m), -EPROTO);
	m = good;
	m.elements = SOE_ELEMENT_NAME;
	CHECK_EQ(soe_reply(&rq, m), -EPROTO);
	m = good;
	m.idn = 41;
	CHECK_EQ(soe_reply(&rq, m), -EPROTO);
	CHECK_EQ(rq.len, 0);
	CHECK_EQ(soe_reply(&rq, good), MAILBOX_DONE);
	CHECK_EQ(rq.len, 4);
}

TEST(soe_client, fragments_that_do_not_become_fewer_are_a_breach)
{
	struct soe_message m = good;
	struct mailbox_request rq = soe(SOE_READ);

	m.has_more = 1;
	m.fragments_left = 0;
	CHECK_EQ(soe_reply(&rq, m), -EPROTO);
	m.fragments_left = 3;
	CHECK_EQ(soe_reply(&rq, m), MAILBOX_WAIT);
	CHECK_EQ(soe_reply(&rq, m), -EPROTO);
	rq = soe(SOE_READ);
	CHECK_EQ(soe_reply(&rq, m), MAILBOX_WAIT);
	m.fragments_left = 2;
	m.body_len = 0;
	CHECK_EQ(soe_reply(&rq, m), -EPROTO);
}

TEST(soe_client, more_than_the_buffer_holds_is_refused)
{
	struct mailbox_request rq = soe(SOE_READ);
	struct soe_message m = good;

	m.body_len = BUFFER + 1;
	CHECK_EQ(soe_reply(&rq, m), -EMSGSIZE);
	CHECK_EQ(buffer[BUFFER], 0xee);
	m.has_more = 1;
	m.fragments_left = 9;
	m.body_len = BUFFER;
	CHECK_EQ(soe_reply(&rq, m), MAILBOX_WAIT);
	m.fragments_left = 8;
	m.body_len = 1;
	CHECK_EQ(soe_reply(&rq, m), -EMSGSIZE);
}

TEST(soe_client, a_write_is_answered_by_its_own_idn_only)
{
	struct mailbox_request rq = soe(SOE_WRITE);
	struct soe_message m = good;

	m.operation = SOE_WRITE_RESPONSE;
	m.idn = 41;
	CHECK_EQ(soe_reply(&rq, m), -EPROTO);
	m.idn = 40;
	m.has_more = 1;
	CHECK_EQ(soe_reply(&rq, m), -EPROTO);
	m.has_more = 0;
	CHECK_EQ(soe_reply(&rq, m), MAILBOX_DONE);
	m.is_error = 1;
	m.body_len = 2;
	CHECK_EQ(soe_reply(&rq, m), -EREMOTEIO);
	CHECK_EQ(rq.protocol->received(&rq, mail, 3), -EPROTO);
}

TEST(soe_client, parameters_that_mean_nothing_are_refused)
{
	struct mailbox_request rq = begin(&soe_protocol);

	rq.with.soe = (struct soe_parameters){ .operation = SOE_READ_RESPONSE, .elements = 1 };
	CHECK_EQ(soe_protocol.start(&rq), -EINVAL);
	rq.with.soe = (struct soe_parameters){ .operation = SOE_READ, .elements = 0 };
	CHECK_EQ(soe_protocol.start(&rq), -EINVAL);
	rq.with.soe = (struct soe_parameters){ .operation = SOE_READ, .elements = 1, .drive = 8 };
	CHECK_EQ(soe_protocol.start(&rq), -EINVAL);
	rq.with.soe = (struct soe_parameters){ .operation = SOE_WRITE, .elements = 0x40 };
	rq.capacity = 0;
	CHECK_EQ(soe_protocol.start(&rq), -EINVAL);
}

/* --- EoE --- */

static int eoe_reply(struct mailbox_request *rq, struct eoe_header h, size_t body_len)
{
	uint8_t data[MAIL] = { 0 };

	eoe_header_put(data, &h);
	return rq->protocol->received(rq, data, EOE_HEADER_BYTES + body_len);
}

TEST(eoe_client, only_the_answer_to_the_request_is_taken)
{
	struct mailbox_request rq = begin(&eoe_protocol);

	rq.with.eoe.operation = EOE_GET_IP;
	open_request(&rq);
	CHECK_EQ(eoe_reply(&rq, (struct eoe_header){ .type = EOE_FRAGMENT }, 32), MAILBOX_IGNORE);
	CHECK_EQ(eoe_reply(&rq, (struct eoe_header){ .type = EOE_SET_IP_RESPONSE }, 0),
		 MAILBOX_IGNORE);
	CHECK_EQ(eoe_protocol.received(&rq, mail, 3), MAILBOX_IGNORE);
	CHECK_EQ(eoe_reply(&rq, (struct eoe_header){ .type = EOE_GET_IP_RESPONSE }, 3), -EPROTO);
	CHECK_EQ(eoe_reply(&rq,
			   (struct eoe_header){ .type = EOE_GET_IP_RESPONSE, .result = EOE_NO_IP },
			   0),
		 -EREMOTEIO);
	CHECK_EQ(rq.detail, EOE_NO_IP);
	CHECK_EQ(eoe_reply(&rq, (struct eoe_header){ .type = EOE_GET_IP_RESPONSE }, 4),
		 MAILBOX_DONE);
}

TEST(eoe_client, flags_of_more_than_there_is_are_a_breach)
{
	struct mailbox_request rq = begin(&eoe_protocol);
	uint8_t data[EOE_HEADER_BYTES + EOE_IP_BYTES] = { EOE_GET_IP_RESPONSE, 1, 0, 0 };

	rq.with.eoe.operation = EOE_GET_IP;
	open_request(&rq);
	data[4] = EOE_HAS_ADDRESS;
	CHECK_EQ(eoe_protocol.received(&rq, data, 4 + 13), -EPROTO);
	CHECK_EQ(eoe_protocol.received(&rq, data, 4 + 14), MAILBOX_DONE);
	data[4] = EOE_HAS_NAME;
	CHECK_EQ(eoe_protocol.received(&rq, data, 4 + 25), -EPROTO);
	CHECK_EQ(eoe_protocol.received(&rq, data, 4 + 30), MAILBOX_DONE);
}

/* --- AoE --- */

static int aoe_reply(struct mailbox_request *rq, struct aoe_header h, uint32_t result,
		     uint32_t bytes)
{
	uint8_t data[MAIL] = { 0 };

	aoe_header_put(data, &h);
	put_le32(data + AOE_HEADER_BYTES, result);
	put_le32(data + AOE_HEADER_BYTES + 4, bytes);
	return rq->protocol->received(rq, data, AOE_HEADER_BYTES + (size_t)h.data_len);
}

TEST(aoe_client, only_a_whole_answer_to_this_request_is_taken)
{
	struct mailbox_request rq = begin(&aoe_protocol);
	struct aoe_header h = { .command = AOE_READ, .flags = AOE_FLAG_RESPONSE, .data_len = 12 };

	rq.with.aoe.command = AOE_READ;
	open_request(&rq);
	h.invoke_id = rq.state.aoe.invoke_id + 1;
	CHECK_EQ(aoe_reply(&rq, h, 0, 4), MAILBOX_IGNORE);
	h.invoke_id--;
	h.flags = 0;
	CHECK_EQ(aoe_reply(&rq, h, 0, 4), MAILBOX_IGNORE);
	h.flags = AOE_FLAG_RESPONSE;
	h.command = AOE_WRITE;
	CHECK_EQ(aoe_reply(&rq, h, 0, 4), -EPROTO);
	h.command = AOE_READ;
	CHECK_EQ(aoe_reply(&rq, h, 0, 5), -EPROTO);
	h.data_len = 7;
	CHECK_EQ(aoe_reply(&rq, h, 0, 0), -EPROTO);
	h.data_len = 3;
	CHECK_EQ(aoe_reply(&rq, h, 0, 0), -EPROTO);
	h.data_len = 8 + BUFFER + 1;
	CHECK_EQ(aoe_reply(&rq, h, 0, BUFFER + 1), -EMSGSIZE);
	CHECK_EQ(buffer[BUFFER], 0xee);
	CHECK_EQ(aoe_reply(&rq, h, 0x703, 0), -EREMOTEIO);
	CHECK_EQ(rq.detail, 0x703);
	h.error = 6;
	CHECK_EQ(aoe_reply(&rq, h, 0, 0), -EREMOTEIO);
	CHECK_EQ(rq.detail, 6);
	h.error = 0;
	CHECK_EQ(aoe_reply(&rq, h, 0, BUFFER), MAILBOX_DONE);
	CHECK_EQ(rq.len, BUFFER);
	CHECK_EQ(aoe_protocol.received(&rq, mail, 31), -EPROTO);
}

TEST(aoe_client, a_length_beyond_the_mail_is_a_breach)
{
	struct mailbox_request rq = begin(&aoe_protocol);
	uint8_t data[AOE_HEADER_BYTES + 8] = { 0 };

	rq.with.aoe.command = AOE_READ;
	open_request(&rq);
	put_le32(data + 20, 9);
	CHECK_EQ(aoe_protocol.received(&rq, data, sizeof(data)), -EPROTO);
	put_le32(data + 20, UINT32_MAX);
	CHECK_EQ(aoe_protocol.received(&rq, data, sizeof(data)), -EPROTO);
}

TEST(aoe_client, what_one_mail_does_not_hold_is_refused)
{
	struct mailbox_request rq = begin(&aoe_protocol);

	rq.with.aoe.command = AOE_WRITE;
	rq.capacity = MAIL - AOE_HEADER_BYTES - AOE_WRITE_BYTES + 1;
	CHECK_EQ(aoe_protocol.start(&rq), -EMSGSIZE);
	rq.with.aoe.command = (enum aoe_command)9;
	CHECK_EQ(aoe_protocol.start(&rq), -EINVAL);
	rq.with.aoe.command = AOE_READ;
	rq.mail_capacity = 40;
	CHECK_EQ(aoe_protocol.start(&rq), -EMSGSIZE);
}

/* --- VoE --- */

TEST(voe_client, only_an_answer_of_this_vendor_that_fits_is_taken)
{
	struct mailbox_request rq = begin(&voe_protocol);
	uint8_t data[MAIL] = { 0 };

	rq.with.voe = (struct voe_parameters){ .vendor = 0x1234, .len = 4 };
	open_request(&rq);
	put_le32(data, 0x1235);
	CHECK_EQ(voe_protocol.received(&rq, data, 20), MAILBOX_IGNORE);
	put_le32(data, 0x1234);
	CHECK_EQ(voe_protocol.received(&rq, data, 5), MAILBOX_IGNORE);
	CHECK_EQ(voe_protocol.received(&rq, data, VOE_HEADER_BYTES + BUFFER + 1), -EMSGSIZE);
	CHECK_EQ(buffer[BUFFER], 0xee);
	CHECK_EQ(voe_protocol.received(&rq, data, VOE_HEADER_BYTES), MAILBOX_DONE);
	CHECK_EQ(rq.len, 0);
}
