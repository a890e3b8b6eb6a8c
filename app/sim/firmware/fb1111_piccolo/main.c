/* SPDX-License-Identifier: MIT */
/*
 * The board's entry. The board support (clock tree, SPI-A, ADC, XINT2, timer 0) fills the HAL and
 * calls board_on_sync0()'s function from the XINT2 interrupt.
 */
#include "board.h"
#include "piccolo.h"

static struct piccolo piccolo;

static void on_sync0(void)
{
	piccolo_sync0_isr(&piccolo);
}

int main(void)
{
	struct piccolo_hal hal;

	board_init(&hal);
	piccolo_init(&piccolo, &hal);
	board_on_sync0(on_sync0);
	for (;;) {
		(void)piccolo_step(&piccolo);
	}
}
