/* SPDX-License-Identifier: MIT */
/*
 * Frames received by a packet socket, in memory that the kernel shares with this process: taking
 * one is no system call. The kernel drops frames while the ring is full.
 */
#ifndef LINK_PACKET_RING_H
#define LINK_PACKET_RING_H

#include <stddef.h>
#include <stdint.h>

struct packet_ring {
	uint8_t *bytes;
	unsigned next; /* [owner of the transport] the frame that comes next */
};

/** Set up the ring of @fd, a packet socket that is not bound yet. 0, -errno. Context: blocking. */
int packet_ring_open(int fd, struct packet_ring *ret_ring);

void packet_ring_close(struct packet_ring *ring);

/**
 * Copy the oldest frame into @frame. Its length; -EAGAIN: there is none, or one that left this
 * machine or is longer than @capacity, which is passed over. Context: cycle.
 */
int packet_ring_take(struct packet_ring *ring, uint8_t *frame, size_t capacity);

#endif
