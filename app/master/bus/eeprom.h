/* SPDX-License-Identifier: MIT */
/*
 * One command to the EEPROM of one slave (ESC registers 0x0500 to 0x050f), as a state machine that
 * does no I/O: eeprom_prepare() says which registers to access next, eeprom_take() looks at the
 * answers. So many slaves can be read at the same time, and none makes the caller wait. A word that
 * was not read is an error, never a value: a command that found the interface busy is repeated
 * until its time is over. Context: service thread.
 */
#ifndef BUS_EEPROM_H
#define BUS_EEPROM_H

#include <stddef.h>
#include <stdint.h>

#include "base/clock.h"
#include "bus/access.h"

enum eeprom_operation { EEPROM_OP_READ, EEPROM_OP_WRITE, EEPROM_OP_RELOAD };

/* 0x0502, ET1100 data sheet. */
enum eeprom_status {
	EEPROM_WRITE_ENABLE = 1 << 0,
	EEPROM_EMULATED = 1 << 5, /* the PDI answers */
	EEPROM_READS_8_BYTES = 1 << 6,
	EEPROM_COMMAND_MASK = 7 << 8,
	EEPROM_CHECKSUM_ERROR = 1 << 11,
	EEPROM_NOT_LOADED = 1 << 12,
	EEPROM_NO_ACKNOWLEDGE = 1 << 13,
	EEPROM_WRITE_REFUSED = 1 << 14,
	EEPROM_BUSY = 1 << 15,
};

enum {
	EEPROM_DATA_BYTES = 8,
	EEPROM_ACCESSES = 2, /* at most, of one step */
	EEPROM_WORDS_MAX = 4,
};

struct eeprom_command {
	enum eeprom_operation operation;
	uint16_t station;                /* configured address */
	uint32_t word;                   /* EEPROM address */
	uint8_t data[EEPROM_DATA_BYTES]; /* read, or the two bytes to write */
	uint8_t words;                   /* that a read returned: 2 or 4 */
	uint16_t status;                 /* 0x0502 as last seen */
	/* eeprom.c */
	mono_t give_up;
	uint8_t step;
	int problem; /* -errno that the end of the time would give now */
	uint8_t frame[16];
};

/** Begin; @give_up bounds it. */
void eeprom_begin(struct eeprom_command *cmd, enum eeprom_operation operation, uint16_t station,
		  uint32_t word, mono_t give_up);
/** Read @word next, right after a read that is done: the interface is the master's already. */
void eeprom_read_next(struct eeprom_command *cmd, uint32_t word);
/** The next register accesses, at most EEPROM_ACCESSES, into @ret. Returns how many. */
size_t eeprom_prepare(struct eeprom_command *cmd, struct access *ret);
/**
 * They came back at @now: 1 go on; 0 done; -EBUSY the interface stayed busy, -ENXIO the slave did
 * not answer, -EREMOTEIO the EEPROM did not acknowledge, -EACCES it is not given to the master or
 * refuses to be written: all until the time was over; -EBADMSG two slaves answered.
 */
int eeprom_take(struct eeprom_command *cmd, const struct access *access, mono_t now);
/** No frame came back instead: 1 go on, as any access of a command may be repeated; -ETIMEDOUT the
 * time was over. */
int eeprom_lost(struct eeprom_command *cmd, mono_t now);
/** What a result of either means, for an error line. */
const char *eeprom_error_text(int result);

#endif
