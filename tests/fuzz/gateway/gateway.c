/* SPDX-License-Identifier: MIT */
/*
 * Bytes of a client of the mailbox gateway: frames one after another, as of a TCP connection. The
 * first mail of a protocol is a raw request as the engine calls it, the mails behind it are what a
 * slave sends, until the request ends; then the next one is a request again.
 */
#include <errno.h>
#include <string.h>

#include "mailbox/mailbox.h"
#include "network/gateway_frame.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

enum { ROOM = 122 };

static unsigned answers;

static void must(int is_true)
{
	if (!is_true) {
		__builtin_trap();
	}
}

static void take_answer(struct mailbox_request *rq, const uint8_t *data, size_t len)
{
	enum raw_transfer transfer = raw_transfer_after(rq, data, len);

	must(transfer >= RAW_TRANSFER_NONE && transfer <= RAW_TRANSFER_LAST);
	answers++;
}

/* What was read is written as the same bytes, but for what no field holds. */
static void check_frame(const struct gateway_mail *mail)
{
	uint8_t bytes[GATEWAY_FRAME_BYTES];
	struct gateway_mail again;
	size_t len = gateway_frame_put(bytes, mail);

	must(len <= sizeof(bytes) && gateway_frame_get(bytes, len, &again) == (int)len);
	must(again.header.address == mail->header.address &&
	     again.header.counter == mail->header.counter &&
	     again.header.data_len == mail->header.data_len &&
	     memcmp(again.data, mail->data, mail->header.data_len) == 0);
}

/* 1: it waits for mails. */
static int begin(struct mailbox_request *rq, uint8_t *buffer, const struct gateway_mail *mail)
{
	uint8_t out[ROOM];
	int len;

	memcpy(buffer, mail->data, mail->header.data_len);
	*rq = (struct mailbox_request){
		.protocol = raw_protocol((enum mailbox_type)mail->header.type),
		.with.raw = { .answer = take_answer, .is_last = mail->header.counter & 1 },
		.buffer = buffer,
		.capacity = mail->header.data_len,
		.mail_capacity = ROOM,
		.mail_room = ROOM,
	};
	if (rq->protocol == NULL || rq->protocol->start(rq) != MAILBOX_SEND) {
		return 0;
	}
	len = rq->protocol->compose(rq, out, sizeof(out));
	must(len == mail->header.data_len && memcmp(out, mail->data, (size_t)len) == 0);
	if (rq->protocol->sent(rq) == MAILBOX_WAIT) {
		return 1;
	}
	(void)raw_transfer_after(rq, NULL, 0);
	return 0;
}

static int receive(struct mailbox_request *rq, const struct gateway_mail *mail)
{
	unsigned before = answers;
	int next = rq->protocol->received(rq, mail->data, mail->header.data_len);
	uint8_t out[ROOM];

	must(next < 0 || (next == MAILBOX_IGNORE) == (answers == before));
	if (next < 0) {
		must(rq->protocol->give_up(rq, next, out, sizeof(out)) <= ROOM);
	}
	return next == MAILBOX_WAIT || next == MAILBOX_IGNORE;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
	static uint8_t buffer[GATEWAY_DATA_BYTES];
	uint8_t refusal[RAW_ABORT_BYTES];
	struct mailbox_request rq;
	struct gateway_mail mail;
	int is_waiting = 0;
	int len;

	while ((len = gateway_frame_get(data, size, &mail)) > 0) {
		must((size_t)len <= size);
		check_frame(&mail);
		(void)raw_refuse_sdo(mail.data, mail.header.data_len, refusal);
		is_waiting = is_waiting ? receive(&rq, &mail) : begin(&rq, buffer, &mail);
		data += len;
		size -= (size_t)len;
	}
	return 0;
}
