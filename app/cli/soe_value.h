/* SPDX-License-Identifier: MIT */
/* Values of SoE parameters as their attribute says: width, format, decimal places, list or not.
 * Context: any. */
#ifndef CLI_SOE_VALUE_H
#define CLI_SOE_VALUE_H

#include <stddef.h>
#include <stdint.h>

#include "program/json.h"

enum { SOE_ITEM_BYTES = 40 };

/** "2 bytes, unsigned, 1 decimal place". */
void soe_attribute_format(uint32_t attribute, char *buf, size_t buf_len);

/** Where the current data of a list are in @bytes of @len (any), and how many. */
const uint8_t *soe_list_data(const uint8_t *bytes, size_t len, size_t *ret_len);

/** One number of soe_value_bytes(@attribute) at @bytes as text. */
void soe_item_format(uint32_t attribute, const uint8_t *bytes, char ret_text[SOE_ITEM_BYTES]);
/** The same as a JSON value. */
void soe_item_json(struct json *js, const char *key, uint32_t attribute, const uint8_t *bytes);

/**
 * What is written for @text: a number, the numbers of a list with commas between, or a text; a list
 * has its header. @capacity: SOE_LIST_HEADER_BYTES and 8 for each character of @text. Its length;
 * -EINVAL; -ERANGE: a number does not fit.
 */
int soe_value_parse(uint32_t attribute, const char *text, uint8_t *ret_bytes, size_t capacity);

/** 1: a list whose bytes are a text. */
int soe_is_text(uint32_t attribute);

#endif
