/* SPDX-License-Identifier: MIT */
/*
 * A board for the firmware to run on: a fake HAL whose SPI ends in a small ET1100, octet by octet.
 * It counts every breach of the SPI rules, so that a test can say there was none. The master's side
 * is the board_master_ calls.
 */
#ifndef TESTS_UNIT_FIRMWARE_BOARD_H
#define TESTS_UNIT_FIRMWARE_BOARD_H

#include <stddef.h>
#include <stdint.h>

#include "firmware/fb1111_piccolo/piccolo.h"

enum { BOARD_MEMORY = 0x2000 };

struct board_breaches {
	unsigned before_loaded; /* any SPI traffic before EEPROM_LOADED */
	unsigned unmasked;      /* SPI outside of interrupts-off and ISR */
	unsigned select;        /* octet without select, select twice, deselect without select */
	unsigned wait_state;    /* wait-state octet not 0xff */
	unsigned termination;   /* read not ended with 0xff, or 0xff before its end */
	unsigned address;       /* filler bits set, unknown command */
	unsigned nesting;       /* interrupts off twice, on twice */
	unsigned too_long;      /* more than 45 octets with interrupts off at a stretch */
};

struct board {
	struct piccolo fw;
	uint8_t memory[BOARD_MEMORY];
	uint16_t al_event;
	int is_sm0_full, is_sm1_full;
	struct board_breaches breaches;

	/* SPI shift state */
	int is_selected;
	unsigned pos;
	uint8_t header[3];
	uint16_t address;
	int is_last_out;

	/* pins, timer, interrupts */
	int is_loaded;
	int is_masked, is_in_isr;
	int is_edge_pending;
	unsigned octets_masked;
	unsigned octets;
	uint32_t us;
	uint16_t adc;
	int adc_overrun;
	int adc_started;
	int led;

	/* the update slot */
	uint8_t flash[PICCOLO_FLASH_OCTETS];
	unsigned erasures;
	unsigned busy; /* so many times more is the flash busy */
	int is_flash_broken;
	int is_image_running; /* the slot's image was started */

	/* what the firmware wrote */
	unsigned input_writes;
	unsigned activation_writes;
	unsigned master_counter;
};

/** Power on with EEPROM_LOADED still low. */
void board_init(struct board *b);
/** EEPROM_LOADED up and the first passes of the main loop. */
void board_start(struct board *b);
/** Main loop for @us microseconds, at its own pace. */
void board_run(struct board *b, uint32_t us);
/** One SYNC0 edge at DC time @edge_ns; the interrupt runs at once unless it is masked. */
void board_sync0(struct board *b, uint64_t edge_ns);
/** All breaches together. */
unsigned board_breaches(const struct board *b);

/* --- the master's side --- */

void board_master_mailbox_sms(struct board *b);
void board_master_process_data(struct board *b);
/** SYNC0 in the master's hand: 0x0980 = 0, 0x0981 = 3, @cycle_ns. */
void board_master_sync0(struct board *b, uint32_t cycle_ns);
/** The SYNC unit given to the PDI. */
void board_master_give_sync(struct board *b);
/** Write AL control and run until the answer; returns AL status. */
uint16_t board_master_request(struct board *b, uint16_t control);
uint16_t board_al_status(const struct board *b);
uint16_t board_al_code(const struct board *b);
void board_master_outputs(struct board *b, uint8_t led, uint64_t oneshot_ns);
void board_master_watchdog_expires(struct board *b);
void board_set_dc_time(struct board *b, uint64_t now_ns);
/** All the way to @state in periodic mode with 1 ms; checks each step. */
void board_lead_to(struct board *b, enum piccolo_state state);
/** The same in one-shot mode. */
void board_lead_to_oneshot(struct board *b, enum piccolo_state state);

/* A mailbox frame into SM0, header made from @type and @counter. */
void board_mailbox_put(struct board *b, uint8_t type, uint8_t counter, const uint8_t *data,
		       size_t len);
/** Run until an answer lies in SM1 and take it: 128 octets; 0, or -1 if none came in 50 ms. */
int board_mailbox_take(struct board *b, uint8_t *ret_mailbox);

/* SDO: abort code or 0. */
uint32_t board_sdo_read(struct board *b, uint16_t index, uint8_t subindex, uint8_t *ret_data,
			size_t *ret_len);
uint32_t board_sdo_write(struct board *b, uint16_t index, uint8_t subindex, uint32_t value,
			 size_t len);

#endif
