/* SPDX-License-Identifier: MIT */
/*
 * A learning switch between the host's network interface and all slaves that speak EoE. A frame
 * goes to the port its destination was last seen at; broadcasts, multicasts and unknown
 * destinations go to all ports but the one it came from. Queues are bounded: what does not fit, or
 * is not taken by a slave, is dropped and counted. Memory is allocated at creation only.
 * Context: service thread; never waits.
 */
#ifndef NETWORK_EOE_SWITCH_H
#define NETWORK_EOE_SWITCH_H

#include <stddef.h>
#include <stdint.h>

#include "base/clock.h"

struct mailbox_engine;
struct eoe_switch;

/* Frames that wait: in all, and for one slave. */
enum { EOE_SWITCH_FRAMES = 256, EOE_SWITCH_QUEUE = 32 };

/* The host's side. */
struct eoe_switch_host {
	/** The next frame of the host into @frame: its length; -EAGAIN: none. */
	int (*receive)(void *ctx, uint8_t *frame, size_t capacity);
	/** 0; -errno: the frame is lost. */
	int (*send)(void *ctx, const uint8_t *frame, size_t len);
	void *ctx;
};

struct eoe_switch_counters {
	uint64_t from_host;
	uint64_t to_host;
	uint64_t from_slaves;
	uint64_t to_slaves;
	uint64_t queue_full;     /* frames to a slave that has too many waiting, or to all */
	uint64_t not_taken;      /* by the slave, in time, or its mailbox is gone */
	uint64_t host_lost;      /* to an interface that is down or full, or too long from it */
	uint64_t bad_fragments;  /* of slaves: each ends the frame it belongs to */
	uint64_t invalid_frames; /* of slaves: too short, or from a group address */
	uint16_t bad_slave;      /* the newest slave with one of these */
};

/** Free with eoe_switch_destroy(). 0; -ENOMEM. */
int eoe_switch_create(const struct eoe_switch_host *host, struct eoe_switch **ret_switch);
void eoe_switch_destroy(struct eoe_switch *sw);

/**
 * One pass, before a step of @mb: frames of the host, and the next frame of each slave's queue. The
 * slaves' frames come while the engine steps. @slave_count positions from 0 on may have EoE;
 * @timeout: of one mail. @mb NULL, with no slaves: the bus is not up, frames of the host are lost.
 */
void eoe_switch_service(struct eoe_switch *sw, struct mailbox_engine *mb, size_t slave_count,
			span_t timeout, mono_t now);
/** The bus goes down: what waits for slaves is dropped. */
void eoe_switch_detach(struct eoe_switch *sw);

const struct eoe_switch_counters *eoe_switch_counters(const struct eoe_switch *sw);

#endif
