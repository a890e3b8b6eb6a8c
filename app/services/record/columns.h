/* SPDX-License-Identifier: MIT */
/*
 * A recording as a table: a row a cycle, a column a channel. Learns the columns from schemas and
 * channels, then gathers the messages of one cycle. Context: blocking.
 */
#ifndef RECORD_COLUMNS_H
#define RECORD_COLUMNS_H

#include <stdio.h>

#include "record/log.h"
#include "record/mcap_reader.h"

struct columns;

/** @channels: names separated by commas, NULL for all; kept. NULL with errno. */
struct columns *columns_create(const char *channels, int is_raw, enum log_format format);
void columns_destroy(struct columns *c);

/** Take a schema or channel of the recording. 0, -ENOMEM. Topics that are not a slave's are left
 * out. */
int columns_learn(struct columns *c, const struct mcap_item *item);
/**
 * All channels are known: check that every requested one exists. 0; -ENOENT with its name in
 * @ret_missing; -ENOTSUP: the raw values of the one in @ret_missing were not recorded; -ENODATA:
 * there is no "/ecdaq/cycle".
 */
int columns_freeze(struct columns *c, char *ret_missing, size_t missing_bytes);
int columns_is_frozen(const struct columns *c);
/** 1 if both are the same table: names and units. */
int columns_are_equal(const struct columns *a, const struct columns *b);

/** 1 if the message begins a cycle: put the row gathered so far, then begin the next. */
int columns_is_cycle(const struct columns *c, const struct mcap_item *item);
/** Begin a row with a cycle message; take another message into it. 0 or -EBADMSG. */
int columns_begin_row(struct columns *c, const struct mcap_item *item);
int columns_take(struct columns *c, const struct mcap_item *item);
/** 1 if a row was begun. */
int columns_has_row(const struct columns *c);
uint64_t columns_row_cycle(const struct columns *c);

/** How many there are, once they are frozen; name and unit ("" without one) of each; whether it is
 * of a channel, or says if the slave's sample is good. */
size_t columns_count(const struct columns *c);
const char *columns_name(const struct columns *c, size_t i);
const char *columns_unit(const struct columns *c, size_t i);
int columns_is_channel(const struct columns *c, size_t i);
/** The value of column @i in the row, as it is put. 0: the cell is empty. */
int columns_number(const struct columns *c, size_t i, double *ret);

/** @text as a field of a CSV line (RFC 4180). */
void columns_put_csv_text(FILE *out, const char *text);
/** The names as one CSV line, "piccolo0.adc [V]"; the row gathered, as a CSV line or a JSON object.
 */
void columns_put_header(const struct columns *c, FILE *out);
void columns_put_row(const struct columns *c, FILE *out);

#endif
