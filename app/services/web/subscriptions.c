/* SPDX-License-Identifier: MIT */
#include "web/subscriptions.h"

#include <errno.h>

static struct subscription *find(struct subscriptions *subs, uint32_t id)
{
	for (uint32_t i = 0; i < SOURCE_SLOTS; i++) {
		if (subs->slot[i].channel != 0 && subs->slot[i].id == id) {
			return &subs->slot[i];
		}
	}
	return NULL;
}

int subscriptions_add(struct subscriptions *subs, uint32_t id, uint32_t channel, uint64_t next)
{
	uint32_t slot = source_slot(channel);

	if (channel == 0 || slot >= SOURCE_SLOTS) {
		return -EINVAL;
	}
	if (subs->slot[slot].channel != 0 || find(subs, id) != NULL) {
		return -EEXIST;
	}
	subs->slot[slot] = (struct subscription){ .id = id, .channel = channel, .next = next };
	subs->count++;
	return 0;
}

int64_t subscriptions_remove(struct subscriptions *subs, uint32_t id)
{
	struct subscription *s = find(subs, id);
	uint32_t channel;

	if (s == NULL) {
		return -ENOENT;
	}
	channel = s->channel;
	*s = (struct subscription){ .channel = 0 };
	subs->count--;
	return channel;
}

const struct subscription *subscriptions_take(struct subscriptions *subs,
					      const struct outbox_message *message,
					      uint64_t *ret_lost)
{
	struct subscription *s = &subs->slot[source_slot(message->channel)];

	if (s->channel != message->channel || message->number < s->next) {
		return NULL;
	}
	*ret_lost = message->number - s->next;
	s->next = message->number + 1;
	return s;
}
