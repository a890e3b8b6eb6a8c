/* SPDX-License-Identifier: MIT */
/* The power state machine of a drive (CiA 402, IEC 61800-7-201), in the words that show it. Pure.
 */
#ifndef SIM_DEVICES_CIA402_H
#define SIM_DEVICES_CIA402_H

#include <stdint.h>

/** The statusword after @status when the controlword is @control. 0 counts as "not ready". */
uint16_t cia402_statusword(uint16_t status, uint16_t control);

#endif
