/* SPDX-License-Identifier: MIT */
/* What a board support package for the F28069 supplies to main.c. */
#ifndef FB1111_PICCOLO_BOARD_H
#define FB1111_PICCOLO_BOARD_H

#include "hal.h"

/** Clocks, pins and peripherals up; @ret_hal filled. */
void board_init(struct piccolo_hal *ret_hal);
/** From now on call @handler on every rising edge of SYNC0 (XINT2). */
void board_on_sync0(void (*handler)(void));

#endif
