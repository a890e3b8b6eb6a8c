/* SPDX-License-Identifier: MIT */
/* The sample ring as it fills: what comes next, until ecdaqd or the user ends it. */
#ifndef CLI_FOLLOW_H
#define CLI_FOLLOW_H

#include <stdint.h>

#include "base/status.h"
#include "cli/source.h"

struct follow {
	struct cli *cli;
	struct samples samples;
	const struct status_page *page; /* NULL: cannot be read */
	int64_t idle_ns;                /* how long to sleep when there is nothing */
	int is_idle;
	int key; /* typed since the call before (cli/screen.h), or 0 */
};

enum follow_result {
	FOLLOW_SAMPLE,  /* samples_header() and samples_image() hold it */
	FOLLOW_LOST,    /* this reader was too slow; *ret_lost samples are gone */
	FOLLOW_IDLE,    /* nothing more for now: write out what you have */
	FOLLOW_NEW_BUS, /* ecdaqd has restarted the bus: look channels up again */
	FOLLOW_ENDED,   /* ecdaqd has ended */
	FOLLOW_DAMAGED, /* the ring was truncated or overwritten */
	FOLLOW_OVER,    /* the user has requested the end */
};

/** Start at the newest sample. EXIT_CODE_OK, or the code of a failure, which has been reported. */
enum exit_code follow_open(struct cli *cli, struct follow *ret_follow);
void follow_close(struct follow *follow);

enum follow_result follow_next(struct follow *follow, uint64_t *ret_lost);

#endif
