/* SPDX-License-Identifier: MIT */
/* A made-up terminal with mailbox, CoE, two RxPDOs and two TxPDOs, and a master's hand on it. */
#ifndef TESTS_UNIT_SIM_TERMINAL_H
#define TESTS_UNIT_SIM_TERMINAL_H

#include <stddef.h>
#include <stdint.h>

#include "bench.h"

enum {
	TERMINAL_SII_BYTES = 1024,
	TERMINAL_MAILBOX_OUT = 0x1000,
	TERMINAL_MAILBOX_IN = 0x1080,
	TERMINAL_OUTPUTS = 0x1100,
	TERMINAL_INPUTS = 0x1180,
	TERMINAL_OUTPUT_BYTES = 3, /* 0x1600: 2 bytes, 0x1601: 1 byte */
	TERMINAL_INPUT_BYTES = 4,  /* 0x1a00: 4 bytes; 0x1a01, 1 byte, is not assigned */
};

/** Its SII image, named @name. Returns its bytes. */
size_t terminal_sii(uint8_t *sii, const char *name);
/** One of them behind an ET1100, in INIT; its mailboxes take @mailbox_bytes. */
struct bench *terminal_create(uint16_t mailbox_bytes);
/** Ask for @control, wait for the application; AL status. The code is read by terminal_code(). */
uint16_t terminal_request(struct bench *b, uint16_t control);
uint16_t terminal_code(struct bench *b);
/** To PRE-OP, with mailboxes of @mailbox_bytes. */
void terminal_to_preop(struct bench *b, uint16_t mailbox_bytes);
/** Process data SMs as the default assignment wants them, to SAFE-OP. */
void terminal_to_safeop(struct bench *b);

/** Put mailbox data of protocol @type with @counter. Returns the WKC. */
uint16_t terminal_put(struct bench *b, uint8_t type, uint8_t counter, const void *data, size_t len);
/** Wait for an answer and take it: protocol and counter into @ret_header, returns its data length;
 * -1: none. */
int terminal_take(struct bench *b, uint8_t *ret_header, uint8_t *data, size_t capacity);
/** One SDO request of 10 bytes (command, index, subindex, value) and its answer's data length. */
int terminal_sdo(struct bench *b, uint8_t command, uint16_t index, uint8_t subindex, uint32_t value,
		 uint8_t *answer);

#endif
