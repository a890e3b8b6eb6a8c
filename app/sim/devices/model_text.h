/* SPDX-License-Identifier: MIT */
/*
 * Words, numbers and texts of a catalogue entry (slave_model_parse.c). Each function returns 1, or
 * -EBADMSG with the line in parse->error; next_word() and choose_all() 0 at the end of the line.
 */
#ifndef SIM_DEVICES_MODEL_TEXT_H
#define SIM_DEVICES_MODEL_TEXT_H

#include <stddef.h>
#include <stdint.h>

#include "devices/slave_model.h"

enum { WORD_BYTES = SII_NAME_BYTES };

struct parse {
	struct slave_model *m;
	const char *pos; /* next byte */
	unsigned line;
	/* The open "repeat"; NULL: none. */
	const char *repeat_pos;
	unsigned repeat_line;
	long repeat_end; /* the first channel behind it */
	long channel;    /* from 0 */
	int has_product;
	int has_ports;
	char word[WORD_BYTES]; /* the last one read */
	char *error;
	size_t error_bytes;
};

struct word_value {
	const char *word;
	unsigned value;
};

/** "NAME.txt:LINE: ..." into the error. Returns -EBADMSG. */
__attribute__((format(printf, 2, 3))) int parse_fail(struct parse *p, const char *format, ...);

void skip_spaces(struct parse *p);
int is_line_end(char c);
int next_word(struct parse *p);
int need_word(struct parse *p, const char *what);
/** The number @text, BASE+STEP in a repeat, from @min to @max. */
int number_of(struct parse *p, const char *text, const char *what, long long min, long long max,
	      long long *ret);
/** The next word as a number. */
int number(struct parse *p, const char *what, long long min, long long max, long long *ret);
int number16(struct parse *p, const char *what, uint16_t *ret);
/** The next word as INDEX:SUBINDEX. */
int object_address(struct parse *p, uint16_t *ret_index, uint8_t *ret_subindex);
/** The next text in quotes; its number, the same one for equal texts. */
int text_number(struct parse *p, uint8_t *ret);
/** The value of parse->word in @table. */
int choose(struct parse *p, const struct word_value *table, size_t count, unsigned *ret);
/** All words to the end of the line, their values ORed. */
int choose_all(struct parse *p, const struct word_value *table, size_t count, unsigned *ret);

#endif
