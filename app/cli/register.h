/* SPDX-License-Identifier: MIT */
/*
 * Registers of an ESC by name, and what their bits are: as the ET1100 data sheet, section II, and
 * ETG.1000.4 have them. Context: any.
 */
#ifndef CLI_REGISTER_H
#define CLI_REGISTER_H

#include <stddef.h>
#include <stdint.h>

enum {
	REGISTER_NAME_BYTES = 32,
	REGISTER_TEXT_BYTES = 64,
};

struct register_field {
	const char *name;
	uint8_t first_bit; /* of the register's bytes, little-endian */
	uint8_t bits;      /* 1 to 64 */
	uint8_t meaning;   /* of the number; 0: none */
};

/* One register, or @count of the same kind: their names end with a number. */
struct esc_register {
	const char *name;
	uint16_t address;
	uint8_t bytes;
	uint8_t count;                       /* 1: there is one, without a number in its name */
	uint8_t stride;                      /* bytes from one to the next */
	const struct register_field *fields; /* up to one without a name; NULL: it is a number */
};

/** The register that @name names, "al_status" or "sm2", in @ret_address where it is; NULL: none.
 * Letters of either case. */
const struct esc_register *register_find(const char *name, uint32_t *ret_address);
/** The register at @address; NULL: none has a name, or it begins elsewhere. */
const struct esc_register *register_at(uint32_t address);
/** Its name as register_find() takes it. */
void register_name(const struct esc_register *reg, uint32_t address,
		   char ret_name[REGISTER_NAME_BYTES]);
/** The @number-th register of the table; NULL: there are no more. */
const struct esc_register *register_number(size_t number);
/** The value of a field in the register's @bytes. */
uint64_t register_field_value(const struct register_field *field, const uint8_t *bytes);
/** What @value of the field means, "SAFE-OP" say; "": nothing but the number. */
void register_field_text(const struct register_field *field, uint64_t value,
			 char ret_text[REGISTER_TEXT_BYTES]);

#endif
