/* SPDX-License-Identifier: MIT */
#include "daemon/post.h"

#include <errno.h>
#include <stddef.h>

int post_push(struct post *post, const struct event *ev)
{
	uint32_t head = atomic_load_explicit(&post->head, memory_order_relaxed);
	uint32_t tail = atomic_load_explicit(&post->tail, memory_order_acquire);

	if (head - tail == POST_CAPACITY) {
		post->dropped++;
		return -EAGAIN;
	}
	post->slot[head & (POST_CAPACITY - 1)] = *ev;
	atomic_store_explicit(&post->head, head + 1, memory_order_release);
	return 0;
}

void post_collect(struct post *post, struct ring *events)
{
	uint32_t tail = atomic_load_explicit(&post->tail, memory_order_relaxed);
	uint32_t head = atomic_load_explicit(&post->head, memory_order_acquire);

	while (tail != head) {
		ring_push(events, &post->slot[tail & (POST_CAPACITY - 1)], sizeof(struct event),
			  NULL, 0);
		tail++;
	}
	atomic_store_explicit(&post->tail, tail, memory_order_release);
}
