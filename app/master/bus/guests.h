/* SPDX-License-Identifier: MIT */
/*
 * Devices that a walk found and that are bound to no slave (bus/places.h): isolated, identified,
 * and either taken back as a lost slave or kept out. Context: service thread.
 */
#ifndef BUS_GUESTS_H
#define BUS_GUESTS_H

#include "bus/walk.h"

/** Those that are no longer on the wire are forgotten. */
void guests_drop(struct bus *bus, const struct walk *walk, const struct bus_emit *emit);
/** A step for each unbound position of @walk; lost slaves that are back are bound in it. */
void guests_follow(struct bus *bus, struct walk *walk, const struct bus_emit *emit);

/** One frame for the EEPROMs of all guests, and of the reference clock, that are being read. */
void bus_guests_step(struct bus *bus);
int bus_guests_is_reading(const struct bus *bus);

/** Guests on the wire now. Those behind a closed port do not count. */
unsigned bus_guests_answering(const struct bus *bus);
/** Guests that are none of our slaves, wherever they are. */
unsigned bus_guests_known(const struct bus *bus);
/** One line about the guests; empty: there are none. */
void bus_guests_describe(const struct bus *bus, char *ret_text, size_t text_bytes);

#endif
