/* SPDX-License-Identifier: MIT */
/*
 * The generic slave: AL states with the checks a real one makes, a CoE server if its SII says CoE,
 * the process data that its SII or its model describes. Where the EEPROM asks for device emulation
 * the chip does the states.
 */
#ifndef SIM_DEVICES_SII_DEVICE_H
#define SIM_DEVICES_SII_DEVICE_H

#include <stddef.h>
#include <stdint.h>

#include "devices/slave_model.h"
#include "segment/device.h"

/** The slave of an SII image, damaged or not; each input byte counts. NULL: no memory. */
struct sim_device *sii_device_create(const uint8_t *sii, size_t sii_bytes);
/** The slave of a model, whose inputs show what the model says. NULL: no memory. */
struct sim_device *sii_device_from_model(const struct slave_model *model);
/** The EEPROM image of a slave made from a model; lives as long as @dev. */
const uint8_t *sii_device_image(struct sim_device *dev, size_t *ret_bytes);

#endif
