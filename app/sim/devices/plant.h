/* SPDX-License-Identifier: MIT */
/*
 * A thing to control: a first-order lag, like a heater with a thermometer. One actuator (REAL, 0 to
 * 100 %), one sensor (REAL):
 *
 *	tau * d(sensor)/dt = gain * actuator - sensor
 *
 * solved exactly between the instants at which the actuator changes. The sensor is read at SYNC0,
 * or, without SYNC0, in each pass of the slave's main loop (0.5 ms); the actuator is taken in each
 * pass. It is 0 unless the slave is in OP, and so when its watchdog is down.
 */
#ifndef SIM_DEVICES_PLANT_H
#define SIM_DEVICES_PLANT_H

#include "segment/device.h"
#include "segment/segment.h"

#define PLANT_TAU_S 0.05
#define PLANT_GAIN 1.0

/**
 * Fill a spec for one plant, behind slave @position - 1 of a line. The segment takes it over; its
 * EEPROM image lives as long as it does. 0 or -ENOMEM.
 */
int plant_slave(int position, double tau_s, double gain, struct segment_slave_spec *ret_spec);

/** 1 if @name is a plant's in a list of slaves, whatever follows it. */
int plant_is_name(const char *name);
/** "plant", "plant:TAU_MS", "plant:TAU_MS:GAIN". 0, -ENOMEM, -EINVAL: not that. */
int plant_by_name(int position, const char *name, struct segment_slave_spec *ret_spec);

/** What is there now: actuator in %, sensor. */
double plant_actuator(const struct sim_device *dev);
double plant_sensor(const struct sim_device *dev);

#endif
