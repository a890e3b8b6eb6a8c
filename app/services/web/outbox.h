/* SPDX-License-Identifier: MIT */
/*
 * The messages for all clients: each is encoded once and kept until newer ones need its place. Each
 * client reads with a cursor of its own. A client that is too slow loses the oldest messages; its
 * cursor is moved, nobody waits for it. Context: one thread.
 */
#ifndef WEB_OUTBOX_H
#define WEB_OUTBOX_H

#include <stddef.h>
#include <stdint.h>

struct outbox;

struct outbox_message {
	uint32_t channel; /* id, web/source.h */
	uint64_t number;  /* of the message in its channel, from 0 */
	int64_t time_ns;  /* Unix time */
	const uint8_t *data;
	size_t len;
};

/** Room for @bytes of messages, @largest at most for each. 0; -ENOMEM; -EINVAL: @bytes is less than
 * four of the largest. Free with outbox_destroy(). */
int outbox_create(size_t bytes, size_t largest, struct outbox **ret_outbox);
void outbox_destroy(struct outbox *box);

/** Where the next message goes: `largest` bytes. Then outbox_put() it, or forget it. */
uint8_t *outbox_reserve(struct outbox *box);
/** The message is complete; its data is in outbox_reserve(), @message->data is not read. */
void outbox_put(struct outbox *box, const struct outbox_message *message);

/** A cursor that reads what is put from now on. */
uint64_t outbox_head(const struct outbox *box);
/** The message at *@cursor, valid until the next outbox_reserve(); *@cursor moves behind it. 1, or
 * 0: all were read. */
int outbox_read(const struct outbox *box, uint64_t *cursor, struct outbox_message *ret_message);

#endif
