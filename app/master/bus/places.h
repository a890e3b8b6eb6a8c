/* SPDX-License-Identifier: MIT */
/*
 * Who answers at which position of the wire. A slave of this session is known by what the master
 * has written to it and by its identity, not by its station address alone: every device that
 * another master has scanned carries an address from 0x1001 on. What belongs to no slave is a
 * guest: its address is taken away before anything else is written to it, it is identified, and it
 * is either a lost slave that has returned or a stranger, which is neither configured nor believed.
 * Context: service thread.
 */
#ifndef BUS_PLACES_H
#define BUS_PLACES_H

struct bus;
struct bus_emit;

/**
 * After a poll in which @answering devices executed a broadcast: walk the positions if they are not
 * those of the last walk, or @is_doubtful. 0; -EAGAIN the wire changed meanwhile, walk again;
 * another -errno of the wire.
 */
int bus_places_follow(struct bus *bus, unsigned answering, int is_doubtful,
		      const struct bus_emit *emit);

/** The way down: ports that were closed towards strangers are open again. */
void bus_places_release(struct bus *bus);

#endif
