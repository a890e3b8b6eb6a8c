/* SPDX-License-Identifier: MIT */
/* The FoE client: against the simulator's server, and against replies that no server should give.
 */
#include "wire/foe.h"

#include <errno.h>
#include <stdlib.h>

#include "devices/foe_server.h"
#include "harness/test.h"
#include "mailbox/mailbox.h"

enum {
	MAIL = 122, /* data bytes of a mail of a mailbox of 128 bytes */
	PACKET = MAIL - FOE_HEADER_BYTES,
	MS = 1000000,
	GUARD = 100000,
};

/* One request, its slave's server, and the time that the client's pauses took. */
struct talk {
	struct mailbox_request rq;
	struct foe_server server;
	uint8_t request[MAIL];
	uint8_t answer[MAIL];
	int len; /* of the mail composed last */
	unsigned mails;
	int64_t now_ns;
	int64_t paused_ns;
};

static void begin(struct talk *t, uint8_t operation, uint8_t *buffer, size_t capacity)
{
	memset(&t->rq, 0, sizeof(t->rq));
	t->rq.protocol = &foe_protocol;
	t->rq.with.foe = (struct foe_parameters){ .operation = operation, .name = "a.bin" };
	t->rq.buffer = buffer;
	t->rq.capacity = capacity;
	t->rq.timeout = (span_t){ 500 * MS };
	t->rq.mail_capacity = t->rq.mail_room = MAIL;
	t->mails = 0;
}

/* As the engine does it: compose, sent, and where the slave answers, received. */
static int pass(struct talk *t)
{
	struct mailbox_call call = { .request = t->request,
				     .request_capacity = MAIL,
				     .answer = t->answer,
				     .capacity = MAIL };
	size_t len;
	int next;

	if (t->rq.not_before.ns > t->now_ns) {
		t->paused_ns += t->rq.not_before.ns - t->now_ns;
		t->now_ns = t->rq.not_before.ns;
	}
	t->len = foe_protocol.compose(&t->rq, t->request, MAIL);
	CHECK(t->len > 0 && t->len <= MAIL);
	t->now_ns += MS;
	t->rq.deadline = (mono_t){ t->now_ns + t->rq.timeout.ns };
	t->mails++;
	next = foe_protocol.sent(&t->rq);
	call.request_len = (size_t)t->len;
	len = foe_server_answer(&t->server, &call);
	if (next != MAILBOX_WAIT || len == 0) {
		return next;
	}
	return foe_protocol.received(&t->rq, t->answer, len);
}

static int run(struct talk *t)
{
	int next = foe_protocol.start(&t->rq);

	for (unsigned i = 0; next == MAILBOX_SEND; i++) {
		CHECK(i < GUARD);
		next = pass(t);
	}
	return next;
}

static uint8_t *bytes_of(size_t len)
{
	uint8_t *bytes = malloc(len + 1);

	CHECK(bytes != NULL);
	for (size_t i = 0; i < len; i++) {
		bytes[i] = (uint8_t)(i * 13 + i / 251);
	}
	return bytes;
}

static void transfer(struct talk *t, size_t len)
{
	uint8_t *out = bytes_of(len);
	uint8_t *in = malloc(len + 1);

	CHECK(in != NULL);
	begin(t, FOE_WRITE, out, len);
	CHECK_EQ(run(t), MAILBOX_DONE);
	CHECK_EQ(t->rq.len, len);
	CHECK_EQ(t->rq.total, len);
	CHECK_EQ(t->mails, 1 + len / PACKET + 1 + (unsigned)t->server.busy);
	begin(t, FOE_READ, in, len);
	CHECK_EQ(run(t), MAILBOX_DONE);
	CHECK_EQ(t->rq.len, len);
	CHECK_MEM(in, out, len);
	free(in);
	free(out);
}

TEST(foe_client, files_of_every_length_round_a_packet_go_there_and_back)
{
	static const size_t lens[] = { 0, 1, PACKET - 1, PACKET, PACKET + 1, 5 * PACKET, 200000 };
	struct talk t = { .now_ns = MS };

	for (size_t i = 0; i < sizeof(lens) / sizeof(lens[0]); i++) {
		transfer(&t, lens[i]);
	}
	foe_server_done(&t.server);
}

TEST(foe_client, a_packet_is_repeated_after_busy_with_growing_pauses)
{
	struct talk t = { .now_ns = MS, .server.busy = 3 };

	transfer(&t, 10);
	CHECK_EQ(t.paused_ns, (10 + 20 + 40) * (int64_t)MS);
	foe_server_done(&t.server);
}

TEST(foe_client, an_error_of_the_slave_has_its_code_and_its_text)
{
	struct talk t = { .now_ns = MS, .server.password = 77 };
	uint8_t file[3 * PACKET] = { 0 };

	begin(&t, FOE_READ, file, sizeof(file));
	t.rq.with.foe.password = 77;
	CHECK_EQ(run(&t), -EREMOTEIO);
	CHECK_EQ(t.rq.detail, FOE_ERROR_NOT_FOUND);
	CHECK_STR(t.rq.state.foe.text, "a.bin");
	begin(&t, FOE_WRITE, file, sizeof(file));
	CHECK_EQ(run(&t), -EREMOTEIO);
	CHECK_EQ(t.rq.detail, FOE_ERROR_NO_RIGHTS);
	t.server.fail_at = 2;
	begin(&t, FOE_WRITE, file, sizeof(file));
	t.rq.with.foe.password = 77;
	CHECK_EQ(run(&t), -EREMOTEIO);
	CHECK_EQ(t.rq.detail, FOE_ERROR_FLASH);
	CHECK_EQ(t.rq.len, PACKET);
	CHECK_STR(t.rq.state.foe.text, "sector 7 is worn out");
	CHECK_EQ(foe_protocol.give_up(&t.rq, -EREMOTEIO, t.request, MAIL), 0);
	foe_server_done(&t.server);
}

TEST(foe_client, endless_busy_ends_at_its_limit)
{
	struct talk t = { .now_ns = MS, .server.busy = FOE_SERVER_BUSY_FOREVER };
	uint8_t file[8] = { 0 };

	begin(&t, FOE_WRITE, file, sizeof(file));
	t.rq.with.foe.busy_limit = (span_t){ 2000 * (int64_t)MS };
	CHECK_EQ(run(&t), -ETIMEDOUT);
	CHECK_EQ(t.rq.state.foe.is_busy, 1);
	CHECK_EQ(t.rq.state.foe.busy_all, 100);
	CHECK(t.paused_ns > 1500 * (int64_t)MS && t.paused_ns <= 2000 * (int64_t)MS);
	CHECK(t.mails > 5 && t.mails < 30);
	CHECK(foe_protocol.give_up(&t.rq, -ETIMEDOUT, t.request, MAIL) > 0);
	CHECK_EQ(t.request[0], FOE_ERROR);
	foe_server_done(&t.server);
}

TEST(foe_client, a_file_longer_than_the_buffer_is_refused_and_nothing_is_written_behind_it)
{
	struct talk t = { .now_ns = MS };
	uint8_t file[2 * PACKET];
	uint8_t small[PACKET + 8];

	memset(file, 1, sizeof(file));
	memset(small, 0xee, sizeof(small));
	begin(&t, FOE_WRITE, file, sizeof(file));
	CHECK_EQ(run(&t), MAILBOX_DONE);
	begin(&t, FOE_READ, small, PACKET);
	CHECK_EQ(run(&t), -EMSGSIZE);
	CHECK_EQ(t.rq.len, PACKET);
	CHECK_EQ(small[PACKET], 0xee);
	foe_server_done(&t.server);
}

TEST(foe_client, parameters_that_cannot_be_sent_are_refused_at_once)
{
	char long_name[FOE_NAME_BYTES + 2];
	struct talk t = { .now_ns = MS };

	memset(long_name, 'x', sizeof(long_name) - 1);
	long_name[sizeof(long_name) - 1] = '\0';
	begin(&t, FOE_DATA, NULL, 0);
	CHECK_EQ(foe_protocol.start(&t.rq), -EINVAL);
	begin(&t, FOE_READ, NULL, 0);
	t.rq.with.foe.name = "";
	CHECK_EQ(foe_protocol.start(&t.rq), -EINVAL);
	t.rq.with.foe.name = NULL;
	CHECK_EQ(foe_protocol.start(&t.rq), -EINVAL);
	t.rq.with.foe.name = long_name;
	CHECK_EQ(foe_protocol.start(&t.rq), -EINVAL);
	t.rq.with.foe.name = "123456";
	t.rq.mail_capacity = 11;
	CHECK_EQ(foe_protocol.start(&t.rq), -EINVAL);
	t.rq.mail_capacity = 12;
	CHECK_EQ(foe_protocol.start(&t.rq), MAILBOX_SEND);
	CHECK_EQ(foe_protocol.give_up(&t.rq, -ECANCELED, t.request, MAIL), 0);
}

/* --- hostile replies --- */

struct reply {
	uint8_t operation;
	uint32_t number;
	size_t body_len;
	int next;
};

static void open_as(struct talk *t, uint8_t operation, uint8_t *buffer, size_t capacity)
{
	begin(t, operation, buffer, capacity);
	CHECK_EQ(foe_protocol.start(&t->rq), MAILBOX_SEND);
	CHECK(foe_protocol.compose(&t->rq, t->request, MAIL) > 0);
	t->rq.deadline = (mono_t){ t->rq.timeout.ns };
}

static int reply(struct talk *t, uint8_t operation, uint32_t number, size_t body_len)
{
	uint8_t body[MAIL] = { 0 };
	uint8_t data[MAIL + FOE_HEADER_BYTES];
	size_t len = foe_format(&(struct foe_message){ .operation = operation,
						       .number = number,
						       .body = body,
						       .body_len = body_len },
				data, sizeof(data));

	CHECK(len > 0);
	return foe_protocol.received(&t->rq, data, len);
}

static void check_replies(uint8_t operation, const struct reply *replies, size_t count)
{
	uint8_t file[3 * PACKET] = { 0 };

	for (size_t i = 0; i < count; i++) {
		struct talk t = { .now_ns = MS };

		open_as(&t, operation, file, sizeof(file));
		CHECK_EQ(reply(&t, replies[i].operation, replies[i].number, replies[i].body_len),
			 replies[i].next);
		CHECK_EQ(t.rq.len, replies[i].next == MAILBOX_SEND ? replies[i].body_len : 0);
	}
}

TEST(foe_client, what_is_no_answer_to_a_write_is_a_breach_of_protocol)
{
	static const struct reply replies[] = {
		{ FOE_ACK, 1, 0, -EPROTO },           { FOE_DATA, 1, 5, -EPROTO },
		{ FOE_READ, 0, 5, -EPROTO },          { FOE_WRITE, 0, 5, -EPROTO },
		{ FOE_ACK, UINT32_MAX, 0, -EPROTO },  { FOE_ACK, 0, 0, MAILBOX_SEND },
		{ FOE_ERROR, 0x8005, 0, -EREMOTEIO },
	};

	check_replies(FOE_WRITE, replies, sizeof(replies) / sizeof(replies[0]));
}

TEST(foe_client, what_is_no_answer_to_a_read_is_a_breach_of_protocol)
{
	static const struct reply replies[] = {
		{ FOE_ACK, 0, 0, -EPROTO },
		{ FOE_DATA, 2, 5, -EPROTO },
		{ FOE_DATA, 0, 5, MAILBOX_WAIT },
		{ FOE_DATA, 1, PACKET + 1, -EPROTO },
		{ FOE_DATA, 1, PACKET, MAILBOX_SEND },
		{ FOE_READ, 1, 0, -EPROTO },
		{ FOE_DATA, UINT32_MAX, 5, -EPROTO },
	};

	check_replies(FOE_READ, replies, sizeof(replies) / sizeof(replies[0]));
}

TEST(foe_client, a_short_or_unknown_message_is_a_breach_of_protocol)
{
	static const uint8_t junk[8] = { 7 };
	struct talk t = { .now_ns = MS };
	uint8_t file[8];

	open_as(&t, FOE_READ, file, sizeof(file));
	CHECK_EQ(foe_protocol.received(&t.rq, junk, sizeof(junk)), -EPROTO);
	CHECK_EQ(foe_protocol.received(&t.rq, junk, 0), -EPROTO);
	CHECK_EQ(foe_protocol.received(&t.rq, junk, 5), -EPROTO);
}

TEST(foe_client, an_acknowledge_or_a_packet_that_comes_twice_changes_nothing)
{
	uint8_t file[3 * PACKET] = { 0 };
	struct talk t = { .now_ns = MS };

	open_as(&t, FOE_WRITE, file, sizeof(file));
	CHECK_EQ(reply(&t, FOE_ACK, 0, 0), MAILBOX_SEND);
	CHECK_EQ(foe_protocol.compose(&t.rq, t.request, MAIL), MAIL);
	CHECK_EQ(reply(&t, FOE_ACK, 0, 0), MAILBOX_WAIT);
	CHECK_EQ(t.rq.len, 0);
	CHECK_EQ(reply(&t, FOE_ACK, 1, 0), MAILBOX_SEND);
	CHECK_EQ(t.rq.len, PACKET);
	open_as(&t, FOE_READ, file, sizeof(file));
	CHECK_EQ(reply(&t, FOE_DATA, 1, PACKET), MAILBOX_SEND);
	CHECK_EQ(reply(&t, FOE_DATA, 1, PACKET), MAILBOX_WAIT);
	CHECK_EQ(t.rq.len, PACKET);
}

TEST(foe_client, a_mail_before_the_request_has_begun_is_not_its_own)
{
	uint8_t file[8];
	struct talk t = { .now_ns = MS };

	begin(&t, FOE_READ, file, sizeof(file));
	CHECK_EQ(foe_protocol.start(&t.rq), MAILBOX_SEND);
	CHECK_EQ(reply(&t, FOE_DATA, 1, 5), MAILBOX_IGNORE);
}

TEST(foe_client, the_text_of_an_error_is_bounded_and_printable)
{
	struct talk t = { .now_ns = MS };
	uint8_t data[MAIL];
	uint8_t file[8];

	memset(data, 0xff, sizeof(data));
	data[0] = FOE_ERROR;
	open_as(&t, FOE_READ, file, sizeof(file));
	CHECK_EQ(foe_protocol.received(&t.rq, data, sizeof(data)), -EREMOTEIO);
	CHECK_EQ(strlen(t.rq.state.foe.text), FOE_TEXT_BYTES - 1);
	CHECK_EQ(strspn(t.rq.state.foe.text, "_"), FOE_TEXT_BYTES - 1);
}
