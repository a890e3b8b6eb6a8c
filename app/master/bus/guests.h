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

#endif
