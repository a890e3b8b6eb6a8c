/* SPDX-License-Identifier: MIT */
#include "segment/event_queue.h"

#include <errno.h>
#include <stdlib.h>

int event_queue_init(struct event_queue *q, size_t count)
{
	q->places = 2;
	while (q->places < count) {
		q->places *= 2;
	}
	q->due_ns = malloc(q->places * sizeof(*q->due_ns));
	q->winner = malloc(2 * q->places * sizeof(*q->winner));
	if (q->due_ns == NULL || q->winner == NULL) {
		event_queue_done(q);
		return -ENOMEM;
	}
	for (size_t i = 0; i < q->places; i++) {
		q->due_ns[i] = INT64_MAX;
		q->winner[q->places + i] = (uint16_t)i;
	}
	for (size_t match = q->places - 1; match > 0; match--) {
		q->winner[match] = q->winner[2 * match];
	}
	return 0;
}

void event_queue_done(struct event_queue *q)
{
	free(q->due_ns);
	free(q->winner);
	*q = (struct event_queue){ 0 };
}

void event_queue_set(struct event_queue *q, size_t slave, int64_t due_ns)
{
	if (q->due_ns[slave] == due_ns) {
		return;
	}
	q->due_ns[slave] = due_ns;
	for (size_t match = (q->places + slave) / 2; match > 0; match /= 2) {
		uint16_t first = q->winner[2 * match];
		uint16_t second = q->winner[2 * match + 1];
		uint16_t winner = q->due_ns[second] < q->due_ns[first] ? second : first;

		if (winner == q->winner[match] && winner != slave) {
			return;
		}
		q->winner[match] = winner;
	}
}
