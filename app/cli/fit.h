/* SPDX-License-Identifier: MIT */
/*
 * Text that fits the width of a terminal. Colours (SGR sequences, "\033[...m") and continuation
 * bytes of UTF-8 take no column. Context: any.
 */
#ifndef CLI_FIT_H
#define CLI_FIT_H

#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

/** Columns that @line takes, up to its end or newline. */
int fit_width(const char *line);
/** How many of the @len bytes of @line fit @columns; colours behind the last one included. */
size_t fit_cut(const char *line, size_t len, int columns);

/**
 * Write the lines of @text, each in as many lines of up to @columns as it takes: broken where its
 * fields are separated (two blanks or more), else between words, else where it must be. What
 * continues a line begins with @indent blanks. 0 columns: as it is.
 */
void fit_write(const char *text, int columns, int indent, FILE *out);

/** One line of @len bytes, without its newline: the same, but what continues it begins with
 * @prefix. */
void fit_write_line(const char *line, size_t len, int columns, const char *prefix, FILE *out);

/* Text on its way to a terminal. */
struct fit {
	FILE *to;
	FILE *text_out;
	char *text;
	size_t len;
	int columns;
};

/**
 * Where to write text that fit_end() writes to @to as fit_write() does. 0 @columns, or no memory:
 * that is @to itself.
 */
FILE *fit_begin(struct fit *fit, int columns, FILE *to);
void fit_end(struct fit *fit, int indent);

/** @name in up to @columns (1 or more) characters: what is left out of the middle is a '~'. */
const char *fit_name(const char *name, int columns, char *buf, size_t buf_len);

/** @count in up to @columns (5 or more) characters: "123456", "1.23M". */
const char *fit_count(uint64_t count, int columns, char *buf, size_t buf_len);

#endif
