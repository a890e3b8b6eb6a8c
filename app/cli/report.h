/* SPDX-License-Identifier: MIT */
/* The state of ecdaqd and ecdaq-record, gathered once and shown as a screen, a summary or JSON. */
#ifndef CLI_REPORT_H
#define CLI_REPORT_H

#include <stdio.h>

#include "base/status.h"
#include "base/sync0.h"
#include "program/json.h"

struct report {
	const struct status_page *page;
	const struct record_status *record; /* NULL: no recorder was started */
	const struct dds_status *dds;       /* NULL: no ecdaq-dds was started */
	const struct stream_status *stream; /* NULL: no ecdaq-stream was started */
	const struct uplink_status *uplink; /* NULL: no ecdaq-uplink was started */
	const struct sync0_status *sync0;   /* NULL: no ecdaq-sync0 was started */
	int is_running;                     /* ecdaqd's process is there */
	int is_recorder_running;
	int is_dds_running;
	int is_stream_running;
	int is_uplink_running;
	int is_sync0_running;
	int has_wkc; /* the newest sample could be read */
	uint16_t wkc;
	uint16_t wkc_expected;
	uint32_t flags; /* of the newest sample */
	int is_summary; /* of a run that has ended, "state" is what it was when it was stopped */
};

struct cli;
/**
 * Look at the rest of the run directory; @page (NULL: there is none) and @record as they were
 * mapped. Release what was mapped besides with report_release().
 */
void report_gather(struct cli *cli, const struct status_page *page,
		   const struct record_status *record, struct report *ret_report);

void report_release(const struct report *report);

enum report_detail { REPORT_FULL, REPORT_SHORT };
enum report_sort {
	REPORT_BY_POSITION,
	REPORT_BY_TROUBLE, /* lost, not in the state of the bus, with errors; then by position */
	REPORT_BY_NAME,
	REPORT_BY_BAD,    /* most bad samples first */
	REPORT_BY_ERRORS, /* most receive errors and lost links first */
	REPORT_SORT_COUNT,
};

/** "trouble" and the like; NULL for a number out of range. */
const char *report_sort_to_str(unsigned sort);

/**
 * Bus, cycle, times, recorder, services. @columns: what lines must fit; 0: any width. REPORT_SHORT:
 * the figures that trouble shows in, in half of the lines.
 */
void report_write_head(const struct report *report, enum report_detail detail, int columns,
		       FILE *out);
/** The heading of report_write_slaves(); nothing without slaves. */
void report_write_slaves_heading(const struct report *report, int columns, FILE *out);
/** One slave a line; where @columns are few, its AL status code may have a line below. */
void report_write_slaves(const struct report *report, enum report_sort sort, int columns,
			 FILE *out);
/** The screen of `ecdaq status`: all of these. */
void report_write_screen(const struct report *report, int columns, FILE *out);
/** A few lines for the end of a run. */
void report_write_summary(const struct report *report, FILE *out);
/** One JSON object, without the end of the line; doc/reference/cli.md lists its keys. */
void report_write_json(const struct report *report, struct json *js);

/** The worst verdict of all lines; a lost line is a failed one. */
uint32_t report_sync0_verdict(const struct sync0_status *page);

/** One slave as a JSON object in an array. */
void report_slave_json(const struct status_page *page, uint32_t index, struct json *js);

#endif
