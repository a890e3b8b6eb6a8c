/* SPDX-License-Identifier: MIT */
/* Firmware that answers for the EEPROM of its ESC (0x0502 bit 5): contents in its own memory. */
#ifndef SIM_DEVICES_EEPROM_EMULATION_H
#define SIM_DEVICES_EEPROM_EMULATION_H

#include <stdint.h>

#include "segment/esc.h"

/** Answer the command that waits, if one does. */
void eeprom_emulation_run(struct esc *esc, int64_t t_ns);

#endif
