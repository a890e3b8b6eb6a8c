/* SPDX-License-Identifier: MIT */
/* What one client of the Foxglove protocol has subscribed to, and what it has lost. Context: one
 * thread. */
#ifndef WEB_SUBSCRIPTIONS_H
#define WEB_SUBSCRIPTIONS_H

#include <stdint.h>

#include "web/outbox.h"
#include "web/source.h"

struct subscription {
	uint32_t id;      /* by the client */
	uint32_t channel; /* 0: none */
	uint64_t next;    /* number of the message to be sent next */
};

struct subscriptions {
	struct subscription slot[SOURCE_SLOTS]; /* by source_slot() of the channel */
	uint32_t count;
};

/** Messages from number @next on. 0; -EEXIST: the channel or @id has a subscription already;
 * -EINVAL: no such channel. */
int subscriptions_add(struct subscriptions *subs, uint32_t id, uint32_t channel, uint64_t next);
/** The channel of the subscription that was removed; -ENOENT. */
int64_t subscriptions_remove(struct subscriptions *subs, uint32_t id);

/**
 * The subscription that @message is for, or NULL; *@ret_lost is the number of messages that were
 * dropped before it.
 */
const struct subscription *subscriptions_take(struct subscriptions *subs,
					      const struct outbox_message *message,
					      uint64_t *ret_lost);

#endif
