/* SPDX-License-Identifier: MIT */
/*
 * The FB1111-Piccolo board: firmware/fb1111_piccolo as it is, on a HAL made of the modelled SPI
 * pins, an ADC that SYNC0 starts, an LED and the segment's time. The CPU's program takes no time,
 * its SPI octets do.
 */
#ifndef SIM_DEVICES_FB1111_PICCOLO_H
#define SIM_DEVICES_FB1111_PICCOLO_H

#include <stdint.h>

#include "segment/device.h"
#include "segment/segment.h"

enum {
	FB1111_PICCOLO_INTERRUPT_NS = 500,    /* SYNC0 edge to the first SPI octet, at 90 MHz */
	FB1111_PICCOLO_CONVERSION_NS = 650,   /* SYNC0 edge to the end of the conversion */
	FB1111_PICCOLO_LOOP_NS = 2000,        /* one idle pass of the main loop */
	FB1111_PICCOLO_ERASE_NS = 300000000,  /* a slot of the flash */
	FB1111_PICCOLO_RESTART_NS = 20000000, /* reset to the first pass of the main loop */
};

/**
 * Fill a spec for one board, behind slave @position - 1 of a line: 1 m of cable, about 1 us a slave
 * there and back. The segment takes the board over; its EEPROM image lives as long as it does. 0 or
 * -ENOMEM.
 */
int fb1111_piccolo_slave(int position, struct segment_slave_spec *ret_spec);

/** 1 if the LED is lit. */
int fb1111_piccolo_led(const struct sim_device *dev);

/** How long after its SYNC0 edge the last sample was in SM3; 0: none yet. */
int64_t fb1111_piccolo_copy_ns(const struct sim_device *dev);

/** Fault: the CPU hangs with interrupts off from @t_ns for @span_ns; edges in that time are
 * overruns. */
void fb1111_piccolo_stall(struct sim_device *dev, int64_t t_ns, int64_t span_ns);

#endif
