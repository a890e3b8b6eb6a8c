/* SPDX-License-Identifier: MIT */
/* What to do about the AL status codes of slaves that refuse a state. Context: any. */
#ifndef CLI_HINTS_H
#define CLI_HINTS_H

#include <stdio.h>

#include "base/status.h"

/** A hint for each different code, with the first slave that has it; up to @columns wide, 0: any
 * width. */
void hints_write(const struct status_page *page, int columns, FILE *out);

#endif
