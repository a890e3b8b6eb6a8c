/* SPDX-License-Identifier: MIT */
/*
 * Where results and alarms go: a ring of results, a ring of events and a status page in the run
 * directory, for ecdaq-record, ecdaq-dds and ecdaq. Context: blocking.
 */
#ifndef SYNC0_OUTPUT_H
#define SYNC0_OUTPUT_H

#include "base/event.h"
#include "base/sync0.h"
#include "config/config.h"

struct output;

/** NULL with errno. Nothing is created in the run directory yet. Free with output_destroy(). */
struct output *output_create(const struct config *cfg, enum sync0_source source);
void output_destroy(struct output *out);

enum { OUTPUT_WHY_BYTES = 256 };

/**
 * Create rings and page if they do not exist or their directory was replaced. 0, or -errno with
 * one line in @why (OUTPUT_WHY_BYTES): -ENOENT: the run directory is not there yet; -EBUSY: another
 * process has them.
 */
int output_open(struct output *out, char *why);

/** The page, to be filled; never NULL (one of its own until output_open() has succeeded). */
struct sync0_status *output_page(struct output *out);
/** Write @text to the page, and to standard error if it differs from the last text. */
void output_message(struct output *out, const char *text);

void output_result(struct output *out, const struct sync0_result *result);
void output_event(struct output *out, const struct event *event);

#endif
