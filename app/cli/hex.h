/* SPDX-License-Identifier: MIT */
/* Bytes as people read them, and numbers as they write them. Context: any. */
#ifndef CLI_HEX_H
#define CLI_HEX_H

#include <stddef.h>
#include <stdint.h>
#include <sys/types.h>

/** "0a 1b", two digits a byte, as many as fit into @buf (3 a byte). */
void hex_format(const uint8_t *bytes, size_t len, char *buf, size_t buf_len);
/** Lines of 16 bytes to standard output, each behind the address of its first; @start is that of
 * the first byte. */
void hex_dump(const uint8_t *bytes, size_t len, uint32_t start);
/** Bytes of "0a1b" or "0a 1b": how many; -EINVAL: something else, or more than @capacity. */
ssize_t hex_parse(const char *text, uint8_t *ret_bytes, size_t capacity);
/** A number in decimal, or in hex with 0x, from 0 to @high: 0; -EINVAL. */
int hex_number(const char *text, uint32_t high, uint32_t *ret_value);

#endif
