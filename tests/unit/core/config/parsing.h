/* SPDX-License-Identifier: MIT */
/* Texts of a file "t.yaml" that are taken or refused. */
#ifndef TESTS_UNIT_CONFIG_PARSING_H
#define TESTS_UNIT_CONFIG_PARSING_H

#include "config/config.h"

/** @text must be taken; nothing of what @cfg was before is left. */
void parse_ok(const char *text, struct config *cfg);
/** @text must be refused with just this one line, and leave the configuration unchanged. */
void parse_fails(const char *text, const char *wanted);

#endif
