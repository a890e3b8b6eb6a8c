/* SPDX-License-Identifier: MIT */
/*
 * The WAGO 750-354 EtherCAT coupler with its I/O modules. One K-bus cycle reads all inputs and
 * writes all outputs; it starts at SYNC0, or, without SYNC0, runs by itself. Channel n of an analog
 * input sees the slave's signal with (n - 1) quarter turns more phase; digital inputs are set by
 * hand. Outputs are 0 unless the coupler is in OP.
 *
 * Its name in a list of slaves, and its terminals on the control socket:
 *
 *   wago_750_354              the default node: 457, 557, 430, 530
 *   wago_750_354+430+530      a node with these modules
 *
 *   slot1=0x7fff,0,0,0        all channels of an analog module, in counts
 *   slot3=0x01                those of a digital one, channel 1 in bit 0
 *   slot3.1=1                 one channel (to set)
 */
#ifndef SIM_DEVICES_WAGO_750_354_H
#define SIM_DEVICES_WAGO_750_354_H

#include <stdint.h>

#include "devices/wago_node.h"
#include "segment/device.h"
#include "segment/segment.h"

enum {
	WAGO_KBUS_NS = 250000,      /* one K-bus cycle, start to the new inputs in SM3 */
	WAGO_FREE_RUN_NS = 1000000, /* from one to the next, without SYNC0 */
};

/**
 * Fill a spec for a coupler with @count modules, behind slave @position - 1 of a line. The segment
 * takes it over; its EEPROM image lives as long as it does. 0, -ENOMEM, -E2BIG: too many modules.
 */
int wago_750_354_slave(int position, const struct wago_module *const *modules, size_t count,
		       struct segment_slave_spec *ret_spec);

/** 1 if @name is this coupler's, whatever follows it. */
int wago_750_354_is_name(const char *name);
/** wago_750_354_slave() by @name. -EINVAL: a module that is not known. */
int wago_750_354_by_name(int position, const char *name, struct segment_slave_spec *ret_spec);

/* The hand at the terminals. @slot counts modules from 0, @channel from 1. */

const struct wago_node *wago_750_354_node(const struct sim_device *dev);
/** What a channel has: ADC or DAC counts as two's complement, 0 or 1; -EINVAL: no such channel. */
int wago_750_354_get(const struct sim_device *dev, size_t slot, unsigned channel, int *ret_value);
/** Set a digital input; -EINVAL: no such channel, or not a digital input. */
int wago_750_354_set(struct sim_device *dev, size_t slot, unsigned channel, int is_on);

#endif
