/* SPDX-License-Identifier: MIT */
/* One sample's chosen channels as a line, of text or of JSON. Context: blocking. */
#ifndef CLI_LINES_H
#define CLI_LINES_H

#include "cli/choose.h"
#include "cli/source.h"

struct lines {
	const struct samples *samples; /* the slot that was read last is shown */
	const struct choice *choice;
	int is_raw;
};

/** 1 if the sample of the channel's slave is not good (reader/table.h). */
int lines_is_bad(const struct sample_header *header, const struct channel *ch);

void lines_write_head(const struct lines *lines);
void lines_write_text(const struct lines *lines);
void lines_write_json(const struct lines *lines);

#endif
