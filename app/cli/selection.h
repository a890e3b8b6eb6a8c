/* SPDX-License-Identifier: MIT */
/*
 * Slaves selected by --position and --alias, as with IgH's ethercat: lists of numbers and ranges
 * with commas between ("0,3-5", "2-", "-"). A verb sees them as SLAVE words: one that takes
 * SLAVE... gets all of them, another one is run once for each. Context: blocking.
 */
#ifndef CLI_SELECTION_H
#define CLI_SELECTION_H

#include <stdint.h>

#include "base/args.h"
#include "base/limits.h"
#include "cli/cli.h"

enum { SELECTION_WORD_BYTES = 24 }; /* "position:511" */

struct selection {
	uint16_t pos[LIMIT_SLAVES];
	unsigned count; /* 0: not made yet */
	unsigned next;  /* of those that the verb is run for one by one */
	char **words;   /* operands of the run that is under way */
	char (*name)[SELECTION_WORD_BYTES];
};

/** 1 if @text is a list of numbers of up to 65535; else 0. */
int selection_is_list(const char *text);

/**
 * For cli->select: put SLAVE words in the place of --position and --alias into @args. EXIT_CODE_OK,
 * or the code of a failure, which has been reported: 2 for wrong grammar, 1 if nothing is selected.
 */
enum exit_code selection_apply(struct cli *cli, struct args *args);
/** 1 if the verb is to be run again, for the next slave. */
int selection_has_more(const struct selection *selection);
void selection_done(struct selection *selection);

#endif
