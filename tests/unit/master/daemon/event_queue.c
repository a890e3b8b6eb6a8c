/* SPDX-License-Identifier: MIT */
#include "daemon/event_queue.h"

#include <errno.h>
#include <pthread.h>
#include <stdatomic.h>
#include <unistd.h>

#include "harness/test.h"

static struct ring *make_events(char *path, size_t path_bytes, unsigned depth)
{
	struct ring *events = NULL;
	struct ring_spec spec = { .path = path,
				  .kind = "event",
				  .payload_bytes = sizeof(struct event),
				  .slot_count = depth,
				  .file_mode = 0600 };

	snprintf(path, path_bytes, "/dev/shm/ecdaqd-event-queue-%d", getpid());
	CHECK_EQ(ring_create(&spec, &events), 0);
	return events;
}

TEST(daemon_event_queue, events_come_out_in_the_order_they_were_pushed)
{
	static struct event_queue queue;
	char path[64];
	struct ring *events = make_events(path, sizeof(path), 64);
	struct ring_reader *reader = NULL;
	struct event ev = { .id = EVENT_SLAVE_LOST };
	uint64_t lost;

	CHECK_EQ(ring_reader_open(path, &reader), 0);
	for (int i = 0; i < 10; i++) {
		ev.value = i;
		CHECK_EQ(event_queue_push(&queue, &ev), 0);
	}
	CHECK_EQ(ring_pushed(events), 0);
	event_queue_collect(&queue, events);
	CHECK_EQ(ring_pushed(events), 10);
	event_queue_collect(&queue, events);
	CHECK_EQ(ring_pushed(events), 10);
	ring_seek(reader, 0);
	for (int i = 0; i < 10; i++) {
		CHECK_EQ(ring_read(reader, &ev, sizeof(ev), &lost), RING_OK);
		CHECK_EQ(ev.value, i);
	}
	ring_reader_destroy(reader);
	ring_destroy(events);
	unlink(path);
}

TEST(daemon_event_queue, a_full_queue_drops_the_newest_and_counts_it)
{
	static struct event_queue queue;
	char path[64];
	struct ring *events = make_events(path, sizeof(path), 2 * EVENT_QUEUE_CAPACITY);
	struct event ev = { .id = EVENT_SLAVE_LOST };

	for (int i = 0; i < EVENT_QUEUE_CAPACITY; i++) {
		CHECK_EQ(event_queue_push(&queue, &ev), 0);
	}
	CHECK_EQ(event_queue_push(&queue, &ev), -EAGAIN);
	CHECK_EQ(queue.dropped, 1);
	event_queue_collect(&queue, events);
	CHECK_EQ(ring_pushed(events), EVENT_QUEUE_CAPACITY);
	CHECK_EQ(event_queue_push(&queue, &ev), 0);
	ring_destroy(events);
	unlink(path);
}

enum { HANDOVER_EVENTS = 200000 };

struct handover {
	struct event_queue queue;
	struct ring *events;
	_Atomic int is_done;
};

static void *collect(void *arg)
{
	struct handover *h = arg;

	while (!atomic_load(&h->is_done)) {
		event_queue_collect(&h->queue, h->events);
	}
	event_queue_collect(&h->queue, h->events);
	return NULL;
}

TEST(daemon_event_queue, two_threads_hand_over_every_event)
{
	static struct handover h;
	char path[64];
	struct event ev = { .id = EVENT_SLAVE_LOST };
	pthread_t thread;
	int posted = 0;

	h.events = make_events(path, sizeof(path), 64);
	CHECK_EQ(pthread_create(&thread, NULL, collect, &h), 0);
	while (posted < HANDOVER_EVENTS) {
		posted += event_queue_push(&h.queue, &ev) == 0;
	}
	atomic_store(&h.is_done, 1);
	pthread_join(thread, NULL);
	CHECK_EQ(ring_pushed(h.events), HANDOVER_EVENTS);
	ring_destroy(h.events);
	unlink(path);
}
