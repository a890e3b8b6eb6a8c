/* SPDX-License-Identifier: MIT */
/*
 * SDOs that bring-up reads, of all slaves at the same time. The code that reads stays as it is, one
 * object after another: it is run for each slave until it needs an answer that is not there. That
 * is asked for, and the code begins again when it has come. In the end it runs once more for good,
 * with all its answers there.
 */
#include <errno.h>
#include <stdlib.h>
#include <string.h>

#include "bus/bus_internal.h"

struct answer {
	struct mailbox_request request;
	struct answer *next;
	uint8_t data[];
};

struct read_ahead {
	int is_asking; /* no run for good yet */
	struct answer *first[LIMIT_SLAVES];
};

static struct answer **find(struct read_ahead *ahead, const struct mailbox_request *rq)
{
	struct answer **at = &ahead->first[rq->slave_pos];
	const struct coe_parameters *wanted = &rq->with.coe;

	while (*at != NULL) {
		const struct coe_parameters *has = &(*at)->request.with.coe;

		if (has->operation == wanted->operation && has->index == wanted->index &&
		    has->subindex == wanted->subindex) {
			break;
		}
		at = &(*at)->next;
	}
	return at;
}

static int ask(struct bus *bus, const struct mailbox_request *rq, struct answer **end)
{
	struct answer *a = calloc(1, sizeof(*a) + rq->capacity);
	int r;

	if (a == NULL) {
		return -ENOMEM;
	}
	a->request = *rq;
	a->request.buffer = a->data;
	*end = a;
	r = bus_mailbox_submit(bus, &a->request);
	if (r < 0) {
		a->request.result = r;
	}
	return -EAGAIN;
}

int bus_read_ahead_take(struct bus *bus, struct mailbox_request *rq)
{
	struct answer **at = find(bus->ahead, rq);
	const struct answer *a = *at;
	int r;

	if (a == NULL) {
		return bus->ahead->is_asking ? ask(bus, rq, at) : -ENOENT;
	}
	r = a->request.result;
	if (r == -EINPROGRESS) {
		return -EAGAIN;
	}
	if (a->request.len > 0) {
		memcpy(rq->buffer, a->data, a->request.len);
	}
	rq->len = a->request.len;
	rq->detail = a->request.detail;
	rq->is_mailbox_error = a->request.is_mailbox_error;
	rq->result = r;
	return r;
}

int bus_read_ahead_forbids(const struct bus *bus)
{
	return bus->ahead != NULL && bus->ahead->is_asking;
}

void bus_read_ahead_forget(struct bus *bus, size_t pos)
{
	struct answer **first = &bus->ahead->first[pos];

	while (*first != NULL) {
		struct answer *a = *first;

		*first = a->next;
		mailbox_cancel(bus->mailbox, &a->request);
		free(a);
	}
}

int bus_read_ahead(struct bus *bus, int (*read)(struct bus *bus, size_t pos))
{
	uint8_t is_done[LIMIT_SLAVES] = { 0 };
	size_t open = bus->slave_count;
	int r = 0;

	bus->ahead = calloc(1, sizeof(*bus->ahead));
	if (bus->ahead == NULL) {
		return bus_fail(bus, -ENOMEM, "no memory to read SDOs of all slaves");
	}
	bus->ahead->is_asking = 1;
	while (open > 0 && r >= 0) {
		for (size_t i = 0; i < bus->slave_count; i++) {
			if (!is_done[i] && read(bus, i) != -EAGAIN) {
				is_done[i] = 1;
				open--;
			}
		}
		r = mailbox_wait_all(bus->mailbox);
	}
	bus->ahead->is_asking = 0;
	return r < 0 ? bus_fail(bus, r, "stopped while the slaves' SDOs are read") : 0;
}

void bus_read_ahead_end(struct bus *bus)
{
	for (size_t i = 0; i < LIMIT_SLAVES && bus->ahead != NULL; i++) {
		bus_read_ahead_forget(bus, i);
	}
	free(bus->ahead);
	bus->ahead = NULL;
}
