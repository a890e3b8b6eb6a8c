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

#include <stddef.h>
#include <stdint.h>

#include "bus/bus.h"
#include "bus/identity.h"

struct bus_emit;

enum { GUESTS_MAX = 16 };

enum guest_kind {
	GUEST_NONE,
	GUEST_NEW,        /* isolated, not identified yet */
	GUEST_STRANGER,   /* of no slave of this session */
	GUEST_WRONG,      /* in the place of a lost slave, with another identity */
	GUEST_UNREADABLE, /* its EEPROM is blank, damaged or does not answer */
	GUEST_WAITING,    /* a lost slave, but it is not certain which one */
};

struct bus_guest {
	enum guest_kind kind;
	uint16_t position;
	uint16_t came_with; /* station address */
	int owner;          /* the slave that has this address; -1: none */
	int expected;       /* the lost slave whose place it has; -1: none */
	int shut_by;        /* the slave whose port to it is closed; -1: it is on the wire */
	uint8_t shut_port;
	mono_t readable_by;
	struct bus_identity identity;
};

/**
 * After a poll in which @answering devices executed a broadcast: walk the positions if they are not
 * those of the last walk, or @is_doubtful. 0; -EAGAIN the wire changed meanwhile, walk again;
 * another -errno of the wire.
 */
int bus_places_follow(struct bus *bus, unsigned answering, int is_doubtful,
		      const struct bus_emit *emit);

/** The way down: ports that were closed towards strangers are open again. */
void bus_places_release(struct bus *bus);

/** Guests on the wire now. Those behind a closed port do not count. */
unsigned bus_guests_answering(const struct bus *bus);
/** Guests that are none of our slaves, wherever they are. */
unsigned bus_guests_known(const struct bus *bus);
/** One line about the guests; empty: there are none. */
void bus_guests_describe(const struct bus *bus, char *ret_text, size_t text_bytes);

#endif
