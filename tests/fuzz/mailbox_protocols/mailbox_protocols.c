/* SPDX-License-Identifier: MIT */
/*
 * FoE, SoE, EoE, AoE and VoE requests against mails from anywhere, as the engine calls them (the
 * engine itself: fuzz_coe). The first byte chooses the request; then each mail is its length and
 * its data. Each mail also goes to an assembly of EoE frames.
 */
#include <errno.h>
#include <string.h>

#include "mailbox/mailbox.h"
#include "wire/foe.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

enum { MAIL = 58, BUFFER = 150, GUARD = 16, SENDS_MAX = 400, IS_WRITE = 8 };

static uint8_t buffer[BUFFER + GUARD];

static void must(int is_true)
{
	if (!is_true) {
		__builtin_trap();
	}
}

static struct mailbox_request choose(uint8_t choice)
{
	struct mailbox_request rq = { .buffer = buffer,
				      .capacity = BUFFER,
				      .mail_capacity = MAIL,
				      .mail_room = MAIL,
				      .timeout = { 1000000 } };
	int is_write = (choice & IS_WRITE) != 0;

	switch (choice % IS_WRITE) {
	case 0:
		rq.protocol = &foe_protocol;
		rq.with.foe = (struct foe_parameters){ .operation = is_write ? FOE_WRITE : FOE_READ,
						       .name = "a" };
		break;
	case 1:
		rq.protocol = &soe_protocol;
		rq.with.soe = (struct soe_parameters){ .operation = is_write ? SOE_WRITE : SOE_READ,
						       .elements = SOE_ELEMENT_VALUE,
						       .idn = 17 };
		break;
	case 2:
		rq.protocol = &aoe_protocol;
		rq.with.aoe.command = is_write ? AOE_WRITE : AOE_READ;
		rq.capacity = is_write ? 8 : BUFFER;
		break;
	case 3:
		rq.protocol = &voe_protocol;
		rq.with.voe = (struct voe_parameters){ .vendor = 1, .len = 4 };
		rq.capacity = is_write ? 20 : BUFFER;
		break;
	case 4:
		rq.protocol = &eoe_protocol;
		rq.with.eoe.operation = EOE_FRAGMENT;
		break;
	default:
		rq.protocol = &eoe_protocol;
		rq.with.eoe.operation = is_write ? EOE_GET_IP : EOE_SET_IP;
		rq.mail_capacity = EOE_HEADER_BYTES + EOE_IP_BYTES;
	}
	return rq;
}

/* Until it waits for a mail or has ended. */
static int send_all(struct mailbox_request *rq, int next)
{
	static uint8_t mail[EOE_HEADER_BYTES + EOE_IP_BYTES];

	for (unsigned i = 0; next == MAILBOX_SEND; i++) {
		int len = rq->protocol->compose(rq, mail, rq->mail_capacity);

		must(i < SENDS_MAX);
		if (len < 0) {
			return len;
		}
		must(len > 0 && len <= rq->mail_capacity);
		next = rq->protocol->sent != NULL ? rq->protocol->sent(rq) : MAILBOX_WAIT;
	}
	return next;
}

static void check(const struct mailbox_request *rq, int next)
{
	must(next < 0 || next == MAILBOX_DONE || next == MAILBOX_WAIT || next == MAILBOX_IGNORE);
	must(rq->len <= rq->capacity);
	must(next != -EREMOTEIO || rq->protocol != &foe_protocol ||
	     memchr(rq->state.foe.text, '\0', FOE_TEXT_BYTES) != NULL);
	for (unsigned i = 0; i < GUARD; i++) {
		must(buffer[BUFFER + i] == 0x5a);
	}
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
	static struct eoe_assembly assembly;
	struct mailbox_request rq;
	int next;

	if (size == 0) {
		return 0;
	}
	rq = choose(data[0]);
	memset(buffer, 0x5a, sizeof(buffer));
	memset(&assembly, 0, sizeof(assembly));
	next = rq.protocol->start(&rq);
	if (rq.protocol == &aoe_protocol) {
		rq.state.aoe.invoke_id = 1; /* a number that a file can have */
	}
	next = send_all(&rq, next);
	check(&rq, next);
	data++;
	size--;
	while (size > 0 && (next == MAILBOX_WAIT || next == MAILBOX_IGNORE)) {
		size_t len = data[0] < size - 1 ? data[0] : size - 1;

		len = len < MAIL ? len : MAIL;
		(void)eoe_assemble(&assembly, data + 1, len);
		must(assembly.len <= EOE_FRAME_MAX_BYTES);
		next = send_all(&rq, rq.protocol->received(&rq, data + 1, len));
		check(&rq, next);
		data += 1 + len;
		size -= 1 + len;
	}
	if (rq.protocol->give_up != NULL) {
		static uint8_t mail[MAIL];

		must(rq.protocol->give_up(&rq, -ECANCELED, mail, MAIL) <= MAIL);
	}
	return 0;
}
