/* SPDX-License-Identifier: MIT */
/* Results, events and calibrations as lines of text or JSON. Context: blocking. */
#ifndef SYNC0_PRINT_H
#define SYNC0_PRINT_H

#include <stdio.h>

#include "base/event.h"
#include "base/sync0.h"
#include "sync0/calibration.h"
#include "sync0/edge_file.h"

void print_result(const struct sync0_result *r, FILE *out);
void print_result_json(const struct sync0_result *r, FILE *out);
/** What is recorded of a slave: item of kind EDGE_ITEM_LINE. */
void print_line(const struct edge_item *item, FILE *out);
void print_line_json(const struct edge_item *item, FILE *out);
void print_event(const struct event *ev, FILE *out);
void print_event_json(const struct event *ev, FILE *out);
void print_calibration(const struct calibration *c, FILE *out);

#endif
