/* SPDX-License-Identifier: MIT */
/* Names as ROS 2 and IDL allow them, from names as people give them. Context: any. */
#ifndef RECORD_NAMES_H
#define RECORD_NAMES_H

#include <stddef.h>

/**
 * A field name: a-z first, then a-z 0-9 and single underscores, none at the end; no word that IDL,
 * C++ or Python keeps for itself. Never empty. "Status Word.1" -> "status_word_1".
 */
void name_make_field(const char *name, char *buf, size_t buf_len);

/** A type name from a field name: "piccolo0_left" -> "Piccolo0Left". */
void name_make_type(const char *field_name, char *buf, size_t buf_len);

/** @text with what is not printable ASCII, and what would end a comment line, replaced by '?'. */
void name_make_comment(const char *text, char *buf, size_t buf_len);

#endif
