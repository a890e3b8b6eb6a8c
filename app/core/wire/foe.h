/* SPDX-License-Identifier: MIT */
/*
 * File access over EtherCAT (FoE, ETG.1000.6 part 5.8): six bytes of header, then a name, a text or
 * data. Bytes may be anything: every access is bounded. Context: any, RT-safe.
 */
#ifndef WIRE_FOE_H
#define WIRE_FOE_H

#include <stddef.h>
#include <stdint.h>

enum { FOE_HEADER_BYTES = 6 };

enum foe_operation {
	FOE_READ = 1,
	FOE_WRITE = 2,
	FOE_DATA = 3,
	FOE_ACK = 4,
	FOE_ERROR = 5,
	FOE_BUSY = 6,
};

enum foe_error {
	FOE_ERROR_NOT_DEFINED = 0x8000,
	FOE_ERROR_NOT_FOUND = 0x8001,
	FOE_ERROR_ACCESS_DENIED = 0x8002,
	FOE_ERROR_DISK_FULL = 0x8003,
	FOE_ERROR_ILLEGAL = 0x8004,
	FOE_ERROR_PACKET_NUMBER = 0x8005,
	FOE_ERROR_EXISTS = 0x8006,
	FOE_ERROR_NO_USER = 0x8007,
	FOE_ERROR_BOOTSTRAP_ONLY = 0x8008,
	FOE_ERROR_NOT_IN_BOOTSTRAP = 0x8009,
	FOE_ERROR_NO_RIGHTS = 0x800a,
	FOE_ERROR_PROGRAM = 0x800b,
	FOE_ERROR_CHECKSUM = 0x800c,
	FOE_ERROR_FIRMWARE = 0x800d,
	FOE_ERROR_NO_FILE = 0x800f,
	FOE_ERROR_NO_HEADER = 0x8010,
	FOE_ERROR_FLASH = 0x8011,
};

/* One message, taken apart. */
struct foe_message {
	uint8_t operation; /* enum foe_operation */
	/* READ, WRITE: password (0: none); DATA, ACK: packet number; ERROR: enum foe_error */
	uint32_t number;
	uint16_t busy_done;  /* BUSY: so much ... */
	uint16_t busy_all;   /* ... of this is done; 0: not known */
	const uint8_t *body; /* READ, WRITE: file name; DATA: data; ERROR, BUSY: text */
	size_t body_len;
};

/** Take @data (mailbox data without the mailbox header) apart. 0; -EBADMSG: no FoE message. */
int foe_parse(const uint8_t *data, size_t data_len, struct foe_message *ret);
/** Write @m to @data of @capacity bytes. Returns its length; 0: it does not fit. */
size_t foe_format(const struct foe_message *m, uint8_t *data, size_t capacity);

/** Text of an error code; "unknown error" for one that is not listed. */
const char *foe_error_to_str(uint32_t code);

#endif
