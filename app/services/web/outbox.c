/* SPDX-License-Identifier: MIT */
#include "web/outbox.h"

#include <assert.h>
#include <errno.h>
#include <stdlib.h>
#include <string.h>

/* Before each message. Positions count bytes since the start; a message is never split at the end
 * of the memory. */
struct head {
	uint32_t bytes; /* of head and data, with what fills up to the next one */
	uint32_t channel;
	uint64_t number;
	int64_t time_ns;
	uint64_t len; /* of the data; FILLER: there is none */
};

#define FILLER UINT64_MAX

struct outbox {
	size_t bytes;
	size_t largest;
	uint64_t tail; /* position of the oldest message */
	uint64_t head; /* position of the next one */
	uint8_t *memory;
};

static size_t round_up(size_t bytes)
{
	return (bytes + 7) / 8 * 8;
}

int outbox_create(size_t bytes, size_t largest, struct outbox **ret_outbox)
{
	size_t most = sizeof(struct head) + round_up(largest);
	struct outbox *box;

	bytes = bytes / 8 * 8;
	if (bytes > UINT32_MAX || bytes / 4 < most) {
		return -EINVAL;
	}
	box = calloc(1, sizeof(*box));
	if (box == NULL) {
		return -ENOMEM;
	}
	box->memory = malloc(bytes);
	if (box->memory == NULL) {
		free(box);
		return -ENOMEM;
	}
	box->bytes = bytes;
	box->largest = largest;
	*ret_outbox = box;
	return 0;
}

void outbox_destroy(struct outbox *box)
{
	if (box != NULL) {
		free(box->memory);
		free(box);
	}
}

static struct head head_at(const struct outbox *box, uint64_t position)
{
	struct head head;

	memcpy(&head, box->memory + position % box->bytes, sizeof(head));
	return head;
}

static void put_head(struct outbox *box, const struct head *head)
{
	memcpy(box->memory + box->head % box->bytes, head, sizeof(*head));
	box->head += head->bytes;
}

/* Drop the oldest until @bytes more fit. */
static void make_room(struct outbox *box, size_t bytes)
{
	while (box->head + bytes - box->tail > box->bytes) {
		size_t rest = box->bytes - box->tail % box->bytes;

		/* What is too short for a head is at the end of the memory. */
		box->tail += rest < sizeof(struct head) ? rest : head_at(box, box->tail).bytes;
	}
}

uint8_t *outbox_reserve(struct outbox *box)
{
	size_t most = sizeof(struct head) + round_up(box->largest);
	size_t rest = box->bytes - box->head % box->bytes;

	if (rest < most) {
		make_room(box, rest);
		if (rest < sizeof(struct head)) {
			box->head += rest;
		} else {
			put_head(box, &(struct head){ .bytes = (uint32_t)rest, .len = FILLER });
		}
	}
	make_room(box, most);
	return box->memory + box->head % box->bytes + sizeof(struct head);
}

void outbox_put(struct outbox *box, const struct outbox_message *message)
{
	assert(message->len <= box->largest);
	put_head(box,
		 &(struct head){ .bytes = (uint32_t)(sizeof(struct head) + round_up(message->len)),
				 .channel = message->channel,
				 .number = message->number,
				 .time_ns = message->time_ns,
				 .len = message->len });
}

uint64_t outbox_head(const struct outbox *box)
{
	return box->head;
}

int outbox_read(const struct outbox *box, uint64_t *cursor, struct outbox_message *ret_message)
{
	if (*cursor < box->tail) {
		*cursor = box->tail;
	}
	while (*cursor < box->head) {
		size_t rest = box->bytes - *cursor % box->bytes;
		struct head head;

		if (rest < sizeof(struct head)) {
			*cursor += rest;
			continue;
		}
		head = head_at(box, *cursor);
		*cursor += head.bytes;
		if (head.len != FILLER) {
			*ret_message = (struct outbox_message){
				.channel = head.channel,
				.number = head.number,
				.time_ns = head.time_ns,
				.data = box->memory + (*cursor - head.bytes) % box->bytes +
					sizeof(head),
				.len = head.len,
			};
			return 1;
		}
	}
	return 0;
}
