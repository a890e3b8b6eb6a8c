/* SPDX-License-Identifier: MIT */
/* The EEPROM image of the simulated plant. */
#ifndef SIM_DEVICES_PLANT_SII_H
#define SIM_DEVICES_PLANT_SII_H

#include <stddef.h>
#include <stdint.h>

enum {
	PLANT_SII_BYTES = 512,
	PLANT_SM_OUTPUTS = 0,
	PLANT_SM_INPUTS = 1,
	PLANT_BYTES = 4, /* of each of them */
};

/** Write the image to @image of PLANT_SII_BYTES; its length. */
size_t plant_sii(uint8_t *image);

#endif
