/* SPDX-License-Identifier: MIT */
#include "daemon/event_queue.h"

#include <errno.h>
#include <stddef.h>

int event_queue_push(struct event_queue *queue, const struct event *ev)
{
	uint32_t head = atomic_load_explicit(&queue->head, memory_order_relaxed);
	uint32_t tail = atomic_load_explicit(&queue->tail, memory_order_acquire);

	if (head - tail == EVENT_QUEUE_CAPACITY) {
		queue->dropped++;
		return -EAGAIN;
	}
	queue->slot[head & (EVENT_QUEUE_CAPACITY - 1)] = *ev;
	atomic_store_explicit(&queue->head, head + 1, memory_order_release);
	return 0;
}

void event_queue_collect(struct event_queue *queue, struct ring *events)
{
	uint32_t tail = atomic_load_explicit(&queue->tail, memory_order_relaxed);
	uint32_t head = atomic_load_explicit(&queue->head, memory_order_acquire);

	while (tail != head) {
		ring_push(events, &queue->slot[tail & (EVENT_QUEUE_CAPACITY - 1)],
			  sizeof(struct event), NULL, 0);
		tail++;
	}
	atomic_store_explicit(&queue->tail, tail, memory_order_release);
}
