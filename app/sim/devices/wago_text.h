/* SPDX-License-Identifier: MIT */
/*
 * A WAGO node in words: its name in a list of slaves, and its terminals on the control socket.
 *
 *   wago_750_354              the node of the example: 457, 557, 430, 530
 *   wago_750_354+430+530      a node with these modules
 *
 *   slot1=0x7fff,0,0,0        all channels of an analog module, in counts
 *   slot3=0x01                those of a digital one, channel 1 in bit 0
 *   slot3.1=1                 one channel (to set)
 */
#ifndef SIM_DEVICES_WAGO_TEXT_H
#define SIM_DEVICES_WAGO_TEXT_H

#include <stddef.h>

#include "segment/device.h"
#include "segment/segment.h"

/** 1 if @name is this coupler's, whatever follows it. */
int wago_750_354_is_name(const char *name);
/** wago_750_354_slave() by @name. -EINVAL: a module that is not known. */
int wago_750_354_by_name(int position, const char *name, struct segment_slave_spec *ret_spec);

/* As struct sim_device_ops has them. */
void wago_io_get(const struct sim_device *dev, char *ret_text, size_t text_bytes);
int wago_io_set(struct sim_device *dev, const char *key, const char *value);

#endif
